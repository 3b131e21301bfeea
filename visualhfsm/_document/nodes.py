"""Find and change elements of a document; choose ids and names for new ones.

Only values that a file can hold are accepted.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import replace
from itertools import count
from typing import Any, Final, TypeVar

from codegen.hfsm import document as model
from codegen.hfsm.formats.native import MAX_ID
from codegen.hfsm.formats.writer import UNWRITABLE
from codegen.messages import Message
from visualhfsm._base.errors import EditError

MAX_AUTOMATA: Final = 10_000
"""Automata that a document may hold."""

_MAX_TEXT: Final = 1 << 20
FARTHEST_PLACE: Final = 1e6
"""Pixels: no coordinate is farther away from the origin."""
_LONGEST_LABEL: Final = 30
_NUMBERED: Final = re.compile(r"^(?P<stem>.*?)\s+\d{1,9}$", re.DOTALL)

_NodeT = TypeVar("_NodeT", bound=model.Node)
_NumberedT = TypeVar("_NumberedT", model.Automaton, model.State, model.Transition, model.Annotation)
_T = TypeVar("_T")


def checked(text: str, what: Message) -> str:
    """Return a text that a document can hold.

    Raises EditError for a character that XML cannot contain, and for a text that is too long.
    """
    found = UNWRITABLE.search(text)
    if found:
        line = text.count("\n", 0, found.start()) + 1
        raise EditError(
            Message("Cannot set {what}", what=what),
            Message("line {line} has the control character U+{code:04X}", line=line, code=ord(found.group())),
            "remove it, or write it as an escape in the code",
        )
    if len(text) > _MAX_TEXT:
        why = Message("it has {count} characters, more than {limit}", count=len(text), limit=_MAX_TEXT)
        raise EditError(
            Message("Cannot set {what}", what=what), why, "move code to a module and import it as a library"
        )
    return text


def coordinate(value: float) -> float:
    """Return a coordinate in pixels, rounded to hundredths. Raises EditError when it is not on the canvas."""
    if not math.isfinite(value) or abs(value) > FARTHEST_PLACE:
        why = Message(
            "{value} is not within {limit:.0f} pixels of the origin", value=value, limit=FARTHEST_PLACE
        )
        raise EditError("Cannot move that far", why, "move it closer to the others")
    return round(float(value), 2)


def size(value: float) -> float:
    """Return a width or height of an annotation in pixels. Raises EditError when it is none."""
    return max(model.SMALLEST_ANNOTATION, coordinate(value))


def changed(node: _NodeT, **fields: Any) -> _NodeT:  # noqa: ANN401 - whatever the node has
    """Return a node with other fields; a string for a field of type `Text` becomes a `Text`.

    Returns the node itself when nothing differs. Raises EditError for a text that a file cannot hold.
    """
    values: dict[str, Any] = {}
    for name, given in fields.items():
        former = getattr(node, name)
        value = given
        if isinstance(given, str):
            text = checked(given, Message("the {name}", name=name.replace("_", " ")))
            value = model.Text(text) if isinstance(former, model.Text) else text
        if value != former:
            values[name] = value
    if not values:
        return node
    made: _NodeT = replace(node, **values)
    return made


def swapped(items: tuple[_T, ...], old: _T, new: _T) -> tuple[_T, ...]:
    """Return items with one of them, compared by identity, replaced by another."""
    return items if old is new else tuple(new if item is old else item for item in items)


def find_automaton(document: model.Document, id: int) -> model.Automaton:
    """Return the automaton with an id. Raises EditError when there is none, or more than one."""
    return _only(document.automata, id, lambda: Message("automaton {id}", id=id))


def find_state(automaton: model.Automaton, id: int) -> model.State:
    """Return the state with an id. Raises EditError when there is none, or more than one."""
    return _only(
        automaton.states,
        id,
        lambda: Message("state {id} of automaton {automaton}", id=id, automaton=automaton.id),
    )


def find_transition(automaton: model.Automaton, id: int) -> model.Transition:
    """Return the transition with an id. Raises EditError when there is none, or more than one."""
    return _only(
        automaton.transitions,
        id,
        lambda: Message("transition {id} of automaton {automaton}", id=id, automaton=automaton.id),
    )


def find_annotation(automaton: model.Automaton, id: int) -> model.Annotation:
    """Return the annotation with an id. Raises EditError when there is none, or more than one."""
    return _only(
        automaton.annotations,
        id,
        lambda: Message("annotation {id} of automaton {automaton}", id=id, automaton=automaton.id),
    )


def _only(items: Iterable[_NumberedT], id: int, what: Callable[[], Message]) -> _NumberedT:
    found = [each for each in items if each.id == id]
    if not found:
        raise EditError(
            Message("Cannot change {what}", what=what()),
            "it does not exist",
            "it may have been deleted meanwhile",
        )
    if len(found) > 1:
        why = Message("{count} have this number", count=len(found))
        raise EditError(
            Message("Cannot change {what}", what=what()),
            why,
            "give each its own number with `Repair numbers`",
        )
    return found[0]


def require_own_content(automaton: model.Automaton, what: Message) -> None:
    """Raise EditError, which begins with `what`, for an automaton whose content is imported."""
    if automaton.imported is not None:
        raise EditError(what, "its content comes from another file", "change that file, or inline it first")


def require_room(document: model.Document, more: int, what: Message) -> None:
    """Raise EditError, which begins with `what`, when a document cannot hold so many more automata."""
    if len(document.automata) + more > MAX_AUTOMATA:
        why = Message("the document would have more than {limit} automata", limit=MAX_AUTOMATA)
        raise EditError(what, why, "move some to separate documents and import them")


def with_automaton(
    document: model.Document, id: int, change: Callable[[model.Automaton], model.Automaton]
) -> model.Document:
    """Return a document with one automaton changed, the same object when nothing changes."""
    former = find_automaton(document, id)
    new = change(former)
    return document if new is former else replace(document, automata=swapped(document.automata, former, new))


def label(node: model.State | model.Transition | model.Annotation) -> Message:
    """Return the name of a state or a transition, or the words of an annotation, for a message or a step."""
    name = " ".join((node.text.text if isinstance(node, model.Annotation) else node.name).split())
    if not name:
        return _unnamed(node)
    short = name if len(name) <= _LONGEST_LABEL else f"{name[: _LONGEST_LABEL - 1]}…"
    return Message.verbatim(f"“{short}”")


def described(annotation: model.Annotation) -> Message:
    """Return what people call a note or a frame in the name of a step: by its words, if it has any."""
    is_frame = annotation.kind == "frame"
    if not annotation.text.text.strip():
        return Message("a frame") if is_frame else Message("a note")
    if is_frame:
        return Message("the frame {label}", label=label(annotation))
    return Message("the note {label}", label=label(annotation))


def _unnamed(node: model.State | model.Transition | model.Annotation) -> Message:
    match node:
        case model.State():
            return Message("state {id}", id=node.id)
        case model.Transition():
            return Message("transition {id}", id=node.id)
    return Message.verbatim(str(node.id))


def free_ids(used: Iterable[int]) -> Iterator[int]:
    """Yield ids that are not used: those above all others first, so that none is reused soon."""
    taken = {0, *used}
    yield from range(max(taken) + 1, MAX_ID + 1)
    yield from (number for number in range(1, MAX_ID + 1) if number not in taken)


def automaton_ids(document: model.Document) -> Iterator[int]:
    """Yield ids for new automata; one that is only referred to counts as used."""
    used = {automaton.id for automaton in document.automata}
    used.update(automaton.father for automaton in document.automata)
    for _, state in document.states():
        used.update(state.children)
    return free_ids(used)


def state_ids(automaton: model.Automaton) -> Iterator[int]:
    """Yield ids for new states; one that is only referred to counts as used."""
    used = {state.id for state in automaton.states}
    for transition in automaton.transitions:
        used.update((transition.origin, transition.destination))
    return free_ids(used)


def transition_ids(automaton: model.Automaton) -> Iterator[int]:
    """Yield ids for new transitions."""
    return free_ids(transition.id for transition in automaton.transitions)


def free_name(wanted: str, taken: Collection[str], separator: str = " ") -> str:
    """Return a free name: `wanted`, or `wanted` with the next number, such as `wait 2`."""
    if wanted not in taken:
        return wanted
    numbered = _NUMBERED.match(wanted) if separator == " " else None
    stem = numbered["stem"] if numbered else wanted
    return next(name for number in count(2) if (name := f"{stem}{separator}{number}") not in taken)
