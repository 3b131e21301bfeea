"""SCXML as it is drawn."""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm.document import Automaton, Document
from codegen.hfsm.formats.others import writable_formats
from codegen.messages import Message
from visualhfsm._document.conversion import read
from visualhfsm._document.serialization import import_document

SOURCE = """<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" initial="a">
  <state id="a"><transition event="go" target="b"/><transition event="again" target="a"/></state>
  <state id="b"><transition event="back" target="a"/><transition event="home" target="a"/></state>
</scxml>
"""


def imported(text: str) -> tuple[Document, list[Message]]:
    return import_document(writable_formats()[".scxml"], text.encode(), "a.scxml")


def converted(directory: Path) -> Document:
    path = directory / "a.scxml"
    path.write_text(SOURCE, "utf-8")
    document = read(path, Diagnostics())
    assert document is not None
    return document


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 8, 13])
def test_no_straight_transition_of_a_few_states_crosses_another(count: int) -> None:
    states = "".join(f'<state id="s{number}"/>' for number in range(count))
    text = f'<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0">{states}</scxml>'
    (automaton,) = imported(text)[0].automata
    places = [(state.x, state.y) for state in automaton.states]
    middles = []
    for (x1, y1), (x2, y2) in itertools.combinations(places, 2):
        middles.append(((x1 + x2) / 2, (y1 + y2) / 2))
        length = math.dist((x1, y1), (x2, y2))
        assert length > 200
        for x, y in set(places) - {(x1, y1), (x2, y2)}:
            assert abs((x2 - x1) * (y - y1) - (y2 - y1) * (x - x1)) / length > 40, "the radius of a state"
    assert all(math.dist(one, other) > 10 for one, other in itertools.combinations(middles, 2))


def states(count: int, transitions: list[tuple[int, int]], inner: str = "") -> str:
    """SCXML of states with transitions between them; the first one contains others."""
    return "".join(
        f'<state id="{inner}s{number}">{"{inner}" if number == 0 and not inner else ""}'
        + "".join(
            f'<transition event="e{index}" target="{inner}s{goal}"/>'
            for index, (origin, goal) in enumerate(transitions)
            if origin == number
        )
        + "</state>"
        for number in range(count)
    )


def edges(kind: str, count: int) -> list[tuple[int, int]]:
    chosen = random.Random(count)
    match kind:
        case "chain":
            return [(each, (each + 1) % count) for each in range(count)] + [
                (each, 0) for each in range(2, count, 3)
            ]
        case "star":
            return [ends for each in range(1, count) for ends in ((0, each), (each, 0))]
    return [(chosen.randrange(count), chosen.randrange(count)) for _ in range(count * 3 // 2)]


def arcs_through_states(automaton: Automaton) -> Iterator[int]:
    """Yield the transitions whose arcs, as the page draws them, pass through other states."""
    places = {state.id: np.array((state.x, state.y)) for state in automaton.states}
    parts = np.linspace(0.0, 1.0, 301)[:, None]
    for each in automaton.transitions:
        begin, end = places[each.origin], places[each.destination]
        others = np.array([places[key] for key in places if key not in (each.origin, each.destination)])
        if each.origin == each.destination or not len(others):
            continue
        control = 2 * np.array((each.x, each.y)) - (begin + end) / 2
        arc = (1 - parts) ** 2 * begin + 2 * parts * (1 - parts) * control + parts**2 * end
        x, y = (arc[:, None] - others).T
        if (x**2 + y**2 < 41**2).any():
            yield each.id


@pytest.mark.parametrize("kind", ["chain", "star", "random"])
@pytest.mark.parametrize("count", [14, 25, 60])
def test_many_states_keep_apart_and_no_arc_passes_through_another_one(kind: str, count: int) -> None:
    inner = states(count, edges(kind, count), "i")
    outer = states(count, edges(kind, count)).replace("{inner}", inner)
    text = f'<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0">{outer}</scxml>'
    document = imported(text)[0]
    assert [len(each.states) for each in document.automata] == [count, count]
    for automaton in document.automata:
        places = [(state.x, state.y) for state in automaton.states]
        assert all(math.dist(one, other) > 200 for one, other in itertools.combinations(places, 2))
        handles = [(each.x, each.y) for each in automaton.transitions]
        assert all(math.dist(one, other) >= 29 for one, other in itertools.combinations(handles, 2))
        assert list(arcs_through_states(automaton)) == []


@pytest.mark.parametrize("way", ["opened", "converted"])
def test_no_two_transitions_lie_on_one_line(way: str, tmp_path: Path) -> None:
    document = converted(tmp_path) if way == "converted" else imported(SOURCE)[0]
    (automaton,) = document.automata
    a, b = automaton.states
    handles = [(each.x, each.y) for each in automaton.transitions]
    assert len(handles) == 4
    assert all(math.dist(one, other) >= 30 for one in handles for other in handles if one is not other)
    (loop,) = (each for each in automaton.transitions if each.origin == each.destination)
    assert math.dist((loop.x, loop.y), (a.x, a.y)) > 40, "outside of the circle"
    assert (handles[0], a.y) == (((a.x + b.x) / 2, a.y), b.y), "the first one is straight"


def test_what_scxml_loses_comes_before_what_is_not_the_same() -> None:
    text = (
        '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="python">\n'
        '<state id="a"><transition event="e.*" target="a"/>\n<invoke src="b.scxml"/></state></scxml>'
    )
    first, second = (str(each) for each in imported(text)[1])
    assert first.startswith("line 3: `invoke`")
    assert second.startswith("line 2: `e.*`")
