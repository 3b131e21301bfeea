"""README.md: its commands are accepted as shown. The text of other pages names real commands."""

from __future__ import annotations

import re
import shlex
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.support.pages import DOCS, pages
from tests.support.plugins import OF_THE_WHOLE
from tests.support.processes import REPOSITORY
from tests.support.programs import PROGRAMS, app_of, expand, take

README = (REPOSITORY / "README.md").read_text("utf-8")
NAMED = {
    *PROGRAMS,
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
    if line.partition(" ")[0] in PROGRAMS
]


@pytest.mark.parametrize("line", LINES, ids=lambda line: line.partition("#")[0].strip())
def test_a_command_is_taken_as_it_stands_there(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if line.startswith("naoserver-naoqi"):
        pytest.importorskip("qi", reason="libqi has no package for this Python")
    monkeypatch.chdir(tmp_path)
    take_line(line)


def take_line(line: str) -> None:
    program, *words = shlex.split(line, comments=True)
    if words[:1] == ["diff"] and program == "codegen":
        program, words = "codegen diff", words[1:]
    take(app_of(program), program, expand(words, Path()))


@OF_THE_WHOLE
def test_commands_in_the_text_of_tutorials_and_how_tos_are_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    taken = 0
    for page in pages("tutorial", "how-to"):
        text = re.sub(r"^```.*?^```", "", (DOCS / page).read_text("utf-8"), flags=re.M | re.S)
        for line in re.findall(r"`([^`\n]+)`", text):
            if line.split()[0] not in PROGRAMS or line in NAMED or line.endswith("<TAB>"):
                continue
            if line.startswith("naoserver-naoqi") and find_spec("qi") is None:
                continue
            for name in re.findall(r"\w[\w/]*\.(?:xml|mcap|toml|idl)", line):
                (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
                (tmp_path / name).touch()
            try:
                take_line(line)
            except AssertionError as refused:
                raise AssertionError(f"{page}: {refused}") from refused
            taken += 1
    assert taken > 80
