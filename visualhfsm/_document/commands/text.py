"""Set pieces of code by their place, and replace a text in all of them."""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from typing import Annotated, Final

import msgspec

from codegen.hfsm.document import Argument, Automaton, Document, Result, State, Text
from codegen.messages import Message, template
from visualhfsm._base.errors import EditError

from ..nodes import (
    changed,
    checked,
    find_automaton,
    find_state,
    find_transition,
    label,
    swapped,
    with_automaton,
)
from ..places import CODE, Place, pattern_for, spots
from ..serialization import MAX_SIZE
from .base import Command, Index

_Short = Annotated[str, msgspec.Meta(max_length=1000)]
_TITLES: Final = {
    ("automaton", "variables"): Message("Edit the variables"),
    ("automaton", "functions"): Message("Edit the functions"),
    ("state", "entry"): template("Edit the entry code of {label}"),
    ("state", "code"): template("Edit the code of {label}"),
    ("state", "exit"): template("Edit the exit code of {label}"),
    ("transition", "trigger"): template("Edit the trigger of {label}"),
    ("transition", "guard"): template("Edit the guard of {label}"),
    ("transition", "fired"): template("Edit the code of {label}"),
    ("state", "argument"): template("Set the argument {name} of {label}"),
    ("state", "result"): template("Take the output {name} in {label}"),
}
"""The names of the steps, for each kind of place that has code, and its parts."""
_SHOWN: Final = 30
"""Characters of a text in the name of a step."""


class SetText(Command, frozen=True, kw_only=True):
    """Set the text at a place with code: of an automaton, a state or a transition.

    That of an argument is the value for an input of the automaton below, that of a result the variable that
    takes an output; both are added to the state if they are not there yet.
    """

    typed = ("text",)
    place: Place
    text: str

    def apply(self, document: Document) -> Document:
        self._step()
        return with_automaton(document, self.place.automaton, self._changed)

    def title(self, document: Document) -> Message:
        place, step = self.place, self._step()
        automaton = find_automaton(document, place.automaton)
        if place.kind == "automaton":
            return step
        find = find_state if place.kind == "state" else find_transition
        return step.again({"name": place.name[:30], "label": label(find(automaton, place.id))})

    @property
    def merge_key(self) -> Hashable | None:
        return None if self.place.part == "result" else super().merge_key  # which is chosen, not typed

    def _step(self) -> Message:
        """Return the name of the step without its values. Raises EditError for a place without code."""
        kind, part = self.place.kind, self.place.part
        step = _TITLES.get((kind, part))
        if step is None:
            why = Message("there is no code in the {part} of a {kind}", part=part or "whole", kind=kind)
            raise EditError(Message("Cannot set the text"), why)
        return step

    def _changed(self, automaton: Automaton) -> Automaton:
        place, text = self.place, self.text
        if place.kind == "automaton":
            return changed(automaton, **{place.part: text})
        if place.kind == "transition":
            former = find_transition(automaton, place.id)
            new = changed(former, **{"code" if place.part == "fired" else place.part: text})
            return changed(automaton, transitions=swapped(automaton.transitions, former, new))
        state = find_state(automaton, place.id)
        is_item = place.part in ("argument", "result")
        new_state = self._with_item(state) if is_item else changed(state, **{place.part: text})
        return changed(automaton, states=swapped(automaton.states, state, new_state))

    def _with_item(self, state: State) -> State:
        """Return a state with an argument or a result that is changed or new."""
        place, is_result = self.place, self.place.part == "result"
        text = checked(self.text, Message("the variable") if is_result else Message("the argument"))
        items: tuple[Argument | Result, ...] = state.results if is_result else state.arguments
        former = next((each for each in items if (each.name, each.child) == (place.name, place.child)), None)
        if former is not None:
            items = swapped(items, former, changed(former, **{"variable" if is_result else "value": text}))
        elif not place.name.strip():
            raise EditError(
                Message("Cannot add the result") if is_result else Message("Cannot add the argument"),
                Message("it has no name"),
                Message("name an output of the automaton below")
                if is_result
                else Message("name an input of the automaton below"),
            )
        else:
            name = checked(place.name, Message("the name"))
            made = (
                Result(name=name, child=place.child, variable=Text(text))
                if is_result
                else Argument(name=name, child=place.child, value=Text(text))
            )
            items = (*items, made)
        return changed(state, **{"results" if is_result else "arguments": items})


class ReplaceText(Command, frozen=True, kw_only=True):
    """Replace a text in all code of the document, or in a `line` of it, from 1, at a `place`.

    `whole` and the matches are as in `search`.
    """

    text: _Short
    by: _Short
    whole: bool = False
    place: Place | None = None
    line: Index = 0

    def apply(self, document: Document) -> Document:
        found = list(self._found(document)) if self.text else []
        if not found:
            why = Message("no code has “{text}” in it", text=self.text[:_SHOWN])
            raise EditError(Message("Cannot replace"), why, Message("search again"))
        if sum(count for *_, count in found) * len(self.by) > MAX_SIZE:
            why = Message("it would have more than {limit} MiB", limit=MAX_SIZE >> 20)
            raise EditError(Message("Cannot replace that often"), why, Message("search for more letters"))
        pattern = pattern_for(self.text, whole=self.whole)
        for place, lines, part, _ in found:
            lines[part] = [pattern.sub(lambda _: self.by, "\n".join(lines[part]))]
            document = SetText(place=place, text="\n".join(lines)).apply(document)
        return document

    def title(self, document: Document) -> Message:
        count = sum(count for *_, count in self._found(document))
        return Message.counted(
            "Replace “{text}” by “{new}” (once)",
            "Replace “{text}” by “{new}” ({count} times)",
            count=count,
            text=self.text[:_SHOWN],
            new=self.by[:_SHOWN],
        )

    def _found(self, document: Document) -> Iterator[tuple[Place, list[str], slice, int]]:
        """Yield for each place with matches its lines, the slice to change, and the number of matches."""
        pattern = pattern_for(self.text, whole=self.whole)
        part = slice(self.line - 1, self.line) if self.line else slice(None)
        for place, text, _, _ in spots(document):
            if text and place.part in CODE and self.place in (None, place):
                lines = text.split("\n")
                if count := len(pattern.findall("\n".join(lines[part]))):
                    yield place, lines, part, count
