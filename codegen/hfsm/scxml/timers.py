"""Find the transitions by time: in SCXML events that a state sends to itself on entry, delayed."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from ..formats.xml_tree import XmlElement
from .chart import Chart, ChartState
from .problems import Problems
from .qualified import QualifiedTree
from .vocabulary import milliseconds_text

__all__ = ["Timers"]

_QUOTED: Final = re.compile(r"""\s*(['"])([^'"\\]*)\1\s*""")


class Timers:
    """The delays of states in milliseconds by the event that they bring.

    `consumed` are the elements that send and cancel those events. An event is a timer where nothing but the
    states that send it to themselves, delayed, has to do with it.
    """

    def __init__(self, chart: Chart, problems: Problems) -> None:
        self.consumed: set[XmlElement] = set()
        self._delays: dict[tuple[ChartState, str], str] = {}
        tree = chart.tree
        sends: dict[str, list[tuple[ChartState, XmlElement, str]]] = {}
        waiting: dict[str, set[ChartState]] = {}
        otherwise: set[str] = set()
        for state in _states(chart):
            for send in _delayed(tree, state):
                delay = milliseconds_text(_delay(send))
                if delay is not None:
                    sends.setdefault(send.attributes.get("event", ""), []).append((state, send, delay[0]))
            for transition in tree.inside(state.element, "transition"):
                for event in transition.attributes.get("event", "").split():
                    waiting.setdefault(event, set()).add(state)
        for element in tree.everywhere(chart.root.element, "raise", "send"):
            event = element.attributes.get("event", "")
            if not any(element is send for _, send, _ in sends.get(event, ())):
                otherwise.add(event)
        for event, found in sends.items():
            senders = {state for state, _, _ in found}
            if event and event not in otherwise and waiting.get(event) and waiting[event] <= senders:
                for state, send, delay_text in found:
                    if state in waiting[event] and (state, event) not in self._delays:
                        self._delays[state, event] = delay_text
                        self._consume(tree, state, send, problems)

    def delay(self, state: ChartState, event: str) -> str | None:
        """Return the milliseconds after which a state gets an event of its own, or None."""
        return self._delays.get((state, event))

    def _consume(self, tree: QualifiedTree, state: ChartState, send: XmlElement, problems: Problems) -> None:
        self.consumed.add(send)
        delay = milliseconds_text(_delay(send))
        if delay is not None and not delay[1]:
            problems.approximate(send, "a delay without a unit is taken for milliseconds")
        name = send.attributes.get("id", "")
        cancels = [
            cancel
            for holder in tree.inside(state.element, "onexit")
            for cancel in tree.inside(holder, "cancel")
            if name and cancel.attributes.get("sendid", "") == name
        ]
        self.consumed.update(cancels)
        if not cancels:
            message = "the timer ends here when the state is left; in SCXML, without `cancel`, it goes on"
            problems.reshaped(send, message)


def _states(chart: Chart) -> Iterator[ChartState]:
    return (state for automaton in chart.automata for state in automaton.states)


def _delayed(tree: QualifiedTree, state: ChartState) -> Iterator[XmlElement]:
    for holder in tree.inside(state.element, "onentry"):
        for send in tree.inside(holder, "send"):
            if _delay(send) and send.attributes.get("target", "") in ("", "#_internal"):
                yield send


def _delay(send: XmlElement) -> str:
    """Return the delay of an event, also of one that is computed from a text alone."""
    quoted = _QUOTED.fullmatch(send.attributes.get("delayexpr", ""))
    return send.attributes.get("delay", quoted[2] if quoted else "")
