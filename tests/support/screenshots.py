"""Pictures of the editor for docs/how-to/editor.md, taken by a test that is there anyway.

SCREENSHOTS=1 pytest tests/e2e/test_editor_experiment.py takes them anew; otherwise nothing is written.
"""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import Final

from PIL import Image
from playwright.sync_api import Page

__all__ = ["picture"]

FOLDER: Final = Path(__file__).parents[2] / "docs" / "pictures" / "editor"
COLORS: Final = 255  # enough for the page, and a third of the file
HIDE_NOTICES: Final = """() => {
    const sheet = new CSSStyleSheet();
    sheet.replaceSync(".notices { visibility: hidden }");
    document.adoptedStyleSheets.push(sheet);
}"""
SHOW_NOTICES: Final = "() => document.adoptedStyleSheets.pop()"


def picture(page: Page, name: str) -> None:
    """Keep what a page shows as docs/pictures/editor/NAME.png."""
    if not os.environ.get("SCREENSHOTS"):
        return
    page.evaluate(HIDE_NOTICES)  # also those that come just now
    page.mouse.move(0, 0)
    shot = Image.open(io.BytesIO(page.screenshot(animations="disabled"))).convert("RGB")
    page.evaluate(SHOW_NOTICES)
    FOLDER.mkdir(exist_ok=True)
    shot.quantize(COLORS, Image.Quantize.MEDIANCUT).save(FOLDER / f"{name}.png", optimize=True)
