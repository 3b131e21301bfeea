"""What is looked for in pages that are written as files."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from playwright.sync_api import Page

from tests.support.browser import load_axe
from tests.support.targets import small_targets

__all__ = ["FOUND", "TOO_WIDE", "check"]

FOUND = """async () => {
  const rules = {"label-content-name-mismatch": {enabled: true}};
  const {violations} = await axe.run(document, {resultTypes: ["violations"], rules});
  return violations.flatMap(({id, nodes}) =>
    nodes.map((node) => `${id}: ${node.html.slice(0, 150)} ${node.failureSummary}`));
}"""
TOO_WIDE = """() => [document.documentElement, ...document.querySelectorAll("main, figure, table, section")]
  .filter((each) => each.scrollWidth > each.clientWidth + 1)
  .map((each) => `${each.tagName} ${each.className} ${each.scrollWidth} > ${each.clientWidth}`)"""


def check(page: Page, path: Path) -> None:
    """Open a page in both themes, and look for what is wrong."""
    themes: tuple[Literal["light", "dark"], ...] = ("light", "dark")
    for theme in themes:
        page.emulate_media(color_scheme=theme)
        page.goto(path.as_uri())
        page.get_by_role("heading", level=1).first.wait_for()
        load_axe(page)
        assert page.evaluate(FOUND) == [], theme
        assert small_targets(page) == []
