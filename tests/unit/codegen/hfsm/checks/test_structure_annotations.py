"""Faults of notes and frames, which are never errors."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.checked_documents import A
from tests.support.documents import document, problems, sub

NOTE = (
    '<annotation id="{id}" kind="{kind}"><posx>0</posx><posy>0</posy><width>{width}</width>'
    "<height>60</height>{color}<text>a < b</text></annotation>"
).replace("<text>a < b", "<text>a &lt; b")


def note(id: int = 1, kind: str = "note", width: str = "120", color: str = "") -> str:
    return NOTE.format(id=id, kind=kind, width=width, color=color)


@pytest.mark.parametrize(
    ("annotation", "expected"),
    [
        (note(kind="notes"), "W539: the kind of annotation 1 must be `note` or `frame`, not `notes`: it is drawn as `note`"),
        (note(color="<color>purple</color>"), "W539: the color of annotation 1 must be `yellow`, `blue`, `green`, `pink` or `gray`, not `purple`"),
        (note(width="2"), "W539: the width of annotation 1 must be from 24 to 1000000 pixels, not 2"),
        (note(width="1e300"), "W539: the width of annotation 1 must be from 24 to 1000000 pixels, not 1e+300"),
        (note() + note(), "W508: the id 1 of an annotation is not unique: it gets 2"),
    ],
)  # fmt: skip
def test_faults_of_an_annotation_are_warnings(path: Path, annotation: str, expected: str) -> None:
    found = problems(path, document(sub(1, 0, A, annotation)))
    assert len(found) == 1
    assert expected in found[0]


@pytest.mark.parametrize("color", ["", "<color/>", "<color>pink</color>"])
def test_a_note_and_a_frame_are_no_problem(path: Path, color: str) -> None:
    assert problems(path, document(sub(1, 0, A, note(color=color), note(2, "frame")))) == []
