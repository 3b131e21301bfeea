"""Every command says its version."""

from __future__ import annotations

import sys
import tomllib
from importlib.metadata import EntryPoint, version

import pytest

from tests.support.places import ROOT
from tests.support.plugins import needs

SCRIPTS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["scripts"]


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=needs(module.partition(".")[0])) for name, module in SCRIPTS.items()],
)
def test_a_command_says_the_version_of_the_installed_wheel(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", [f"/usr/bin/{name}", "--version"])
    with pytest.raises(SystemExit) as ended:
        EntryPoint(name, SCRIPTS[name], "console_scripts").load()()
    assert ended.value.code == 0
    assert capsys.readouterr().out == f"{name} {version('visualhfsm')}\n"
