"""One state of a picture: its marks and its badges."""

from __future__ import annotations

from dataclasses import replace
from xml.etree.ElementTree import Element

from codegen.hfsm.document import State, Text
from visualhfsm._drawing.arcs import RADIUS
from visualhfsm._drawing.states import draw_state
from visualhfsm._drawing.symbols import BADGES, INK, PARENT, PLAIN

PLAIN_STATE = State(id=1, name="walk", x=10, y=20)


def drawn(state: State, *, is_importing: bool = False) -> Element:
    return draw_state(state, is_importing=is_importing)


def circles(element: Element) -> list[tuple[str | None, str | None]]:
    return [(each.get("fill"), each.get("stroke")) for each in element.iter("circle")]


def paths(element: Element) -> list[str]:
    return [each.get("d", "") for each in element.iter("path")]


def test_marks_distinguish_initial_final_and_parent_states() -> None:
    assert drawn(PLAIN_STATE).get("transform") == "translate(10,20)"
    assert circles(drawn(PLAIN_STATE)) == [(PLAIN.fill, PLAIN.line)]
    assert circles(drawn(replace(PLAIN_STATE, initial=True)))[1:] == [("none", PLAIN.line)]
    assert circles(drawn(replace(PLAIN_STATE, final=True))) == [(PLAIN.fill, INK)]
    assert circles(drawn(replace(PLAIN_STATE, children=(2,)))) == [(PARENT.fill, PARENT.line)]


def test_a_dot_says_that_a_state_has_code() -> None:
    assert circles(drawn(replace(PLAIN_STATE, code=Text(" \n")))) == [(PLAIN.fill, PLAIN.line)]
    for busy in (replace(PLAIN_STATE, entry=Text("a()")), replace(PLAIN_STATE, exit=Text("b()"))):
        assert circles(drawn(busy))[1:] == [(PLAIN.line, None)]


def test_badges_say_what_a_state_owns() -> None:
    assert paths(drawn(replace(PLAIN_STATE, children=(2,)))) == [BADGES["child"]]
    (three,) = paths(drawn(replace(PLAIN_STATE, children=(2, 3, 4))))
    (many,) = paths(drawn(replace(PLAIN_STATE, children=tuple(range(2, 99)))))
    assert (three.count("V4.5"), many.count("V4.5")) == (3, 4)
    restarted = replace(PLAIN_STATE, children=(2,), history=Text(" restart "))
    assert paths(drawn(restarted)) == [BADGES["child"], BADGES["restart"]]
    resumed = replace(restarted, history=Text("resume"))
    assert paths(drawn(resumed, is_importing=True)) == [
        *(BADGES["child"], BADGES["resume"], BADGES["imported"]),
    ]


def test_a_long_name_stays_in_its_circle_whatever_the_font() -> None:
    lengths = [
        [float(each.get("textLength", "0")) for each in drawn(replace(PLAIN_STATE, name=name)).iter("tspan")]
        for name in ("walk", "followBall", "approach the ball slowly", "w" * 40)
    ]
    assert lengths[0] == [0.0]
    assert any(lengths[1])
    assert all(length <= 2 * RADIUS - 20 for each in lengths for length in each)
