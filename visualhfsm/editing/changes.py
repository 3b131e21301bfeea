"""What became of a document: what changed in it, and what was settled about its file."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

from codegen.hfsm.document import Automaton, Document

from .merge import Conflict

__all__ = ["Added", "Change", "Choice", "Resolution"]


class Choice(StrEnum):
    """What is to become of a document whose file another program has changed."""

    MINE = "mine"
    THEIRS = "theirs"
    MERGE = "merge"


@dataclass(frozen=True, slots=True)
class Added:
    """What is new in one automaton: ids of states and transitions. An automaton may be new itself."""

    automaton: int
    states: tuple[int, ...]
    transitions: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Change:
    """What became of a document: `before` and `after` share everything that did not change."""

    name: str
    revision: int
    before: Document
    after: Document

    @property
    def added(self) -> tuple[Added, ...]:
        """What is new, such as to select it; empty when nothing is."""
        return tuple(_added(self.before, self.after))


@dataclass(frozen=True, slots=True)
class Resolution:
    """What became of a document whose file was changed, and where both had changed the same."""

    change: Change | None
    conflicts: tuple[Conflict, ...] = ()


def _added(before: Document, after: Document) -> Iterator[Added]:
    former = {automaton.id: automaton for automaton in before.automata}
    for automaton in after.automata:
        old = former.get(automaton.id)
        if old is automaton:
            continue
        known = old or Automaton(id=automaton.id)
        states = {state.id for state in known.states}
        transitions = {transition.id for transition in known.transitions}
        added = Added(
            automaton.id,
            tuple(state.id for state in automaton.states if state.id not in states),
            tuple(each.id for each in automaton.transitions if each.id not in transitions),
        )
        if old is None or added.states or added.transitions:
            yield added
