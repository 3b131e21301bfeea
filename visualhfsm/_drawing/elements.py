"""Elements of an SVG picture: made from numbers and words, and written as text."""

from __future__ import annotations

import math
import re
from typing import Final
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

_NAMESPACE: Final = "http://www.w3.org/2000/svg"
_NO_XML: Final = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""A character that XML cannot hold."""


def pixels(value: float) -> str:
    """Return a number of pixels as SVG has it, rounded to tenths."""
    rounded = math.floor(value * 10 + 0.5) / 10 + 0.0  # no minus before a zero
    return f"{rounded:.1f}".removesuffix(".0")


def element(name: str, *children: Element, text: str = "", **attributes: str | float) -> Element:
    """Return an element with a text or children; `stroke_width=1.6` is the attribute `stroke-width`."""
    made = Element(name)
    for key, value in attributes.items():
        made.set(key.replace("_", "-"), value if isinstance(value, str) else pixels(value))
    made.text = _NO_XML.sub("\N{REPLACEMENT CHARACTER}", text) or None
    made.extend(children)
    return made


def moved(point: complex) -> str:
    """Return the `transform` that moves what is around (0, 0) to a point."""
    return f"translate({pixels(point.real)},{pixels(point.imag)})"


def written(picture: Element) -> str:
    """Return an SVG element as the text of a file."""
    picture.set("xmlns", _NAMESPACE)
    for group in picture.iter("g"):
        group.tail = "\n"
    text = ElementTree.tostring(picture, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'
