"""Screenshots of the editor for the documentation, taken by existing tests.

CONTRIBUTING.md says which: with SCREENSHOTS=1 they take them again; otherwise nothing is written.
"""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import Final

from PIL import Image
from playwright.sync_api import Page

__all__ = ["picture"]

FOLDER: Final = Path(__file__).parents[2] / "docs" / "pictures"
COLORS: Final = 255  # enough for the page, and a third of the file
HIDE_NOTICES: Final = """() => {
    const sheet = new CSSStyleSheet();
    sheet.replaceSync(".notices { visibility: hidden }");
    document.adoptedStyleSheets.push(sheet);
}"""
SHOW_NOTICES: Final = "() => document.adoptedStyleSheets.pop()"


def picture(page: Page, name: str, folder: str = "editor", *, after: float = 0.0) -> None:
    """Save a page without its notices as docs/pictures/FOLDER/NAME.png, `after` ms."""
    if not os.environ.get("SCREENSHOTS"):
        return
    page.wait_for_timeout(after)
    page.evaluate(HIDE_NOTICES)  # also those that come just now
    page.mouse.move(0, 0)
    shot = Image.open(io.BytesIO(page.screenshot(animations="disabled"))).convert("RGB")
    page.evaluate(SHOW_NOTICES)
    path = FOLDER / folder / f"{name}.png"
    path.parent.mkdir(exist_ok=True)
    shot.quantize(COLORS, Image.Quantize.MEDIANCUT).save(path, optimize=True)
