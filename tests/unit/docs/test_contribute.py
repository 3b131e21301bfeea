"""docs/how-to/contribute.md: the files and folders that its recipes name are there."""

from __future__ import annotations

import re
from typing import Final

from tests.support.pages import DOCS
from tests.support.places import ROOT

PAGE: Final = (DOCS / "how-to" / "contribute.md").read_text("utf-8")
SHORTENED: Final = "visualhfsm/_editor/static"
"""The folder of the page's modules, which a step names once."""
MADE: Final = {"naoserver/bodies/rover/rover.json"}


def test_what_a_recipe_names_is_there() -> None:
    named = {*re.findall(r"[\w.-]+/[\w./-]+", " ".join(re.findall(r"`([^`]+)`", PAGE)))} - MADE
    assert len(named) > 30
    assert [
        name for name in sorted(named) if not ((ROOT / name).exists() or (ROOT / SHORTENED / name).exists())
    ] == []
