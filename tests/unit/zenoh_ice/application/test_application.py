"""What commands say about a module that cannot be imported."""

from __future__ import annotations

import sys

import pytest

from zenoh_ice.application import missing_package


def test_a_package_that_is_not_installed_is_named_with_the_extra() -> None:
    assert missing_package(ModuleNotFoundError(name="mujoco"), "sim") == (
        "mujoco is not installed; type: pip install 'visualhfsm[sim]'"
    )


@pytest.mark.parametrize(
    ("version", "words"), [((3, 12, 9), "qi is not installed"), ((3, 13, 0), "3.11 or 3.12")]
)
def test_qi_is_not_offered_where_it_is_not_built(
    version: tuple[int, int, int], words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "version_info", version)
    assert words in missing_package(ModuleNotFoundError(name="qi"), "naoqi")
