"""One transition of a picture: its sign, and its label."""

from __future__ import annotations

from typing import Any

import pytest

from codegen.hfsm.document import Text, Transition
from visualhfsm._drawing.arcs import arc
from visualhfsm._drawing.labels import Placed
from visualhfsm._drawing.symbols import TRIGGERS, UNKNOWN_TRIGGER
from visualhfsm._drawing.transitions import DrawnTransition


def drawn(type: str = "condition", *, rank: int = 0, **others: Any) -> DrawnTransition:
    transition = Transition(id=1, origin=1, destination=2, type=type, **others)
    return DrawnTransition(transition, arc(0j, 300 + 0j, 150 + 40j, is_loop=False), rank)


def texts(each: DrawnTransition) -> list[str | None]:
    placed = Placed(150 + 80j, 0) if each.label().sizes else None
    return [text.text for text in each.text(placed)]


@pytest.mark.parametrize("type", [*TRIGGERS, "unheard of"])
def test_a_sign_says_what_fires_it(type: str) -> None:
    paths = [each.get("d") for each in drawn(type).line().iter("path")]
    assert paths[-1] == TRIGGERS.get(type, UNKNOWN_TRIGGER).path


def test_a_dot_says_that_it_has_code() -> None:
    assert len(list(drawn().line().iter("circle"))) == 1
    assert len(list(drawn(code=Text("a()")).line().iter("circle"))) == 2


@pytest.mark.parametrize(
    ("type", "trigger", "guard", "label"),
    [
        ("time", "2000", "", ["2 s"]),
        ("time", " ", "", ["no time"]),
        ("event", "goal", "self.fit", ["goal [self.fit]"]),
        ("event", "", "", ["no event"]),
        ("condition", "\na > 1\nand b", "", ["a > 1"]),
        ("condition", "", "", []),
        ("finished", "ignored", "", []),
        ("finished", "", "x > 1\n# why", ["[x > 1]"]),
    ],
)
def test_the_label_has_the_first_lines_of_trigger_and_guard(
    type: str, trigger: str, guard: str, label: list[str]
) -> None:
    plain = drawn(type, trigger=Text(trigger), guard=Text(guard))
    assert texts(plain) == label
    assert len(plain.label().sizes) == len(label)
    named = drawn(type, trigger=Text(trigger), guard=Text(guard), name="go", rank=3)
    assert texts(named) == ["3", "go", *label]
    assert named.label().sizes[0].height == pytest.approx(13.5 * (1 + len(label)) + 2)


def test_a_long_line_has_shorter_forms_for_where_there_is_less_room() -> None:
    long = drawn(name="n" * 200, trigger=Text("t" * 200))
    widths = [size.width for size in long.label().sizes]
    assert [round(each, -1) for each in widths] == [400, 260, 150]
    assert all(each <= widest + 6 for each, widest in zip(widths, (400, 260, 150), strict=True))
    shortest = long.text(Placed(0j, 2))
    assert [str(text.text)[-1] for text in shortest] == ["…", "…"]
    condition = "self.Head.getPose().pan < self.limit"
    assert texts(drawn(trigger=Text(condition))) == [condition]
