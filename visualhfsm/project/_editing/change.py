"""What a command did to a document, and the ways to resolve a change of its file by another program."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from enum import StrEnum

import msgspec

from codegen.hfsm.document import Automaton, Document
from codegen.messages import Message
from visualhfsm._document.commands import Command
from visualhfsm._document.diff import Difference, diff_documents
from visualhfsm._document.places import TEXTS, Place

from .merge import merge_typing


@dataclass(frozen=True, slots=True)
class Added:
    """What is new in one automaton, by id; the automaton itself may be new."""

    automaton: int
    states: tuple[int, ...]
    transitions: tuple[int, ...]
    annotations: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Change:
    """A change of a document: `before` and `after` share everything that did not change."""

    name: Message
    revision: int
    before: Document
    after: Document
    conflict: bool = False
    """True if somebody else had replaced the same words; the text then contains both versions."""
    by: Hashable = None
    """Who had made the step that was undone or redone, None if that is not known."""
    is_own: bool = False
    """True if only what one had typed oneself was undone or redone."""

    @property
    def added(self) -> tuple[Added, ...]:
        """The new elements, for example to select them; empty when there are none."""
        former = {automaton.id: automaton for automaton in self.before.automata}
        found = []
        for automaton in self.after.automata:
            old = former.get(automaton.id)
            if old is automaton:
                continue
            known = old or Automaton(id=automaton.id)
            states = {state.id for state in known.states}
            transitions = {transition.id for transition in known.transitions}
            annotations = {annotation.id for annotation in known.annotations}
            added = Added(
                automaton.id,
                tuple(state.id for state in automaton.states if state.id not in states),
                tuple(each.id for each in automaton.transitions if each.id not in transitions),
                tuple(each.id for each in automaton.annotations if each.id not in annotations),
            )
            if old is None or added.states or added.transitions or added.annotations:
                found.append(added)
        return tuple(found)

    @property
    def place(self) -> Place | None:
        """The first place that differs and is still there, to show it; None when there is none."""
        for difference in diff_documents(self.before, self.after):
            place, part = difference.place, difference.part
            if difference.kind == "removed":
                place = Place(kind="automaton" if place.automaton else "document", automaton=place.automaton)
            elif place.part:
                place = msgspec.structs.replace(place, name=place.name or part)
            elif part in TEXTS:
                place = msgspec.structs.replace(place, part=part)
            if not place.automaton or self.after.automaton(place.automaton) is not None:
                return place
        return None


def merged_with_others(command: Command, base: str, document: Document) -> tuple[Command, bool]:
    """Return a command with its typed text merged with that of the document, and whether they conflict."""
    match diff_documents(command.with_text(base).apply(document), document):
        case [Difference(kind="changed", after=theirs)]:
            typed = merge_typing(base, command.text_typed, theirs)
            return command.with_text(typed.text), typed.conflict
    return command, False


class Choice(StrEnum):
    """The ways to resolve a change of a document's file by another program."""

    MINE = "mine"
    THEIRS = "theirs"
    MERGE = "merge"


@dataclass(frozen=True, slots=True)
class Resolution:
    """The change of a document whose file was changed, and the conflicts."""

    change: Change | None
    conflicts: tuple[str, ...] = ()
