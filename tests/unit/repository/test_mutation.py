"""The table of mutmut in pyproject.toml: what it names is there, so that no move leaves code without its tests."""

from __future__ import annotations

import tomllib
from typing import Any, Final

import pytest

from tests.support.places import ROOT

TABLE: Final[dict[str, Any]] = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["mutmut"]


@pytest.mark.parametrize("key", ["only_mutate", "pytest_add_cli_args_test_selection"])
def test_each_file_exists(key: str) -> None:
    assert len(TABLE[key]) > 10
    assert [name for name in TABLE[key] if not (ROOT / name).is_file()] == []


@pytest.mark.parametrize("key", ["source_paths", "also_copy"])
def test_each_folder_exists(key: str) -> None:
    assert [name for name in TABLE[key] if not (ROOT / name).is_dir()] == []
