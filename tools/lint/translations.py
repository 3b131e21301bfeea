"""Tutorials and their translations have the same code, pictures and figures, in the words of the page."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from babel.messages.pofile import read_po

from tests.support.pages import DOCS, blocks_of
from visualhfsm._base.languages import FOLDER

STRESSED: Final = {
    "Programming of a Nao humanoid in Gazebo using Hierarchical FSM",
    "STOP",
    "controlador P",
    "fantasma",
    "funciones",
    "inicial",
    "interfaces",
    "jerárquico",
    "lazo cerrado",
    "pan",
    "sistema de referencia del robot",
    "tilt",
    "transiciones",
}
"""What a translation stresses that is no text of the page."""


def mistakes() -> Iterator[str]:
    """Yield what differs in a translation, and what it calls otherwise than the page."""
    with (FOLDER / "es" / "page.po").open("rb") as file:
        texts = [text for each in read_po(file) for text in _all(each.string)]
    shown = [re.sub(r"\\{\w+\\}", ".+", re.escape(text)) for text in texts if re.sub(r"{\w+}|\W", "", text)]
    for english in sorted((DOCS / "tutorial").glob("*.md")):
        spanish = english.parent / "es" / english.name
        mine, theirs = (_contents(path.read_text("utf-8")) for path in (spanish, english))
        for kind in theirs:
            if mine[kind] != theirs[kind]:
                yield f"docs/tutorial/es/{english.name}: it has other {kind} than {english.name}"
        for name in _labels(spanish.read_text("utf-8")):
            if not any(re.fullmatch(each, name) for each in shown):
                yield f"docs/tutorial/es/{english.name}: the page has no *{name}*"


def _contents(text: str) -> dict[str, object]:
    """Return what is the same in all languages; numbers of tables as they are written in English."""
    cells = " ".join(line for line in text.splitlines() if line.startswith("|"))
    return {
        "code": [each.text for each in blocks_of(text)],
        "pictures": [Path(link).name for link in re.findall(r"!\[[^]]*\]\((.*?)\)", text)],
        "figures": Counter(re.findall(r"\d+(?:[.]\d+)?", re.sub(r"(?<=\d),(?=\d)", ".", cells))),
        "sections": len(re.findall("^## ", text, re.M)),
    }


def _labels(text: str) -> list[str]:
    """Return what a translation calls by its name on the page."""
    found = re.findall(r"(?<![*\w])\*{1,2}([^*]+?)\*{1,2}(?![*\w])", text)
    names = {part for name in found for part in " ".join(name.split()).split(" > ")}
    return sorted(name for name in names - STRESSED if not name.endswith(".") and "`" not in name)


def _all(text: str | Sequence[str] | None) -> Sequence[str]:
    return [text] if isinstance(text, str) else text or ()
