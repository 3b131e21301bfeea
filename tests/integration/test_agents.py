"""AGENTS.md and llms.txt, here and in what `visualhfsm new` makes: every command that they name runs."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Final

import pytest

from tests.support.pages import blocks_of
from tests.support.places import ROOT
from tests.support.reader import Reader, commands_of
from visualhfsm._commands.new import new

pytestmark = [pytest.mark.slow, pytest.mark.sim]

PROGRAMS: Final = Path(sys.prefix, "bin")
LINK: Final = re.compile(r"\[[^\]]+\]\(([^)]+)\)")


@pytest.fixture(params=["here", "project", "hardware"])
def folder(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """Return the checkout, apart from what would be written into it, or a new project, or a new robot."""
    made = tmp_path / "made"
    if request.param != "here":
        new(made, hardware=request.param == "hardware")
        return made
    made.mkdir()
    for name in (
        "AGENTS.md",
        "llms.txt",
        "README.md",
        "CONTRIBUTING.md",
        "ARCHITECTURE.md",
        "docs",
        "behaviors",
    ):
        (made / name).symlink_to(ROOT / name)
    return made


def test_every_command_runs(folder: Path) -> None:
    page = (folder / "AGENTS.md").read_text("utf-8")
    typed: list[str] = []
    with Reader(folder, PROGRAMS) as reader:
        for block in blocks_of(page):
            if block.name is not None:
                reader.save(block.name, block.text)
                continue
            for command in commands_of(block.text, block.language):
                reader.type(command)
                typed.append(command.text)
    named = re.findall(r"`((?:visualhfsm|nao|codegen|pytest) [a-z]+)", page)
    assert {"visualhfsm verdict", "nao stop"} <= set(named)
    assert [name for name in named if not any(each.startswith(name) for each in typed)] == []


def test_the_links_of_both_lead_somewhere(folder: Path) -> None:
    for name in ("AGENTS.md", "llms.txt"):
        links = LINK.findall((folder / name).read_text("utf-8"))
        assert links
        assert [link for link in links if not (folder / link).exists()] == []


def test_llms_txt_has_its_form(folder: Path) -> None:
    """See https://llmstxt.org: a title, a summary, and sections that are lists of links."""
    title, summary, *rest = (folder / "llms.txt").read_text("utf-8").split("\n\n")
    assert re.fullmatch(r"# [^\n]+", title)
    assert all(line.startswith("> ") for line in summary.splitlines())
    sections = [part for part in rest if part.startswith("## ")]
    lists = [part.strip().splitlines() for part in rest if part.startswith("- ")]
    assert len(sections) == len(lists) >= 2
    assert all(re.match(rf"- {LINK.pattern}: ", line) for each in lists for line in each)
