"""Notes and frames of a picture."""

from __future__ import annotations

from xml.etree.ElementTree import Element

import pytest

from codegen.hfsm.document import ANNOTATION_COLORS, Annotation, Text
from visualhfsm._drawing.annotations import COLORS, box_of, draw_annotations
from visualhfsm._drawing.arcs import Box


def note(text: str = "", *, kind: str = "note", width: float = 200, height: float = 90, color: str = "") -> Annotation:  # fmt: skip
    return Annotation(
        id=1, kind=kind, x=10, y=20, width=width, height=height, color=Text(color), text=Text(text)
    )


def lines(annotation: Annotation) -> list[str]:
    (drawn,) = draw_annotations([annotation])
    return [each.text or "" for each in drawn.iter("tspan")]


def paper(annotation: Annotation) -> Element:
    (drawn,) = draw_annotations([annotation])
    return drawn[0]


def test_a_text_is_broken_at_spaces_and_keeps_its_lines() -> None:
    assert lines(note("one two three four five six seven eight\n  - nine")) == [
        "one two three four five",
        "six seven eight",
        "\N{NO-BREAK SPACE}\N{NO-BREAK SPACE}- nine",
    ]


def test_a_word_that_is_wider_than_its_note_is_broken() -> None:
    assert "".join(lines(note("https://example.org/a/long/way/to/go", width=120))) == (
        "https://example.org/a/long/way/to/go"
    )


def test_a_note_grows_with_its_text_and_keeps_a_larger_height() -> None:
    long = note("one\ntwo\nthree", height=24)
    assert box_of(long) == Box(10, 20, 210, 20 + 3 * 18 + 15)
    assert paper(long).get("height") == "69"
    assert lines(long) == ["one", "two", "three"]
    assert box_of(note("one\ntwo\nthree", height=90)).bottom == 20 + 90
    assert box_of(note("one\ntwo\nthree", kind="frame", height=24)).bottom == 20 + 24


def test_what_is_too_long_even_for_a_large_note_is_cut_with_a_sign() -> None:
    long = note("\n".join(["line"] * 5000))
    assert lines(long) == ["line"] * 199 + ["line …"]
    assert box_of(long).bottom == 20 + 200 * 18 + 15


@pytest.mark.parametrize("color", ANNOTATION_COLORS)
def test_each_color_is_drawn(color: str) -> None:
    assert paper(note(color=color)).get("fill") == COLORS[color].fill


@pytest.mark.parametrize(
    ("annotation", "color"),
    [(note(), "yellow"), (note(kind="frame"), "gray"), (note(color="purple"), "yellow")],
)
def test_the_usual_color_of_each_kind(annotation: Annotation, color: str) -> None:
    assert paper(annotation).get("fill") == COLORS[color].fill


def test_no_size_breaks_a_picture() -> None:
    assert box_of(note(width=0, height=1e300)) == Box(10, 20, 34, 20 + 1e6)


def test_notes_are_above_frames_and_small_frames_above_large_ones() -> None:
    large, small = (note(kind="frame", width=width) for width in (500, 100))
    widths = [each[0].get("width") for each in draw_annotations([note(), small, large])]
    assert widths == ["500", "100", "200"]
