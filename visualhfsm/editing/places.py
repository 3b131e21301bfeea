"""Name the places of a document: what a problem, a hit of a search or a difference is about."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal, NamedTuple

import msgspec

from codegen.hfsm.document import Automaton, Document, Node, Parameter, State, Text, Transition

__all__ = ["Place", "Spot", "spots"]


class Place(msgspec.Struct, frozen=True, kw_only=True, rename="camel", omit_defaults=True):
    """A place in a document.

    `id` is that of a state or a transition of the `automaton`. `part` is one of its fields: of a document
    `description`, `onError`, `onRefused`, `language`, or a list, such as `parameters`; of an automaton
    `period`, `variables`, `functions`, `import` or the list `inputs`; of a state `name`, `entry`, `code`,
    `exit` or `argument`; of a transition `name`, `trigger`, `guard`, `fired` or `priority`. It is blank for
    the thing itself. `index` is that in a list, `name` the field of an entry or the name of an argument,
    `child` the automaton that gets the argument.
    """

    kind: Literal["document", "automaton", "state", "transition"]
    automaton: int = 0
    id: int = 0
    part: str = ""
    index: int = 0
    name: str = ""
    child: int = 0


class Spot(NamedTuple):
    """A place with the text that stands there, None for an element; line and column are 0 if unknown."""

    place: Place
    text: str | None
    line: int
    column: int


def spots(document: Document) -> Iterator[Spot]:
    """Yield all elements and texts of a document; an element comes before its texts."""
    yield from _text(Place(kind="document", part="description"), document.description)
    yield from _text(Place(kind="document", part="onError"), document.on_error)
    yield from _text(Place(kind="document", part="onRefused"), document.on_refused)
    yield from _text(Place(kind="document", part="language"), document.language)
    document_place = Place(kind="document")
    fields = ("name", "type", "default", "description")
    yield from _list(document_place, "parameters", document.parameters, fields)
    yield from _list(document_place, "events", document.events, ("name", "description"))
    yield from _list(document_place, "properties", document.properties, ("name", "within", "expression"))
    for automaton in document.automata:
        yield from _automaton(automaton)
    yield from _list(document_place, "libraries", document.libraries, ("name",))
    yield from _list(document_place, "interfaces", document.interfaces, ("name", "proxy", "type"))


def _automaton(automaton: Automaton) -> Iterator[Spot]:
    place = Place(kind="automaton", automaton=automaton.id)
    yield Spot(place, None, automaton.line, automaton.column)
    for state in automaton.states:
        yield from _state(automaton, state)
    for transition in automaton.transitions:
        yield from _transition(automaton, transition)
    inputs: tuple[Parameter, ...] = automaton.inputs
    yield from _list(place, "inputs", inputs, ("name", "type", "default", "description"))
    if automaton.imported is not None:
        yield from _text(_part(place, "import"), automaton.imported.file)
    yield from _text(_part(place, "period"), automaton.iteration_time)
    yield from _text(_part(place, "variables"), automaton.variables)
    yield from _text(_part(place, "functions"), automaton.functions)


def _state(automaton: Automaton, state: State) -> Iterator[Spot]:
    place = Place(kind="state", automaton=automaton.id, id=state.id)
    yield Spot(place, None, state.line, state.column)
    yield Spot(_part(place, "name"), state.name, 0, 0)
    yield from _text(_part(place, "entry"), state.entry)
    yield from _text(_part(place, "code"), state.code)
    yield from _text(_part(place, "exit"), state.exit)
    for argument in state.arguments:
        at = msgspec.structs.replace(place, part="argument", name=argument.name, child=argument.child)
        yield from _text(at, argument.value)


def _transition(automaton: Automaton, transition: Transition) -> Iterator[Spot]:
    place = Place(kind="transition", automaton=automaton.id, id=transition.id)
    yield Spot(place, None, transition.line, transition.column)
    yield Spot(_part(place, "name"), transition.name, 0, 0)
    yield from _text(_part(place, "fired"), transition.code)
    yield from _text(_part(place, "trigger"), transition.trigger)
    yield from _text(_part(place, "guard"), transition.guard)
    yield from _text(_part(place, "priority"), transition.priority)


def _list(place: Place, part: str, entries: Sequence[Node], fields: Sequence[str]) -> Iterator[Spot]:
    for index, entry in enumerate(entries):
        at = msgspec.structs.replace(place, part=part, index=index)
        yield Spot(at, None, entry.line, entry.column)
        for field in fields:
            yield from _text(msgspec.structs.replace(at, name=field), getattr(entry, field))


def _text(place: Place, text: Text | str | None) -> Iterator[Spot]:
    if isinstance(text, Text):
        yield Spot(place, text.text, text.line, text.column)
    else:
        yield Spot(place, text or "", 0, 0)


def _part(place: Place, part: str) -> Place:
    return msgspec.structs.replace(place, part=part)
