"""Marks of a component on the pictures of its cameras: their kinds, duration and limits."""

from __future__ import annotations

import numpy as np
import pytest

from hfsm_runtime import Component, ComponentError
from hfsm_runtime._marks import Marks, make_mark

SECOND = 1_000_000_000


def test_a_mark_may_be_at_numbers_of_any_kind() -> None:
    mark = make_mark("Camera", np.float32(1.5), 2, "ball")  # type: ignore[arg-type]
    assert mark == ("Camera", 1.5, 2.0, "ball")
    assert type(mark.u) is type(mark.v) is float


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (
            ("Camera", float("nan"), 0, "ball"),
            "the mark 'ball' is at nan and 0: a pixel is at finite numbers",
        ),
        (("Camera", 0, float("inf")), "finite numbers"),
        (("Camera", None, None), "two numbers of pixels, not None and None"),
        (("Camera", 0, 0, "x" * 61), "the label of a mark is a text of at most 60 visible characters"),
        (("Camera", 0, 0, "a\x1b[2J"), "visible characters"),
        ((None, 0, 0), "the camera of a mark is a text"),
        (("", 0, 0), "name it, such as 'Camera'"),
    ],
)
def test_what_cannot_be_marked_is_an_error_that_says_why(arguments: tuple, reason: str) -> None:  # type: ignore[type-arg]
    with pytest.raises(ComponentError, match=reason.replace("[", r"\[")):
        Component().mark(*arguments)


def test_a_mark_is_shown_for_half_a_second() -> None:
    marks = Marks()
    marks.add(make_mark("Camera", 1, 2, "ball"), SECOND)
    assert [mark.label for mark in marks.shown(SECOND + SECOND // 2)] == ["ball"]
    assert marks.shown(SECOND + SECOND // 2 + 1) == []


def test_a_mark_takes_the_place_of_one_with_the_same_label() -> None:
    marks = Marks()
    for u in (1, 2):
        marks.add(make_mark("Camera", u, 0, "ball"), u)
    marks.add(make_mark("CameraBottom", 3, 0, "ball"), 3)
    assert [(mark.camera, mark.u) for mark in marks.shown(3)] == [("Camera", 2), ("CameraBottom", 3)]


def test_of_too_many_marks_and_cameras_the_newest_are_kept() -> None:
    marks = Marks()
    for number in range(100):
        marks.add(make_mark("Camera", 0, 0, f"label {number}"), number)
    assert [mark.label for mark in marks.shown(100)] == [f"label {number}" for number in range(84, 100)]
    for number in range(100):
        marks.add(make_mark(f"Camera {number}", 0, 0), 100 + number)
    assert {mark.camera for mark in marks.shown(200)} == {f"Camera {number}" for number in range(92, 100)}
