"""README.md: its commands are accepted as shown, and its links work."""

from __future__ import annotations

import re
import shlex
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
import typer

from tests.support.processes import REPOSITORY

README = (REPOSITORY / "README.md").read_text("utf-8")
APPS = {
    "ballmover": ("ballmover.cli", "app"),
    "codegen": ("codegen.command", "app"),
    "nao": ("deploy.nao.command", "app"),
    "naoserver-sim": ("naoserver_sim.command", "app"),
    "visualhfsm": ("visualhfsm.command", "app"),
}
LINES = [
    line
    for block in re.findall(r"^```\n(.*?)^```", README, re.MULTILINE | re.DOTALL)
    for line in block.splitlines()
    if line.partition(" ")[0] in APPS
]


@pytest.mark.parametrize("line", LINES, ids=lambda line: line.partition("#")[0].strip())
def test_a_command_is_taken_as_it_stands_there(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    program, *words = shlex.split(line, comments=True)
    module, name = APPS[program]
    command: Any = typer.main.get_command(getattr(import_module(module), name))
    arguments = [found for word in words for found in (sorted(map(str, Path().glob(word))) or [word])]
    while arguments and hasattr(command, "commands"):
        program, *arguments = arguments
        command = command.commands[program]
    command.make_context(program, arguments)


def test_links_lead_somewhere() -> None:
    links = re.findall(r"\]\((?!https?:)([^)#]+)[^)]*\)", README)
    assert [link for link in links if not (REPOSITORY / link).exists()] == []
