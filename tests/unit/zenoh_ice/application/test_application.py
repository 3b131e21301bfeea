"""What commands say about a module that cannot be imported."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.limits import RUN_LIMIT
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


@pytest.mark.slow
def test_a_package_that_hides_ours_is_named(tmp_path: Path) -> None:
    hiding = tmp_path / "interfaces" / "__init__.py"
    hiding.parent.mkdir()
    hiding.touch()
    done = subprocess.run(
        [sys.executable, "-m", "naoserver_sim"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=False,
    )
    assert done.returncode == 1
    assert f"interfaces.nao is not in {hiding}, which hides ours: rename it" in done.stderr


def test_a_folder_of_that_name_hides_nothing(tmp_path: Path) -> None:
    (tmp_path / "interfaces").mkdir()
    (tmp_path / "interfaces" / "mine.py").write_text("MINE = True\n")
    code = "import interfaces.mine, interfaces.nao"
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, timeout=RUN_LIMIT, check=True)
