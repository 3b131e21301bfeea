"""Shapes and places that any process in the realm may report: what the page is given of them."""

from __future__ import annotations

import math

import pytest

from hfsm_runtime.recording_file.messages import Shape, values_of
from interfaces.nao import Pose, Quaternion, ShapeKind, Vector3, WorldShape
from visualhfsm._monitor.realm.world import MOST_SHAPES, sound_placement, sound_shapes

UPRIGHT = Quaternion(1.0, 0.0, 0.0, 0.0)


def pose(x: float = 0.0, y: float = 0.0, z: float = 0.0, turn: Quaternion = UPRIGHT) -> Pose:
    return Pose(position=Vector3(x, y, z), orientation=turn)


def shape(
    size: tuple[float, float, float] = (0.1, 0.2, 0.3),
    at: Pose | None = None,
    color: tuple[float, float, float] = (1.0, 0.5, 0.0),
    opacity: float = 1.0,
    name: str = "Crate",
) -> WorldShape:
    return WorldShape(
        object=name,
        kind=ShapeKind.Box,
        size=Vector3(*size),
        pose=at or pose(1.0, 2.0, 3.0),
        color=Vector3(*color),
        opacity=opacity,
    )


def test_a_shape_is_passed_on_in_the_words_of_the_page() -> None:
    (found,) = sound_shapes([Shape.of(shape(at=pose(1.0, 2.0, 3.0, Quaternion(0.0, 0.0, 0.0, 1.0))))])
    assert (found.object, found.kind, found.size) == ("Crate", "box", [0.1, 0.2, 0.3])
    assert found.at == [1.0, 2.0, 3.0, 0.0, 0.0, 1.0, 0.0]
    assert (found.color, found.opacity) == ([1.0, 0.5, 0.0], 1.0)


@pytest.mark.parametrize(
    "wrong",
    [
        shape(size=(math.nan, 0.1, 0.1)),
        shape(size=(0.0, 0.1, 0.1)),
        shape(size=(0.1, -0.1, 0.1)),
        shape(size=(1e6, 0.1, 0.1)),
        shape(at=pose(math.inf)),
        shape(at=pose(turn=Quaternion(0.0, 0.0, 0.0, 0.0))),
        shape(color=(2.0, 0.0, 0.0)),
        shape(opacity=math.nan),
        shape(name="B" * 65),
    ],
)
def test_a_shape_that_cannot_be_drawn_is_left_out(wrong: WorldShape) -> None:
    assert len(sound_shapes(map(Shape.of, [wrong, shape()]))) == 1


def test_no_more_shapes_are_passed_on_than_a_page_draws() -> None:
    assert len(sound_shapes(Shape.of(shape()) for _ in range(MOST_SHAPES + 5))) == MOST_SHAPES


def test_a_place_is_rounded_and_has_the_quaternion_as_the_page_takes_it() -> None:
    at = sound_placement(values_of(pose(1.00004, -0.00001, 0.3, Quaternion(0.6, 0.8, 0.0, 0.0))))
    assert at == (1.0, 0.0, 0.3, 0.8, 0.0, 0.0, 0.6)


@pytest.mark.parametrize("x", [math.nan, math.inf, 1e9])
def test_a_place_that_is_none_is_unknown(x: float) -> None:
    assert sound_placement(values_of(pose(x))) is None
