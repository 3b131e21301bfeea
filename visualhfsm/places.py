"""Name the pieces of code of a document, and find the one in which a line of its file stands."""

from __future__ import annotations

import operator
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from codegen.hfsm.document import Automaton, Document, State, Text, Transition

__all__ = ["CodePlace", "Kind", "Part", "PlacedLine", "find_line", "pieces", "replace_text"]

Kind = Literal["state", "transition", "automaton", "document"]
Part = Literal["code", "entry", "exit", "trigger", "guard", "fired", "variables", "functions", "argument"]


@dataclass(frozen=True, slots=True)
class CodePlace:
    """A piece of code: a part of a state, transition or automaton, by their ids.

    `fired` is the code of a transition. `name` is that of an argument.
    """

    kind: Kind
    part: Part
    automaton: int = 0
    id: int = 0
    name: str = ""


@dataclass(frozen=True, slots=True)
class PlacedLine:
    """A line of a piece of code, counted from 1."""

    place: CodePlace
    line: int


def pieces(document: Document) -> Iterator[tuple[CodePlace, Text, Path | None]]:
    """Yield every piece of code, and the file that it was imported from; blank ones, too."""
    for automaton in document.automata:
        path = automaton.path
        yield CodePlace("automaton", "variables", automaton.id), automaton.variables, path
        yield CodePlace("automaton", "functions", automaton.id), automaton.functions, path
        for state in automaton.states:
            for place, text in _of_state(automaton, state):
                yield place, text, path
        for transition in automaton.transitions:
            for place, text in _of_transition(automaton, transition):
                yield place, text, path


def find_line(document: Document, line: int, file: str = "") -> PlacedLine | None:
    """Return the piece of code in which a line of the document's file stands, or None.

    `file` is the name of the file that is meant, where that is not the document's own; the document was read
    from its file as it is meant.
    """
    for place, text, path in pieces(document):
        name = path.name if path else ""
        if text.is_blank or not text.line or name != file:
            continue
        number = line - text.line + 1
        if 1 <= number <= text.text.count("\n") + 1:
            return PlacedLine(place, number)
    return None


def replace_text(document: Document, place: CodePlace, text: Text) -> Document | None:
    """Return a document with another text for a piece of code; None when there is no such piece."""
    automaton = document.automaton(place.automaton)
    changed = None if automaton is None else _replace_in_automaton(automaton, place, text)
    if changed is None:
        return None
    automata = (changed if each is automaton else each for each in document.automata)
    return replace(document, automata=tuple(automata))


def _of_state(automaton: Automaton, state: State) -> Iterator[tuple[CodePlace, Text]]:
    parts: tuple[tuple[Part, Text], ...] = (
        ("entry", state.entry),
        ("code", state.code),
        ("exit", state.exit),
    )
    for part, text in parts:
        yield CodePlace("state", part, automaton.id, state.id), text
    for argument in state.arguments:
        yield CodePlace("state", "argument", automaton.id, state.id, argument.name), argument.value


def _of_transition(automaton: Automaton, transition: Transition) -> Iterator[tuple[CodePlace, Text]]:
    parts: tuple[tuple[Part, Text], ...] = (
        ("trigger", transition.trigger),
        ("guard", transition.guard),
        ("fired", transition.code),
    )
    for part, text in parts:
        yield CodePlace("transition", part, automaton.id, transition.id), text


def _replace_in_automaton(automaton: Automaton, place: CodePlace, text: Text) -> Automaton | None:
    match place.kind, place.part:
        case "automaton", "variables":
            return replace(automaton, variables=text)
        case "automaton", "functions":
            return replace(automaton, functions=text)
        case "state", _:
            states = [_replace_in_state(each, place, text) for each in automaton.states]
            same = all(map(operator.is_, states, automaton.states))
            return None if same else replace(automaton, states=tuple(states))
        case "transition", _:
            transitions = [_replace_in_transition(each, place, text) for each in automaton.transitions]
            same = all(map(operator.is_, transitions, automaton.transitions))
            return None if same else replace(automaton, transitions=tuple(transitions))
    return None


def _replace_in_state(state: State, place: CodePlace, text: Text) -> State:
    """Return a state as it is, or with another text if it is the one that is meant."""
    if state.id != place.id:
        return state
    match place.part:
        case "entry":
            return replace(state, entry=text)
        case "code":
            return replace(state, code=text)
        case "exit":
            return replace(state, exit=text)
        case "argument" if any(argument.name == place.name for argument in state.arguments):
            arguments = (
                replace(each, value=text) if each.name == place.name else each for each in state.arguments
            )
            return replace(state, arguments=tuple(arguments))
    return state


def _replace_in_transition(transition: Transition, place: CodePlace, text: Text) -> Transition:
    """Return a transition as it is, or with another text if it is the one that is meant."""
    if transition.id != place.id:
        return transition
    match place.part:
        case "trigger":
            return replace(transition, trigger=text)
        case "guard":
            return replace(transition, guard=text)
        case "fired":
            return replace(transition, code=text)
    return transition
