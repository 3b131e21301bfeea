"""Commands that insert text: states from the clipboard, ready states from the shelf, and whole documents."""

# ruff: noqa: ARG002 - `Command` documents its methods and their parameters

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from codegen.hfsm import document as model
from codegen.messages import Message
from visualhfsm._base.errors import EditError

from .. import nodes
from ..diff import KEYS
from ..geometry import Point
from ..serialization import parse
from ..subtrees import hanging, renumbered, renumbered_state, without_automata
from .base import Command, Id, Language, step_name
from .states import AddState
from .transitions import TransitionType

_STEP: Final = 30.0
"""Pixels by which states that would cover others are shifted, repeatedly."""
_SIDE: Final = 20.0
_NEAR: Final = range(-4, 5)
"""The squares of these sides, in pixels, between two circles that may touch."""


class PasteStates(Command, frozen=True, kw_only=True):
    """Paste a fragment into an automaton, with new numbers.

    Its upper left corner is placed at `x`, `y`, by default where it was copied from, or lower and farther
    right so as not to cover other states. Names are kept if they are free. A pasted state is initial only if
    the automaton has no initial state.
    """

    automaton: Id
    content: str
    x: float | None = None
    y: float | None = None
    name: str = ""

    def apply(self, document: model.Document) -> model.Document:
        target = nodes.find_automaton(document, self.automaton)
        nodes.require_own_content(target, Message("Cannot paste into this automaton"))
        fragment = parse(self.content, Message("Cannot paste"))
        if not fragment.automata or not (fragment.automata[0].states or fragment.automata[0].annotations):
            raise EditError("Cannot paste", "it contains no states", "copy states first")
        top, *others = fragment.automata
        numbers = _numbers(document, others)
        shift = self._shift(target, top)
        states = list(_pasted_states(target, top, numbers, shift))
        new_ids = {old.id: new.id for old, new in zip(top.states, states, strict=True)}
        transitions = list(_pasted_transitions(target, top, new_ids, shift))
        filled = replace(
            target,
            states=(*target.states, *states),
            transitions=(*target.transitions, *transitions),
            annotations=(*target.annotations, *_pasted_annotations(target, top, shift)),
        )
        pasted = tuple(renumbered(each, numbers, target.id) for each in others)
        return replace(document, automata=(*nodes.swapped(document.automata, target, filled), *pasted))

    def title(self, document: model.Document) -> Message:
        return step_name(self.name) if self.name else Message("Paste")

    def _shift(self, target: model.Automaton, top: model.Automaton) -> Point:
        pasted: tuple[model.State | model.Annotation, ...] = top.states or top.annotations
        placed: tuple[model.State | model.Annotation, ...] = (
            target.states if top.states else target.annotations
        )
        taken = {
            (across + right, down + below)
            for across, down in (_square(each.x, each.y) for each in placed)
            for right in _NEAR
            for below in _NEAR
        }
        right = 0.0 if self.x is None else nodes.coordinate(self.x) - min(each.x for each in pasted)
        down = 0.0 if self.y is None else nodes.coordinate(self.y) - min(each.y for each in pasted)
        while any(_square(each.x + right, each.y + down) in taken for each in pasted):
            right += _STEP
            down += _STEP
        return right, down


def _square(x: float, y: float) -> tuple[int, int]:
    return round(x / _SIDE), round(y / _SIDE)


class AddReadyState(Command, frozen=True, kw_only=True):
    """Add a state whose automaton is a copy of a whole document, as one of the shelf is.

    The state is called `name`, if that is free; it passes each input its default, to be changed, and its
    automaton restarts at each entry. With `origin`, a transition of the type `trigger` leads to it from
    there. What that document declares is added where it is not declared yet; another declaration of the same
    name is an error. Functions that are there already are not repeated: a component defines each only once.
    """

    automaton: Id
    content: str
    name: str
    x: float
    y: float
    origin: Id | None = None
    trigger: TransitionType = "condition"
    language: Language = ""

    def apply(self, document: model.Document) -> model.Document:
        what = Message("Cannot draw {name}", name=self.name[:40])
        fragment = parse(self.content, what)
        top = fragment.root
        if top is None:
            raise EditError(what, "it has no root automaton, or several", "fix its file")
        if fragment.language != document.language:
            why = Message(
                "its code is {language}, unlike that of this document",
                language=fragment.language.text.strip()[:20] or "Python",
            )
            raise EditError(what, why, "draw a state, and write its code")
        _require_same_declarations(document, fragment, what)
        former = nodes.find_automaton(document, self.automaton)
        document = AddState(
            automaton=former.id,
            x=self.x,
            y=self.y,
            origin=self.origin,
            trigger=self.trigger,
            language=self.language,
        ).apply(document)
        target = nodes.find_automaton(document, self.automaton)
        added = target.states[-1]
        numbers = _numbers(document, [top, *(each for each in fragment.automata if each is not top)])
        state = nodes.changed(
            added,
            name=nodes.free_name(
                nodes.checked(self.name, Message("the name")), {each.name for each in former.states}
            ),
            children=(numbers[top.id],),
            history=model.Text("restart"),
            arguments=tuple(
                model.Argument(name=each.name, value=model.Text(each.default.text)) for each in top.inputs
            ),
        )
        filled = replace(target, states=nodes.swapped(target.states, added, state))
        known = {each.functions.text.strip() for each in document.automata}
        copies = tuple(
            _without_functions(renumbered(each, numbers, target.id), known) for each in fragment.automata
        )
        drawn = replace(document, automata=(*nodes.swapped(document.automata, target, filled), *copies))
        return _with_declarations(drawn, fragment)

    def title(self, document: model.Document) -> Message:
        return Message("Draw {name}", name=self.name[:80])


class FillAutomaton(Command, frozen=True, kw_only=True):
    """Replace the content of an automaton by that of the first one of a document, with all below it.

    Its former content or import is removed. Libraries, interfaces, parameters and events of that document are
    added where their names are free.
    """

    automaton: Id
    content: str
    name: str = ""

    def apply(self, document: model.Document) -> model.Document:
        fragment = parse(self.content, Message("Cannot fill the automaton"))
        if not fragment.automata:
            raise EditError("Cannot fill the automaton", "the text contains none", "write one")
        target = nodes.find_automaton(document, self.automaton)
        document = without_automata(document, hanging(document, target, target.states))
        target = nodes.find_automaton(document, self.automaton)
        top, *others = fragment.automata
        numbers = _numbers(document, others)
        filled = replace(
            target,
            states=tuple(renumbered_state(state, numbers) for state in top.states),
            transitions=top.transitions,
            annotations=top.annotations,
            inputs=top.inputs,
            outputs=top.outputs,
            imported=None,
            iteration_time=top.iteration_time,
            variables=top.variables,
            functions=top.functions,
            extras=top.extras,
        )
        pasted = tuple(renumbered(each, numbers, target.id) for each in others)
        document = replace(document, automata=(*nodes.swapped(document.automata, target, filled), *pasted))
        return _with_declarations(document, fragment)

    def title(self, document: model.Document) -> Message:
        return step_name(self.name) if self.name else Message("Fill the automaton")


class ReplaceDocument(Command, frozen=True, kw_only=True):
    """Replace the whole document, such as by the result of a merge."""

    content: str
    name: str = ""

    def apply(self, document: model.Document) -> model.Document:
        new = parse(self.content, Message("Cannot replace the document"))
        return document if new == document else new

    def title(self, document: model.Document) -> Message:
        return step_name(self.name) if self.name else Message("Replace the document")


def _require_same_declarations(document: model.Document, fragment: model.Document, what: Message) -> None:
    """Raise EditError when two documents declare different things by the same name."""
    for name in ("interfaces", "ros", "parameters"):
        own = {KEYS[name](item): item for item in getattr(document, name)}
        for item in getattr(fragment, name):
            known = own.get(KEYS[name](item))
            if known is not None and _type_of(known) != _type_of(item):
                why = Message(
                    "it needs self.{name} as {type}, and here that is {known}",
                    name=item.name,
                    type=_type_of(item),
                    known=_type_of(known),
                )
                raise EditError(
                    what, why, Message("rename {name} in this document, with its uses", name=item.name)
                )


def _type_of(declared: model.Interface | model.RosInterface | model.Parameter) -> str:
    """Return the type of what is declared, without its scope."""
    text = declared.type.text if isinstance(declared.type, model.Text) else declared.type
    return text.strip().replace(".", "::").rpartition("::")[2]


def _without_functions(automaton: model.Automaton, known: set[str]) -> model.Automaton:
    """Return an automaton without its functions, if they are known."""
    return (
        replace(automaton, functions=model.Text()) if automaton.functions.text.strip() in known else automaton
    )


def _with_declarations(document: model.Document, fragment: model.Document) -> model.Document:
    """Return a document with the declarations of another one added."""
    lists: dict[str, tuple[model.Node, ...]] = {}
    for name in ("libraries", "interfaces", "ros", "parameters", "events"):
        own: tuple[model.Node, ...] = getattr(document, name)
        known = {KEYS[name](item) for item in own}
        lists[name] = (*own, *(item for item in getattr(fragment, name) if KEYS[name](item) not in known))
    return nodes.changed(document, **lists)


def _numbers(document: model.Document, automata: list[model.Automaton]) -> dict[int, int]:
    """Return new ids for automata that are added to a document. Raises EditError for too many of them."""
    what = Message("Cannot add these automata")
    nodes.require_room(document, len(automata), what)
    ids = nodes.automaton_ids(document)
    numbers: dict[int, int] = {}
    for automaton in automata:
        if automaton.id in numbers:
            why = Message("two automata in it have the number {automaton}", automaton=automaton.id)
            raise EditError(what, why, "use `Repair numbers` in the document they come from")
        numbers[automaton.id] = next(ids)
    return numbers


def _pasted_states(
    target: model.Automaton, top: model.Automaton, numbers: dict[int, int], shift: Point
) -> Iterator[model.State]:
    ids = nodes.state_ids(target)
    taken = {state.name for state in target.states}
    may_begin = not any(state.initial for state in target.states)
    for state in top.states:
        name = nodes.free_name(state.name, taken) if state.name.strip() else state.name
        taken.add(name)
        new = replace(
            renumbered_state(state, numbers),
            id=next(ids),
            initial=state.initial and may_begin,
            x=nodes.coordinate(state.x + shift[0]),
            y=nodes.coordinate(state.y + shift[1]),
        )
        may_begin = may_begin and not state.initial
        yield nodes.changed(new, name=name)


def _pasted_transitions(
    target: model.Automaton, top: model.Automaton, new_ids: dict[int, int], shift: Point
) -> Iterator[model.Transition]:
    ids = nodes.transition_ids(target)
    for transition in top.transitions:
        if transition.origin in new_ids and transition.destination in new_ids:
            yield replace(
                transition,
                id=next(ids),
                origin=new_ids[transition.origin],
                destination=new_ids[transition.destination],
                x=nodes.coordinate(transition.x + shift[0]),
                y=nodes.coordinate(transition.y + shift[1]),
            )


def _pasted_annotations(
    target: model.Automaton, top: model.Automaton, shift: Point
) -> Iterator[model.Annotation]:
    ids = nodes.free_ids(each.id for each in target.annotations)
    for each in top.annotations:
        yield replace(
            each, id=next(ids), x=nodes.coordinate(each.x + shift[0]), y=nodes.coordinate(each.y + shift[1])
        )
