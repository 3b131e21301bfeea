"""The model checker against the runtime on threads that are late: random documents, many at a time."""

from __future__ import annotations

import time
from contextlib import ExitStack
from dataclasses import dataclass

import pytest
from hypothesis import HealthCheck, Phase, given, settings

from codegen.hfsm.document import Document
from codegen.hfsm.model_checker import check_model
from tests.support.examples import examples
from tests.support.live_documents import LateClock, LivePlayer
from tests.support.model_documents import PATH, Script, documents, impossible
from tests.support.soak import repeated

LIMIT = 30_000
SECONDS = repeated(1.5, 2.5)
LATE = 0.03
"""How late a thread may be, in s: less than the shortest period, 50 ms, so that few cycles are missed."""
AT_A_TIME = 10


@dataclass
class Prepared:
    """A document, and what the checker calls impossible in it: states and transitions by ids."""

    document: Document
    states: set[tuple[int, int]]
    transitions: set[tuple[int, int]]


def draw(count: int) -> list[Prepared]:
    """Draw documents with several automata in which something is impossible."""
    found: list[Prepared] = []

    @settings(
        max_examples=count,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
    )
    @given(documents())
    def take(document: Document) -> None:
        states, transitions = impossible(check_model(document, PATH, limit=LIMIT))
        if len(document.automata) > 1 and (states or transitions):
            found.append(Prepared(document, states, transitions))

    take()
    return found


@pytest.mark.slow
def test_nothing_that_late_threads_do_is_called_impossible() -> None:
    drawn = draw(examples(30))
    events = 0
    for first in range(0, len(drawn), AT_A_TIME):
        batch = drawn[first : first + AT_A_TIME]
        players = [
            LivePlayer(each.document, Script(each.document, number), LateClock(number, LATE))
            for number, each in enumerate(batch, first)
        ]
        with ExitStack() as stack:
            for player in players:
                stack.callback(player.runtime.stop)
                player.runtime.start()
            time.sleep(SECONDS)  # on real threads, for this is about real lateness
        for each, player in zip(batch, players, strict=True):
            assert not player.runtime.errors
            assert not player.states & each.states, each.document
            assert not player.transitions & each.transitions, each.document
        events += sum(player.events for player in players)
    assert events
