"""Check notes and frames: whatever is wrong with one, the component is generated."""

from __future__ import annotations

from typing import Final

from ...diagnostics import did_you_mean
from ...messages import Message, any_of
from ..codes import Code
from ..document import ANNOTATION_COLORS, ANNOTATION_KINDS, SMALLEST_ANNOTATION, Annotation, Automaton
from .report import Report

_LARGEST_ANNOTATION: Final = 1e6  # pixels: no canvas is larger


def check_annotations(automaton: Automaton, report: Report) -> None:
    """Check the kind, size and color of each note and frame of an automaton."""
    for each in automaton.annotations:
        _check_word("kind", each.kind, ANNOTATION_KINDS, each, report)
        color = each.color.text.strip()
        if color:
            _check_word("color", color, ANNOTATION_COLORS, each, report)
        for name, size in (("width", each.width), ("height", each.height)):
            if not SMALLEST_ANNOTATION <= size <= _LARGEST_ANNOTATION:
                message = Message(
                    "the {attribute} of annotation {id} must be from {smallest:.0f} to {largest:.0f} pixels, "
                    "not {size:g}: it is drawn as large as the nearest of these",
                    attribute=name,
                    id=each.id,
                    smallest=SMALLEST_ANNOTATION,
                    largest=_LARGEST_ANNOTATION,
                    size=size,
                )
                report.warning(Code.BAD_ANNOTATION, message, each)


def _check_word(what: str, word: str, known: tuple[str, ...], annotation: Annotation, report: Report) -> None:
    if word not in known:
        message = Message(
            "the {attribute} of annotation {id} must be {known}, not `{word}`: it is drawn as `{usual}`",
            attribute=what,
            id=annotation.id,
            known=any_of([f"`{each}`" for each in known]),
            word=word[:40],
            usual=known[0],
        )
        report.warning(Code.BAD_ANNOTATION, message, annotation, did_you_mean(word, known))
