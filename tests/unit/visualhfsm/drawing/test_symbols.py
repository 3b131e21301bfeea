"""Pictures by Python have the glyphs, colours and measures of the page's canvas."""

from __future__ import annotations

import re
from typing import Final

from visualhfsm._base.html_file import STATIC
from visualhfsm._document import geometry
from visualhfsm._drawing import arcs, symbols

_GLYPH: Final = re.compile(r'(\w+) ?[:=] \{path: "([^"]+)", word: t\("[^"]+"\)(?:, filled: (true|false))?\}')
_NUMBER: Final = re.compile(r"^(?:export )?const ([A-Z_]+) = ([\d.]+);", re.MULTILINE)


def glyphs() -> dict[str, tuple[str, bool]]:
    """Return the path of every glyph of the page, and whether it is filled."""
    found = _GLYPH.findall((STATIC / "canvas" / "glyphs.js").read_text("utf-8"))
    return {name: (path, filled == "true") for name, path, filled in found}


def light_colors() -> dict[str, str]:
    """Return the colours of the light theme of the page by their names."""
    theme = (STATIC / "styles" / "theme.css").read_text("utf-8")
    return dict(re.findall(r"--([\w-]+): (#[0-9a-f]{6})", theme[: theme.index("}")]))


def measures(module: str) -> dict[str, float]:
    """Return the numbers that a module of the page defines."""
    found = _NUMBER.findall((STATIC / module).read_text("utf-8"))
    return {name: float(value) for name, value in found}


def test_the_glyphs_are_those_of_the_page() -> None:
    page = glyphs()
    ours = {name: (each.path, each.is_filled) for name, each in symbols.TRIGGERS.items()}
    ours["UNKNOWN_TRIGGER"] = (symbols.UNKNOWN_TRIGGER.path, symbols.UNKNOWN_TRIGGER.is_filled)
    ours |= {name: (path, False) for name, path in symbols.BADGES.items()}
    problems = ("error", "warning")  # of the editor alone
    assert ours == {name: glyph for name, glyph in page.items() if name not in problems}


def test_the_colors_are_those_of_the_light_theme() -> None:
    page = light_colors()
    for colors, kind in ((symbols.PLAIN, "plain"), (symbols.PARENT, "parent")):
        assert tuple(colors) == (page[kind], page[f"{kind}-line"], page[f"{kind}-ink"])
    assert (page["ink"], page["muted"], page["arc"]) == (symbols.INK, symbols.MUTED, symbols.ARC)


def test_the_measures_are_those_of_the_canvas() -> None:
    page = measures("measures/geometry.js")
    assert (page["RADIUS"], page["FAN"], page["LOOP"]) == (arcs.RADIUS, geometry.FAN, geometry.LOOP)
