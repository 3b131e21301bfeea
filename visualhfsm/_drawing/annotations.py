"""Notes and frames of a picture, below states and transitions. A note is as high as its text needs."""

from __future__ import annotations

from collections.abc import Iterable
from types import MappingProxyType
from typing import Final
from xml.etree.ElementTree import Element

from codegen.hfsm.document import ANNOTATION_COLORS, SMALLEST_ANNOTATION, Annotation
from visualhfsm._document.nodes import FARTHEST_PLACE

from .arcs import Box
from .elements import element, moved
from .symbols import Colors
from .text import shortened, wrapped

COLORS: Final = MappingProxyType(
    {
        "yellow": Colors("#fff6d6", "#d3b243", "#4a3b0a"),
        "blue": Colors("#e3effc", "#8db3de", "#123a66"),
        "green": Colors("#e0f4e8", "#83c3a0", "#0b4029"),
        "pink": Colors("#fde8f0", "#dfa0bb", "#5c1a38"),
        "gray": Colors("#eef1f5", "#b0bbc9", "#2b3644"),
    }
)
"""The light colours of the page's `canvas.css`."""

_SIZE: Final = 13.0
_LINE: Final = 18.0
_PADDING: Final = 10.0
_TITLE_AT: Final = 20.0
"""Pixels from the top of a frame to the foot of its title."""
_MOST_LINES: Final = 200
"""A note grows for so many lines."""


def box_of(annotation: Annotation) -> Box:
    """Return the rectangle that an annotation takes, whatever its file says: a note grows with its text."""
    box = _own_box(annotation)
    if annotation.kind == "frame":
        return box
    lines = len(wrapped(annotation.text.text, _SIZE, box.right - box.left - 2 * _PADDING))
    return box._replace(bottom=max(box.bottom, box.top + _height(min(_MOST_LINES, lines))))


def _own_box(annotation: Annotation) -> Box:
    """Return the rectangle with the size that a file says, as far as a picture can have it."""
    left, top = (max(-FARTHEST_PLACE, min(FARTHEST_PLACE, at)) for at in (annotation.x, annotation.y))
    wide, high = (
        max(SMALLEST_ANNOTATION, min(FARTHEST_PLACE, size)) for size in (annotation.width, annotation.height)
    )
    return Box(left, top, left + wide, top + high)


def _height(lines: int) -> float:
    """Return the height that a note needs for some lines."""
    return lines * _LINE - (_LINE - _SIZE) + 2 * _PADDING


def draw_annotations(annotations: Iterable[Annotation]) -> Element:
    """Return the layer of all annotations: the largest frames are at the bottom, notes above all frames."""
    return element("g", *map(_drawn, sorted(annotations, key=_height_in_pile)))


def _height_in_pile(annotation: Annotation) -> tuple[bool, float]:
    box = box_of(annotation)
    return annotation.kind != "frame", -(box.right - box.left) * (box.bottom - box.top)


def _drawn(annotation: Annotation) -> Element:
    is_frame = annotation.kind == "frame"
    box = box_of(annotation)
    wide, high = box.right - box.left, box.bottom - box.top
    usual = "gray" if is_frame else "yellow"
    colors = COLORS.get(annotation.color.text.strip() or usual, COLORS[ANNOTATION_COLORS[0]])
    paper = element(
        "rect",
        width=wide,
        height=high,
        rx=10 if is_frame else 5,
        fill=colors.fill,
        fill_opacity="0.5" if is_frame else "1",
        stroke=colors.line,
        stroke_width=1.5,
    )
    text = annotation.text.text
    words = _title(annotation, wide, colors) if is_frame else _lines(text, wide, high, colors)
    return element("g", paper, *words, transform=moved(complex(box.left, box.top)))


def _title(frame: Annotation, wide: float, colors: Colors) -> list[Element]:
    return [
        element(
            "text",
            text=shortened(" ".join(frame.text.text.split()), _SIZE, wide - 2 * _PADDING),
            x=_PADDING,
            y=_TITLE_AT,
            font_size=_SIZE,
            font_weight="600",
            fill=colors.ink,
        )
    ]


def _lines(text: str, wide: float, high: float, colors: Colors) -> list[Element]:
    lines = wrapped(text, _SIZE, wide - 2 * _PADDING)
    fitting = max(1, int((high - _height(0)) // _LINE))
    if len(lines) > fitting:
        lines = [*lines[: fitting - 1], shortened(f"{lines[fitting - 1]} …", _SIZE, wide - 2 * _PADDING)]
    spans = (
        element("tspan", text=line, x=_PADDING, y=_PADDING + _SIZE + index * _LINE)
        for index, line in enumerate(lines)
        if line
    )
    return [element("text", *spans, font_size=_SIZE, fill=colors.ink)]
