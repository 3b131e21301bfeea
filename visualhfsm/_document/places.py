"""The places of a document: their names, what is at a line of its file, and where a text occurs."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from typing import Final, Literal, NamedTuple

import msgspec

from codegen.code_marks import MarkedCode, plain
from codegen.hfsm.document import Automaton, Document, Node, State, Text, Transition
from codegen.messages import Message

CODE: Final = frozenset(
    ("argument", "code", "entry", "exit", "fired", "functions", "guard", "result", "trigger", "variables")
)
"""The parts that hold code, or the name of a variable."""
TEXTS: Final = CODE | {
    *("description", "import", "language", "name", "onError", "onRefused"),
    *("period", "priority", "text", "world"),
}
"""The parts of a document, automaton, state, transition or annotation that are typed."""

_NAMED: Final = {
    "argument": Message("argument"),
    "code": Message("code"),
    "entry": Message("entry"),
    "events": Message("events"),
    "exit": Message("exit code"),
    "fired": Message("fired"),
    "functions": Message("functions"),
    "guard": Message("guard"),
    "import": Message("import"),
    "inputs": Message("inputs"),
    "interfaces": Message("interfaces"),
    "libraries": Message("libraries"),
    "outputs": Message("outputs"),
    "parameters": Message("parameters"),
    "period": Message("period"),
    "priority": Message("priority"),
    "properties": Message("properties"),
    "result": Message("result"),
    "survives": Message("failures to survive"),
    "trigger": Message("trigger"),
    "variables": Message("variables"),
}
"""The names in messages of the parts of a document; the others have the names of their elements."""
_MOST_HITS: Final = 1000
_LONGEST_EXCERPT: Final = 160


class Place(msgspec.Struct, frozen=True, kw_only=True, rename="camel", omit_defaults=True):
    """A place in a document.

    `id` is that of a state, a transition or an annotation of the `automaton`. `part` is one of its fields: of
    a document `description`, `onError`, `onRefused`, `world`, `language`, or a list, such as `parameters`; of
    an automaton `period`, `variables`, `functions`, `import` or the lists `inputs` and `outputs`; of a state
    `name`, `entry`, `code`, `exit`, `argument` or `result`; of a transition `name`, `trigger`, `guard`,
    `fired` or `priority`; of an annotation `text`. It is blank for the element itself. `index` is that in a
    list, `name` the field of an entry or the name of an argument or a result, `child` the automaton that it
    is for.
    """

    kind: Literal["document", "automaton", "state", "transition", "annotation"]
    automaton: int = 0
    id: int = 0
    part: str = ""
    index: int = 0
    name: str = ""
    child: int = 0


class PlacedText(NamedTuple):
    """A place with its text, None for an element; line and column are 0 if unknown."""

    place: Place
    text: str | None
    line: int
    column: int


def texts_in(document: Document) -> Iterator[PlacedText]:
    """Yield all elements and texts of a document; an element comes before its texts."""
    yield from _text(Place(kind="document", part="description"), document.description)
    yield from _text(Place(kind="document", part="onError"), document.on_error)
    yield from _text(Place(kind="document", part="onRefused"), document.on_refused)
    yield from _text(Place(kind="document", part="world"), document.world)
    yield from _text(Place(kind="document", part="language"), document.language)
    document_place = Place(kind="document")
    fields = ("name", "type", "default", "description")
    yield from _list(document_place, "parameters", document.parameters, fields)
    yield from _list(document_place, "events", document.events, ("name", "description"))
    yield from _list(document_place, "properties", document.properties, ("name", "within", "expression"))
    fields = ("part", "kind", "amount", "after")
    yield from _list(document_place, "survives", document.survives, fields)
    for automaton in document.automata:
        yield from _automaton(automaton)
    yield from _list(document_place, "libraries", document.libraries, ("name",))
    yield from _list(document_place, "interfaces", document.interfaces, ("name", "proxy", "type"))
    yield from _list(document_place, "ros", document.ros, ("name", "target", "type", "qos", "stop"))


def text_of(code: MarkedCode, texts: Iterable[PlacedText]) -> tuple[PlacedText, int] | None:
    """Return the text of marked code, and how many blank lines are before the code; None if it has none."""
    owner = code.automaton, code.id, code.part, code.name
    found = [
        each
        for each in texts
        if each.text and (each.place.automaton, each.place.id, each.place.part, each.place.name) == owner
    ]
    placed = next((each for each in found if plain(each.text or "") == code.text), next(iter(found), None))
    if placed is None:
        return None
    text = placed.text or ""
    return placed, text.count("\n", 0, len(text) - len(text.lstrip()))


def _automaton(automaton: Automaton) -> Iterator[PlacedText]:
    place = Place(kind="automaton", automaton=automaton.id)
    yield PlacedText(place, None, automaton.line, automaton.column)
    for state in automaton.states:
        yield from _state(automaton, state)
    for transition in automaton.transitions:
        yield from _transition(automaton, transition)
    for annotation in automaton.annotations:
        at = Place(kind="annotation", automaton=automaton.id, id=annotation.id)
        yield PlacedText(at, None, annotation.line, annotation.column)
        yield from _text(_part(at, "text"), annotation.text)
    fields = ("name", "type", "default", "description")
    yield from _list(place, "inputs", automaton.inputs, fields)
    yield from _list(place, "outputs", automaton.outputs, fields)
    if (imported := automaton.imported) is not None:
        yield PlacedText(_part(place, "import"), None, imported.line, imported.column)
        yield from _text(_part(place, "import"), imported.file)
    yield from _text(_part(place, "period"), automaton.iteration_time)
    yield from _text(_part(place, "variables"), automaton.variables)
    yield from _text(_part(place, "functions"), automaton.functions)


def _state(automaton: Automaton, state: State) -> Iterator[PlacedText]:
    place = Place(kind="state", automaton=automaton.id, id=state.id)
    yield PlacedText(place, None, state.line, state.column)
    yield PlacedText(_part(place, "name"), state.name, 0, 0)
    yield from _text(_part(place, "entry"), state.entry)
    yield from _text(_part(place, "code"), state.code)
    yield from _text(_part(place, "exit"), state.exit)
    for argument in state.arguments:
        at = msgspec.structs.replace(place, part="argument", name=argument.name, child=argument.child)
        yield PlacedText(at, None, argument.line, argument.column)
        yield from _text(at, argument.value)
    for result in state.results:
        at = msgspec.structs.replace(place, part="result", name=result.name, child=result.child)
        yield PlacedText(at, None, result.line, result.column)
        yield from _text(at, result.variable)


def _transition(automaton: Automaton, transition: Transition) -> Iterator[PlacedText]:
    place = Place(kind="transition", automaton=automaton.id, id=transition.id)
    yield PlacedText(place, None, transition.line, transition.column)
    yield PlacedText(_part(place, "name"), transition.name, 0, 0)
    yield from _text(_part(place, "fired"), transition.code)
    yield from _text(_part(place, "trigger"), transition.trigger)
    yield from _text(_part(place, "guard"), transition.guard)
    yield from _text(_part(place, "priority"), transition.priority)


def _list(place: Place, part: str, entries: Sequence[Node], fields: Sequence[str]) -> Iterator[PlacedText]:
    for index, entry in enumerate(entries):
        at = msgspec.structs.replace(place, part=part, index=index)
        yield PlacedText(at, None, entry.line, entry.column)
        for field in fields:
            yield from _text(msgspec.structs.replace(at, name=field), getattr(entry, field))


def _text(place: Place, text: Text | str | None) -> Iterator[PlacedText]:
    if isinstance(text, Text):
        yield PlacedText(place, text.text, text.line, text.column)
    else:
        yield PlacedText(place, text or "", 0, 0)


def _part(place: Place, part: str) -> Place:
    return msgspec.structs.replace(place, part=part)


def texts_at(document: Document, place: Place) -> tuple[str, ...]:
    """Return the text at a place, or all texts of an element but its name; nothing where neither exists."""
    owner = place.kind, place.automaton, place.id
    return tuple(
        placed.text
        for placed in texts_in(document)
        if placed.text is not None
        and (
            placed.place == place
            if place.part
            else _owner_of(placed.place) == owner and placed.place.part != "name"
        )
    )


def _owner_of(place: Place) -> tuple[str, int, int]:
    return place.kind, place.automaton, place.id


class Located(NamedTuple):
    """A place, with line and column in the text there, from 1; 0 for an element as a whole."""

    place: Place
    line: int
    column: int


class Locator:
    """A map from the lines of a file to the parts of the document that was read from it."""

    def __init__(self, document: Document) -> None:
        self._document = document
        self._texts: list[PlacedText] = []
        self._starts: list[tuple[int, int]] = []
        found = sorted(_owned(document), key=lambda item: (item[0].line, item[0].column))
        self._owners: list[Place] = []
        for placed, owner in found:
            self._texts.append(placed)
            self._starts.append((placed.line, placed.column))
            self._owners.append(owner)

    def find(self, line: int, column: int) -> Located | None:
        """Return the place at a position of the file, or None before the first known element."""
        index = bisect_right(self._starts, (line, column)) - 1
        if index < 0:
            return None
        placed = self._texts[index]
        if placed.text is None:
            return Located(placed.place, 0, 0)
        inside = line - placed.line
        if inside > placed.text.count("\n"):
            # The position is behind this text, in something that has no place in the document.
            return Located(self._owners[index], 0, 0)
        return Located(placed.place, inside + 1, column - placed.column + 1 if inside == 0 else column)

    def find_code(self, line: int, *, automaton: int = 0, state: int = 0) -> Located | None:
        """Return the piece of code at a line of the file, or None when there is none.

        Several pieces may share a line. Then the piece of the `automaton` and its `state`, or of a transition
        at that state, is preferred as far as these are known; among equals the first wins.
        """
        found = [placed for placed in self._texts if _has_code(placed, line)]
        if not found:
            return None
        near = self._near(automaton, state) if len(found) > 1 else frozenset()

        def likeness(placed: PlacedText) -> tuple[bool, ...]:
            assert placed.text is not None
            place = placed.place
            written = placed.text.split("\n")[line - placed.line].strip()
            return place.automaton == automaton, (place.kind, place.id) in near, bool(written)

        best = max(found, key=likeness)  # the first of those that are alike
        return Located(best.place, line - best.line + 1, 0)

    def name(self, located: Located) -> Message:
        """Return a place in a few words, such as `code of look, line 2`."""
        place, line, _ = located
        automaton = self._document.automaton(place.automaton)
        elements: Sequence[State | Transition] = ()
        if automaton is not None:
            elements = automaton.states if place.kind == "state" else automaton.transitions
        names = [each.name.strip() for each in elements if each.id == place.id]
        name = names[0] if names else ""
        words = self._owner(place, automaton)
        if place.part:
            part = _NAMED.get(place.part, place.part)
            if name:
                words = Message("{part} of {name}", part=part, name=name)
            else:
                words = Message("{part} of {owner}", part=part, owner=words)
        elif name:
            words = Message("state {label}", label=name)
            if place.kind == "transition":
                words = Message("transition `{name}`", name=name)
        return Message("{place}, line {line}", place=words, line=line) if line > 1 else words

    def _owner(self, place: Place, automaton: Automaton | None) -> Message:
        match place.kind:
            case "automaton":
                state = None if automaton is None else self._document.owner(automaton)
                if state is None:
                    return Message("the root automaton")
                return Message("the automaton of {state}", state=state.name.strip())
            case "state":
                return Message("state {id}", id=place.id)
            case "transition":
                return Message("transition {id}", id=place.id)
            case "annotation":
                return Message("annotation {id}", id=place.id)
            case "document":
                return Message("the component")

    def _near(self, automaton: int, state: int) -> frozenset[tuple[str, int]]:
        """Return a state and the transitions that leave or enter it, as kinds and ids of places."""
        source = self._document.automaton(automaton)
        transitions = () if source is None else source.transitions
        ends = (("transition", each.id) for each in transitions if state in (each.origin, each.destination))
        return frozenset((("state", state), *ends))


def _has_code(placed: PlacedText, line: int) -> bool:
    if placed.text is None or placed.place.part not in CODE or not placed.text:
        return False
    return placed.line <= line <= placed.line + placed.text.count("\n")


def _owned(document: Document) -> Iterator[tuple[PlacedText, Place]]:
    """Yield the texts_in that have a place in the file, each with the element that it belongs to."""
    element = Place(kind="document")
    for placed in texts_in(document):
        if placed.text is None:
            element = placed.place
        at = placed.place
        is_about_automaton = at.kind == "automaton" and at.part not in ("inputs", "outputs")
        owner = Place(kind="automaton", automaton=at.automaton) if is_about_automaton else element
        if placed.line:
            yield placed, owner


class Hit(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    """A match of a search: line and column in the text at the place, from 1, and the text of that line.

    `start` is where it begins in the `excerpt`, from 0.
    """

    place: Place
    line: int
    column: int
    length: int
    excerpt: str
    start: int


def search(document: Document, text: str, *, whole: bool = False) -> list[Hit]:
    """Return where a text occurs in names, code and all other typed text; the first 1000 places.

    Case matters only in the search for a `whole` word.
    """
    if not text:
        return []
    return list(islice(_hits(document, pattern_for(text, whole=whole)), _MOST_HITS))


def pattern_for(text: str, *, whole: bool) -> re.Pattern[str]:
    """Return the pattern of a search."""
    escaped = re.escape(text)
    return re.compile(rf"(?<!\w){escaped}(?!\w)") if whole else re.compile(escaped, re.IGNORECASE)


def _hits(document: Document, pattern: re.Pattern[str]) -> Iterator[Hit]:
    for place, text, _, _ in texts_in(document):
        for found in pattern.finditer(text or ""):
            assert text is not None
            start = text.rfind("\n", 0, found.start()) + 1
            end = text.find("\n", found.start())
            line = text[start : end if end >= 0 else len(text)]
            excerpt, at = _excerpt(line, found.start() - start)
            yield Hit(
                place=place,
                line=text.count("\n", 0, found.start()) + 1,
                column=found.start() - start + 1,
                length=found.end() - found.start(),
                excerpt=excerpt,
                start=at,
            )


def _excerpt(line: str, at: int) -> tuple[str, int]:
    """Return the excerpt of a line around a position, and the index of the position in it."""
    first = max(0, at - _LONGEST_EXCERPT // 2) if len(line) > _LONGEST_EXCERPT else 0
    cut = line[first : first + _LONGEST_EXCERPT]
    return cut.strip(), max(0, at - first - (len(cut) - len(cut.lstrip())))
