"""One transition of a picture: its sign, and its label."""

from __future__ import annotations

from typing import Any

import pytest

from codegen.hfsm.document import Text, Transition
from visualhfsm._drawing.arcs import Box, arc
from visualhfsm._drawing.symbols import TRIGGERS, UNKNOWN_TRIGGER
from visualhfsm._drawing.transitions import HANDLE, DrawnTransition


def drawn(type: str = "condition", *, rank: int = 0, **others: Any) -> DrawnTransition:
    transition = Transition(id=1, origin=1, destination=2, type=type, **others)
    return DrawnTransition(transition, arc(0j, 300 + 0j, 150 + 40j, is_loop=False), rank, 1j)


def texts(each: DrawnTransition) -> list[str | None]:
    return [text.text for text in each.text()]


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
    assert (plain.box() is not None) == bool(label)
    named = drawn(type, trigger=Text(trigger), guard=Text(guard), name="go", rank=3)
    assert texts(named) == ["3", "go", *label]
    box = named.box()
    assert box is not None
    assert box.bottom - box.top == pytest.approx(13.5 * (1 + len(label)) + 2)


def test_a_long_line_is_shortened_and_the_label_stays_beside_its_handle() -> None:
    long = drawn(name="n" * 200, trigger=Text("t" * 200))
    assert [str(text)[-1] for text in texts(long)] == ["…", "…"]
    box = long.box()
    assert box is not None
    assert box.right - box.left <= 190 + 6
    assert box.top >= long.arc.handle.imag + HANDLE
    condition = "self.Head.getPose().pan < limit"
    assert texts(drawn(trigger=Text(condition))) == [condition]


def test_a_label_stands_on_another_side_where_its_own_is_taken() -> None:
    each = drawn(name="go")
    best = each.box()
    assert best is not None
    assert each.beside([]) == each
    other = each.beside([best]).box()
    assert other is not None
    assert other.bottom <= each.arc.handle.imag - HANDLE
    everywhere = Box(-1e6, -1e6, 1e6, 1e6)
    assert each.beside([everywhere]) == each
