"""What commands say about a module that cannot be imported."""

from __future__ import annotations

from zenoh_ice.application import missing_package


def test_a_package_that_is_not_installed_is_named_with_the_extra() -> None:
    assert missing_package(ModuleNotFoundError(name="mujoco"), "sim") == (
        "mujoco is not installed; type: pip install 'visualhfsm[sim]'"
    )
