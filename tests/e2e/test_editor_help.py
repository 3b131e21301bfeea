"""The help of the page, and docs/reference/keys.md, which has the same keys.

SCREENSHOTS=1 pytest tests/e2e/test_editor_help.py writes that file again.
"""

from __future__ import annotations

import os
from pathlib import Path

from playwright.sync_api import Browser, expect

from tests.support.browser import editor_page
from tests.support.editor import DOCUMENT, editor
from tests.support.plugins import OF_THE_WHOLE
from tests.support.processes import REPOSITORY

KEYS = REPOSITORY / "docs" / "reference/keys.md"
HEAD = """# All keys of the editor

The keys that the page shows at `?`. `SCREENSHOTS=1 pytest tests/e2e/test_editor_help.py` writes this file from it.
"""
READ = """(sections) => sections.map((section) => [
    section.querySelector("h3").textContent,
    [...section.querySelectorAll("dd")].map((text) => [
        text.textContent.trim(),
        [...text.nextElementSibling.querySelectorAll("kbd")].map((key) => key.textContent),
    ]),
])"""


@OF_THE_WHOLE
def test_the_documented_keys_are_those_of_the_page(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "walk.xml"
    path.write_text(DOCUMENT)
    with editor(tmp_path, path) as running, editor_page(browser, running) as shown:
        shown.state("wait").wait_for()
        shown.press("?")
        dialog = shown.page.get_by_role("dialog", name="Help")
        expect(dialog).to_be_visible()
        groups = dialog.locator(".help section").evaluate_all(READ)
    text = HEAD
    for title, rows in groups:
        text += f"\n## {title}\n\n| | |\n|---|---|\n"
        text += "".join(f"| {', '.join(f'`{key}`' for key in keys)} | {what} |\n" for what, keys in rows)
    if os.environ.get("SCREENSHOTS"):
        KEYS.write_text(text)
    assert KEYS.read_text() == text
