"""Screenshots of the editor for the documentation, taken by existing tests.

CONTRIBUTING.md says which: with SCREENSHOTS=1 they take them again; otherwise nothing is written.
"""

from __future__ import annotations

import io
import os
import time
from pathlib import Path
from typing import Final

from PIL import Image
from playwright.sync_api import Page

__all__ = ["moving_picture", "picture"]

FOLDER: Final = Path(__file__).parents[2] / "docs" / "pictures"
WIDE: Final = 960  # pixels of a picture that moves
PAUSE: Final = 100.0  # ms before each of its images
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


def moving_picture(page: Page, name: str, folder: str = "editor", *, seconds: float) -> None:
    """Save what happens on a page within some seconds as docs/pictures/FOLDER/NAME.webp, which repeats it."""
    if not os.environ.get("SCREENSHOTS"):
        return
    images = []
    began = time.monotonic()
    while (passed := time.monotonic() - began) < seconds:
        page.wait_for_timeout(PAUSE)
        shot = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
        images.append(shot.resize((WIDE, WIDE * shot.height // shot.width), Image.Resampling.LANCZOS))
    first, *others = images
    first.save(
        FOLDER / folder / f"{name}.webp",
        save_all=True,
        append_images=others,
        duration=round(1000 * passed / len(images)),
        loop=0,
        quality=60,
        method=6,
    )
