"""One transition of a picture: its sign, and its label."""

from __future__ import annotations

from typing import Any

import pytest

from codegen.hfsm.document import Text, Transition
from visualhfsm._drawing.arcs import arc
from visualhfsm._drawing.symbols import TRIGGERS, UNKNOWN_TRIGGER
from visualhfsm._drawing.transitions import DrawnTransition


def drawn(type: str = "condition", *, rank: int = 0, **others: Any) -> DrawnTransition:
    transition = Transition(id=1, origin=1, destination=2, type=type, **others)
    return DrawnTransition(transition, arc(0j, 300 + 0j, 150 + 40j, is_loop=False), rank)


def texts(each: DrawnTransition) -> list[str | None]:
    return [text.text for text in each.text(150 + 80j)]


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
    assert (plain.label().width > 0) == bool(label)
    named = drawn(type, trigger=Text(trigger), guard=Text(guard), name="go", rank=3)
    assert texts(named) == ["3", "go", *label]
    assert named.label().height > plain.label().height


def test_long_lines_are_shortened() -> None:
    label = drawn(name="n" * 200, trigger=Text("t" * 200)).label()
    assert label.width < 160
