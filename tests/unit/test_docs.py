"""The pages of docs/: their links lead somewhere, and the rules that they list are those of the code."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import typer
from typer.core import TyperGroup

from codegen.commands import app
from codegen.idl.breaking import BreakingRule
from tests.support.pages import DOCS

PAGES = sorted(DOCS.glob("*.md"))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    links = re.findall(r"\]\((?!https?:)([^)#]+)[^)]*\)", page.read_text("utf-8"))
    assert [link for link in links if not (page.parent / link).exists()] == []


def test_the_index_has_every_page() -> None:
    index = (DOCS / "README.md").read_text("utf-8")
    assert [page.name for page in PAGES if page.name != "README.md" and page.name not in index] == []


def test_every_command_and_option_of_codegen_is_explained() -> None:
    text = (DOCS / "codegen.md").read_text("utf-8")
    group = typer.main.get_command(app)
    assert isinstance(group, TyperGroup)
    commands = group.commands
    names = {option for command in commands.values() for param in command.params for option in param.opts}
    options = {name for name in names if name.startswith("-")} | {opt for p in group.params for opt in p.opts}
    missing = {name for name in options - {"--help"} if f"`{name}" not in text and f" {name}" not in text}
    assert missing == set()
    assert [name for name in commands if name != "generate" and f"codegen {name} " not in text] == []


def test_every_breaking_rule_has_its_row() -> None:
    text = (DOCS / "breaking-changes.md").read_text("utf-8")
    rows = [
        [cell.strip() for cell in row.strip("|").split("|")] for row in re.findall(r"^\| B.*$", text, re.M)
    ]
    listed = {(code, breaks, why) for code, _, breaks, why in rows}
    assert listed == {(rule.code, ", ".join(rule.breaks), rule.consequence) for rule in BreakingRule}
