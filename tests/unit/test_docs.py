"""The pages of docs/: their links lead somewhere, and the rules that they list are those of the code."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from codegen.idl.breaking_rules import BreakingRule
from tests.support.pages import DOCS

PAGES = sorted(DOCS.glob("*.md"))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    links = re.findall(r"\]\((?!https?:)([^)#]+)[^)]*\)", page.read_text("utf-8"))
    assert [link for link in links if not (page.parent / link).exists()] == []


def test_the_index_has_every_page() -> None:
    index = (DOCS / "README.md").read_text("utf-8")
    assert [page.name for page in PAGES if page.name != "README.md" and page.name not in index] == []


def test_every_breaking_rule_has_its_row() -> None:
    text = (DOCS / "breaking-changes.md").read_text("utf-8")
    rows = [
        [cell.strip() for cell in row.strip("|").split("|")] for row in re.findall(r"^\| B.*$", text, re.M)
    ]
    listed = {(code, breaks, why) for code, _, breaks, why in rows}
    assert listed == {(rule.code, ", ".join(rule.breaks), rule.consequence) for rule in BreakingRule}
