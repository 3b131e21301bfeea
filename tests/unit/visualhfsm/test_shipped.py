"""The folders that come with the project, in a checkout and in an installed wheel."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.places import ROOT
from visualhfsm import shipped as module
from visualhfsm.shipped import shipped


def test_in_a_checkout_they_are_at_its_top() -> None:
    assert shipped("behaviors") == ROOT / "behaviors"
    assert (shipped("deploy") / "demo.toml").is_file()


def test_in_the_wheel_they_are_below_the_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_PACKAGE", tmp_path / "visualhfsm")
    inside = tmp_path / "visualhfsm" / "_shipped" / "behaviors"
    inside.mkdir(parents=True)
    (tmp_path / "behaviors").mkdir()
    assert shipped("behaviors") == inside
