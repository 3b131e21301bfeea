"""Pictures of the editor for docs/editor.md, taken by a test that is there anyway.

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

FOLDER: Final = Path(__file__).parents[2] / "docs" / "editor"
COLORS: Final = 255  # enough for the page, and a third of the file


def picture(page: Page, name: str) -> None:
    """Keep what a page shows as docs/editor/NAME.png."""
    if not os.environ.get("SCREENSHOTS"):
        return
    page.evaluate(
        "document.querySelectorAll('.notice').forEach((each) => (each.style.visibility = 'hidden'))"
    )
    page.mouse.move(0, 0)
    shot = Image.open(io.BytesIO(page.screenshot(animations="disabled"))).convert("RGB")
    FOLDER.mkdir(exist_ok=True)
    shot.quantize(COLORS, Image.Quantize.MEDIANCUT).save(FOLDER / f"{name}.png", optimize=True)
