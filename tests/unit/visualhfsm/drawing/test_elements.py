"""Elements of pictures: numbers as SVG has them, and texts that XML can hold."""

from __future__ import annotations

from xml.etree import ElementTree

import pytest

from visualhfsm._drawing.elements import element, pixels, written


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (-0.04, "0"), (12.0, "12"), (0.25, "0.3"), (-1.55, "-1.5"), (1e6, "1000000")],
)
def test_numbers_are_rounded_to_tenths_and_never_have_an_exponent(value: float, text: str) -> None:
    assert pixels(value) == text


def test_a_picture_is_a_file_of_xml() -> None:
    text = "\x00<a>&\ud800\x1f\ufffe\U0001f916"
    picture = written(element("svg", element("g", element("text", text=text, font_size=12)), width=3))
    assert picture.startswith("<?xml")
    root = ElementTree.fromstring(picture.encode())
    assert root.tag == "{http://www.w3.org/2000/svg}svg"
    assert root[0][0].text == "\ufffd<a>&\ufffd\ufffd\ufffd\U0001f916"
    assert root[0][0].attrib == {"font-size": "12"}
