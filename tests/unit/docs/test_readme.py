"""README.md: its commands are accepted as shown, and its links work. The text of other pages names real commands."""

from __future__ import annotations

import re
import shlex
from importlib import import_module
from pathlib import Path
from typing import Any

import click
import pytest
import typer

from tests.support.pages import DOCS
from tests.support.processes import REPOSITORY

README = (REPOSITORY / "README.md").read_text("utf-8")
APPS = {
    "ballmover": ("ballmover._cli", "app"),
    "codegen": ("codegen.command", "app"),
    "nao": ("visualhfsm.nao._command", "app"),
    "naoserver-naoqi": ("naoserver.naoqi._command", "app"),
    "naoserver-ros2": ("naoserver.ros2._command", "app"),
    "naoserver-sim": ("naoserver_sim._command", "app"),
    "visualhfsm": ("visualhfsm._command", "app"),
}
NAMED = {
    *APPS,
    *(
        "nao --install-completion",
        "nao call",
        "nao describe",
        "nao security",
        "nao security add",
        "nao security init",
    ),
    *("nao watch", "visualhfsm convert", "visualhfsm replay"),
}
"""Commands that the text only names, without their arguments; typer adds the first one when it runs."""
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
    take(line)


def take(line: str) -> None:
    """Check the words of a command as it does itself, without doing anything."""
    program, *words = shlex.split(line, comments=True)
    module, name = APPS[program]
    command: Any = typer.main.get_command(getattr(import_module(module), name))
    arguments = [found for word in words for found in (sorted(map(str, Path().glob(word))) or [word])]
    while arguments and hasattr(command, "commands"):
        program, *arguments = arguments
        command = command.commands[program]
    command.make_context(program, arguments)


def test_commands_in_the_text_of_tutorials_and_how_tos_are_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    taken = 0
    for page in [*(DOCS / "tutorial").rglob("*.md"), *(DOCS / "how-to").glob("*.md")]:
        text = re.sub(r"^```.*?^```", "", page.read_text("utf-8"), flags=re.M | re.S)
        for line in re.findall(r"`([^`\n]+)`", text):
            if line.split()[0] not in APPS or line in NAMED or line.endswith("<TAB>"):
                continue
            for name in re.findall(r"[\w/]+\.(?:xml|mcap|toml|idl)", line):
                (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
                (tmp_path / name).touch()
            try:
                take(line)
            except click.ClickException as refused:
                pytest.fail(f"{page.name}: {line}: {refused.format_message()}")
            taken += 1
    assert taken > 80


def test_links_lead_somewhere() -> None:
    links = re.findall(r"\]\((?!https?:)([^)#]+)[^)]*\)", README)
    assert [link for link in links if not (REPOSITORY / link).exists()] == []
