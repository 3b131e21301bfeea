"""Names of a package that are imported when they are first used."""

from __future__ import annotations

import decimal
import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

PACKAGE = """
from typing import TYPE_CHECKING

from zenoh_ice.lazy import import_on_use

if TYPE_CHECKING:
    from decimal import Decimal as Decimal

    from .clock import Clock as Clock
    from .clock import Renamed as Renamed

    from .clock import Hidden

__getattr__, __dir__ = import_on_use(__name__)
"""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    folder = tmp_path / "lazy_package"
    folder.mkdir()
    (folder / "__init__.py").write_text(PACKAGE)
    (folder / "clock.py").write_text("class Clock: pass\n\nclass Hidden: pass\n")
    monkeypatch.syspath_prepend(tmp_path)
    yield importlib.import_module("lazy_package")
    for name in [each for each in sys.modules if each.partition(".")[0] == "lazy_package"]:
        del sys.modules[name]


def test_a_name_is_found_in_a_module_of_the_package_and_of_another(package: ModuleType) -> None:
    assert "lazy_package.clock" not in sys.modules
    assert package.Clock is sys.modules["lazy_package.clock"].Clock
    assert package.Decimal is decimal.Decimal


@pytest.mark.parametrize("name", ["Clok", "Hidden"])
def test_an_unknown_name_is_an_attribute_error(package: ModuleType, name: str) -> None:
    with pytest.raises(AttributeError, match=f"module 'lazy_package' has no attribute '{name}'"):
        getattr(package, name)


def test_a_name_that_its_module_lacks_is_an_attribute_error(package: ModuleType) -> None:
    with pytest.raises(AttributeError, match=r"lazy_package\.clock"):
        _ = package.Renamed


def test_the_names_are_offered_beside_those_that_are_there(package: ModuleType) -> None:
    assert {"Clock", "Renamed", "Decimal", "import_on_use", "__name__"} <= {*dir(package)}
