"""The arcs of transitions: from rim to rim, through their handles."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import pytest

from codegen.hfsm.document import Transition
from visualhfsm._drawing.arcs import RADIUS, Arc, Box, arc, handles

HERE, THERE = 100 + 100j, 400 + 100j


def drawn(handle: complex, origin: complex | None = HERE, destination: complex | None = THERE) -> Arc:
    return arc(origin, destination, handle, is_loop=origin == destination)


def unplaced(*ends: tuple[int, int]) -> list[Transition]:
    return [
        Transition(id=number, origin=origin, destination=destination)
        for number, (origin, destination) in enumerate(ends, start=1)
    ]


def point(text: str) -> complex:
    return complex(*map(float, text.split(",")))


def tip(arc: Arc) -> complex:
    return point(arc.head[1:].split("L")[0])


def test_an_arc_whose_handle_lies_between_its_states_is_straight() -> None:
    straight = drawn(250 + 100j)
    assert re.fullmatch(r"M140,100Q[\d.]+,100 351,100", straight.path)
    assert straight.head == "M358,100L348,104.5L348,95.5Z"
    assert straight.normal == -1j  # a name stands above


@pytest.mark.parametrize("handle", [250 + 40j, 250 + 160j, 120 + 300j, 600 + 99j])
def test_a_bent_arc_passes_through_its_handle(handle: complex) -> None:
    bent = drawn(handle)
    start, rest = bent.path.removeprefix("M").split("Q")
    control, end = rest.split(" ")
    first, middle, last = map(point, (start, control, end))
    assert abs((first + 2 * middle + last) / 4 - handle) < 0.2
    assert abs(first - HERE) == pytest.approx(RADIUS, abs=0.1)
    assert abs(tip(bent) - THERE) == pytest.approx(RADIUS + 2, abs=0.1)
    assert (bent.normal.imag < 0) == (handle.imag < 100)  # a name stands outside


@pytest.mark.parametrize("angle", [-math.pi / 2, 0.3, 2.0])
def test_a_loop_leaves_and_enters_its_state_around_its_handle(angle: float) -> None:
    axis = complex(math.cos(angle), math.sin(angle))
    loop = drawn(HERE + 90 * axis, HERE, HERE)
    assert abs(point(loop.path[1:].split("C")[0]) - HERE) == pytest.approx(RADIUS, abs=0.1)
    assert abs(tip(loop) - HERE) == pytest.approx(RADIUS + 2, abs=0.1)
    assert loop.normal == pytest.approx(axis)
    assert "C" in loop.path
    assert drawn(HERE, HERE, HERE).normal == -1j  # its handle stands in its state


def test_a_transition_without_an_end_reaches_to_its_handle() -> None:
    assert drawn(200 + 100j, HERE, None).path == "M140,100L200,100"
    assert drawn(300 + 100j, None, THERE).path == "M300,100L358,100"
    assert drawn(300 + 100j, None, THERE).head != ""
    nowhere = drawn(5 + 6j, None, None)
    assert (nowhere.path, nowhere.box) == ("", Box(5, 6, 5, 6))


def test_transitions_without_a_place_stand_apart() -> None:
    places = {1: HERE, 2: THERE}
    found = handles(unplaced((1, 2), (2, 1), (1, 2), (1, 1), (1, 1), (7, 7)), places)
    assert found[:3] == [250 + 100j, 250 + 150j, 250 + 50j]
    assert found[3] == pytest.approx(100 + 10j)
    assert abs(found[4] - HERE) == pytest.approx(90)
    assert len({(round(each.real), round(each.imag)) for each in found}) == len(found)
    placed = Transition(id=1, origin=1, destination=2, x=7, y=8)
    assert handles([placed], places) == [7 + 8j]


def test_no_handle_covers_another_one() -> None:
    places = {1: HERE, 2: THERE}
    ends = ((1, 2), (2, 1), (1, 1), (1, 1))
    same = [Transition(id=1, origin=one, destination=other, x=70, y=80) for one, other in ends]
    found = handles(same, places)
    assert found[0] == 70 + 80j
    assert len({(round(each.real), round(each.imag)) for each in found}) == len(found)
    in_the_middle = replace(same[-1], x=100, y=100)
    assert len(handles([in_the_middle] * 9, places)) == 9  # where no turn leads elsewhere
