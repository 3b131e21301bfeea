"""SCXML as it is drawn."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm.document import Document
from visualhfsm.conversion import read
from visualhfsm.editing.serialization import import_scxml

SOURCE = """<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" initial="a">
  <state id="a"><transition event="go" target="b"/><transition event="again" target="a"/></state>
  <state id="b"><transition event="back" target="a"/><transition event="home" target="a"/></state>
</scxml>
"""


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
    (automaton,) = import_scxml(text.encode(), "a.scxml")[0].automata
    places = [(state.x, state.y) for state in automaton.states]
    middles = []
    for (x1, y1), (x2, y2) in itertools.combinations(places, 2):
        middles.append(((x1 + x2) / 2, (y1 + y2) / 2))
        length = math.dist((x1, y1), (x2, y2))
        assert length > 200
        for x, y in set(places) - {(x1, y1), (x2, y2)}:
            assert abs((x2 - x1) * (y - y1) - (y2 - y1) * (x - x1)) / length > 40, "the radius of a state"
    assert all(math.dist(one, other) > 10 for one, other in itertools.combinations(middles, 2))


@pytest.mark.parametrize("way", ["opened", "converted"])
def test_no_two_transitions_lie_on_one_line(way: str, tmp_path: Path) -> None:
    document = converted(tmp_path) if way == "converted" else import_scxml(SOURCE.encode(), "a.scxml")[0]
    (automaton,) = document.automata
    a, b = automaton.states
    handles = [(each.x, each.y) for each in automaton.transitions]
    assert len(handles) == 4
    assert all(math.dist(one, other) >= 30 for one in handles for other in handles if one is not other)
    (loop,) = (each for each in automaton.transitions if each.origin == each.destination)
    assert math.dist((loop.x, loop.y), (a.x, a.y)) > 40, "outside of the circle"
    assert (handles[0], a.y) == (((a.x + b.x) / 2, a.y), b.y), "the first one is straight"
