"""Tutorials and their translations: the same code, pictures and figures, in the words of the page."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import pytest
from babel.messages.pofile import read_po

from tests.support.pages import DOCS, blocks_of
from visualhfsm._base.languages import FOLDER

PAGES: Final = sorted(path.name for path in (DOCS / "tutorial").glob("*.md"))
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


def text_of(page: str, language: str = "") -> str:
    return (DOCS / "tutorial" / language / page).read_text("utf-8")


def pictures(text: str) -> list[str]:
    return [Path(link).name for link in re.findall(r"!\[[^]]*\]\((.*?)\)", text)]


def figures(text: str) -> Counter[str]:
    """Return the numbers of the tables, as they are written in English."""
    cells = " ".join(line for line in text.splitlines() if line.startswith("|"))
    return Counter(re.findall(r"\d+(?:[.]\d+)?", re.sub(r"(?<=\d),(?=\d)", ".", cells)))


@pytest.mark.parametrize("page", PAGES)
def test_a_translation_has_the_same_code_pictures_and_figures(page: str) -> None:
    english, spanish = text_of(page), text_of(page, "es")
    assert [each.text for each in blocks_of(spanish)] == [each.text for each in blocks_of(english)]
    assert pictures(spanish) == pictures(english)
    assert figures(spanish) == figures(english)
    assert len(re.findall("^## ", spanish, re.M)) == len(re.findall("^## ", english, re.M))


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES)
def test_a_translation_calls_what_is_on_the_page_by_its_translated_name(page: str) -> None:
    with (FOLDER / "es" / "page.po").open("rb") as file:
        texts = [text for each in read_po(file) for text in _all(each.string)]
    shown = [re.sub(r"\\{\w+\\}", ".+", re.escape(text)) for text in texts if re.sub(r"{\w+}|\W", "", text)]
    found = re.findall(r"(?<![*\w])\*{1,2}([^*]+?)\*{1,2}(?![*\w])", text_of(page, "es"))
    names = [part for name in found for part in " ".join(name.split()).split(" > ")]
    labels = {name for name in names if not name.endswith(".") and "`" not in name} - STRESSED
    assert {name for name in labels if not any(re.fullmatch(each, name) for each in shown)} == set()


def _all(text: str | Sequence[str] | None) -> Sequence[str]:
    return [text] if isinstance(text, str) else text or ()
