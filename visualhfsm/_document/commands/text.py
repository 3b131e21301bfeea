"""Set pieces of code by their place, replace a text in all of them, and correct misspelt names."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping
from itertools import groupby
from typing import Annotated, Final, get_args

import msgspec

from codegen.hfsm.document import NO_CHILD, Argument, Automaton, Document, Result, State, Text
from codegen.messages import Message, template
from visualhfsm._base.errors import EditError

from .. import nodes
from ..places import CODE, Place, pattern_for, texts_in
from ..serialization import MAX_SIZE
from ..straightening import straightened
from .automata import SetImport
from .base import Command, Index
from .component import ChangeEntry, ListName

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
_MOST_ARGUMENTS: Final = 16
_MOST_PLACES: Final = 10_000
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
        return nodes.with_automaton(document, self.place.automaton, self._changed)

    def title(self, document: Document) -> Message:
        place, step = self.place, self._step()
        automaton = nodes.find_automaton(document, place.automaton)
        if place.kind == "automaton":
            return step
        find = nodes.find_state if place.kind == "state" else nodes.find_transition
        return step.again({"name": place.name[:30], "label": nodes.label(find(automaton, place.id))})

    @property
    def merge_key(self) -> Hashable | None:
        return None if self.place.part == "result" else super().merge_key  # which is chosen, not typed

    def _step(self) -> Message:
        """Return the name of the step without its values. Raises EditError for a place without code."""
        kind, part = self.place.kind, self.place.part
        step = _TITLES.get((kind, part))
        if step is None:
            why = Message("there is no code in the {part} of a {kind}", part=part or "whole", kind=kind)
            raise EditError("Cannot set the text", why)
        return step

    def _changed(self, automaton: Automaton) -> Automaton:
        place, text = self.place, self.text
        if place.kind == "automaton":
            return nodes.changed(automaton, **{place.part: text})
        if place.kind == "transition":
            former = nodes.find_transition(automaton, place.id)
            new = nodes.changed(former, **{"code" if place.part == "fired" else place.part: text})
            return nodes.changed(automaton, transitions=nodes.swapped(automaton.transitions, former, new))
        state = nodes.find_state(automaton, place.id)
        is_item = place.part in ("argument", "result")
        new_state = self._with_item(state) if is_item else nodes.changed(state, **{place.part: text})
        return nodes.changed(automaton, states=nodes.swapped(automaton.states, state, new_state))

    def _with_item(self, state: State) -> State:
        """Return a state with an argument or a result that is changed or new."""
        place, is_result = self.place, self.place.part == "result"
        text = nodes.checked(self.text, Message("the variable") if is_result else Message("the argument"))
        items: tuple[Argument | Result, ...] = state.results if is_result else state.arguments
        former = next((each for each in items if (each.name, each.child) == (place.name, place.child)), None)
        if former is not None:
            items = nodes.swapped(
                items, former, nodes.changed(former, **{"variable" if is_result else "value": text})
            )
        elif not place.name.strip():
            why, hint = Message("it has no name"), Message("name an input or output of the automaton below")
            raise EditError("Cannot set the text", why, hint)
        else:
            name = nodes.checked(place.name, Message("the name"))
            made = (
                Result(name=name, child=place.child, variable=Text(text))
                if is_result
                else Argument(name=name, child=place.child, value=Text(text))
            )
            items = (*items, made)
        return nodes.changed(state, **{"results" if is_result else "arguments": items})


class SetArguments(Command, frozen=True, kw_only=True):
    """Set the arguments of a state for several inputs, such as the place at which somebody pointed."""

    automaton: Index
    state: Index
    child: Index = NO_CHILD
    values: Annotated[dict[_Short, _Short], msgspec.Meta(min_length=1, max_length=_MOST_ARGUMENTS)]

    def apply(self, document: Document) -> Document:
        place = Place(
            kind="state", automaton=self.automaton, id=self.state, part="argument", child=self.child
        )
        for name, text in self.values.items():
            document = SetText(place=msgspec.structs.replace(place, name=name), text=text).apply(document)
        return document

    def title(self, document: Document) -> Message:
        state = nodes.find_state(nodes.find_automaton(document, self.automaton), self.state)
        return Message("Set the arguments of {label}", label=nodes.label(state))


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
            raise EditError("Cannot replace", why, "search again")
        if sum(count for *_, count in found) * len(self.by) > MAX_SIZE:
            why = Message("it would have more than {limit} MiB", limit=MAX_SIZE >> 20)
            raise EditError("Cannot replace that often", why, "search for more letters")
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
        for place, text, _, _ in texts_in(document):
            if text and place.part in CODE and self.place in (None, place):
                lines = text.split("\n")
                if count := len(pattern.findall("\n".join(lines[part]))):
                    yield place, lines, part, count


class Correction(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, rename="camel"):
    """Where a name is written: from a `column` of a line on, both from 1, or as the value of a `field`."""

    place: Place
    line: Index = 0
    column: Index = 0
    field: str = ""


class CorrectName(Command, frozen=True, kw_only=True):
    """Replace a name by the one that is meant, once at each of some places."""

    name: _Short
    meant: _Short
    at: Annotated[tuple[Correction, ...], msgspec.Meta(max_length=_MOST_PLACES)]

    def apply(self, document: Document) -> Document:
        if not self.name or not self.at:
            raise self._changed()
        last_first = sorted(self.at, key=lambda at: (repr(at.place), at.line, at.column), reverse=True)
        for place, found in groupby(last_first, key=lambda each: each.place):
            corrections = list(found)
            fields = {each.field for each in corrections if each.field}
            if fields:
                document = self._in_field(document, place, fields.pop())
            else:
                document = self._in_text(document, place, corrections)
        return document

    def title(self, document: Document) -> Message:  # noqa: ARG002 - the base has it
        return Message.counted(
            "Replace “{text}” by “{new}” (once)",
            "Replace “{text}” by “{new}” ({count} times)",
            count=len(self.at),
            text=self.name[:_SHOWN],
            new=self.meant[:_SHOWN],
        )

    def _in_text(self, document: Document, place: Place, corrections: list[Correction]) -> Document:
        """Return the document with another text at a place; `corrections` are the last ones first."""
        lines = _text_at(document, place).split("\n")
        pattern = pattern_for(self.name, whole=True)
        for each in corrections:
            line = lines[each.line - 1] if 0 < each.line <= len(lines) else ""
            match = pattern.search(line, max(0, each.column - 1))
            if match is None or match[0] != self.name:
                raise self._changed()
            lines[each.line - 1] = line[: match.start()] + self.meant + line[match.end() :]
        return _with_text(document, place, "\n".join(lines))

    def _in_field(self, document: Document, place: Place, field: str) -> Document:
        """Return the document with another value of a field of the element at a place."""
        if place.kind != "state":
            at = place if place.part == "import" else msgspec.structs.replace(place, name=field)
            if _text_at(document, at).strip() != self.name:
                raise self._changed()
            return _with_text(document, at, self.meant)
        automaton = nodes.find_automaton(document, place.automaton)
        state = nodes.find_state(automaton, place.id)
        items: tuple[Argument | Result, ...] = state.results if place.part == "result" else state.arguments
        found = [each for each in items if (each.name, each.child) == (place.name, place.child)]
        if len(found) != 1 or _value(found[0], field) != self.name:
            raise self._changed()
        new = nodes.changed(found[0], **{field: self.meant})
        part = "results" if place.part == "result" else "arguments"
        state_now = nodes.changed(state, **{part: nodes.swapped(items, found[0], new)})
        return nodes.with_automaton(
            document,
            place.automaton,
            lambda each: nodes.changed(each, states=nodes.swapped(each.states, state, state_now)),
        )

    def _changed(self) -> EditError:
        return EditError(
            Message("Cannot replace “{text}”", text=self.name[:_SHOWN]),
            "it stands there no longer",
            "wait until the checks have run again",
        )


class StraightenText(Command, frozen=True, kw_only=True):
    """Write straight quotes, hyphens and spaces in the code, the value or the expression at a place."""

    place: Place

    def apply(self, document: Document) -> Document:
        text = _text_at(document, self.place)
        straight = straightened(text)
        return document if straight == text else _with_text(document, self.place, straight)

    def title(self, document: Document) -> Message:  # noqa: ARG002 - the base has it
        return Message("Write straight quotes, hyphens and spaces")


def _with_text(document: Document, place: Place, text: str) -> Document:
    """Return the document with another text at a place. Raises EditError for one without code."""
    lists: Mapping[str, ListName] = {each: each for each in get_args(ListName)}
    if place.part == "import":
        imported = nodes.find_automaton(document, place.automaton).imported
        source = NO_CHILD if imported is None else imported.automaton
        return SetImport(automaton=place.automaton, file=text, source=source).apply(document)
    if place.part not in lists:
        return SetText(place=place, text=text).apply(document)
    return ChangeEntry(
        list=lists[place.part], automaton=place.automaton, index=place.index, fields={place.name: text}
    ).apply(document)


def _text_at(document: Document, place: Place) -> str:
    return next((placed.text for placed in texts_in(document) if placed.place == place and placed.text), "")


def _value(item: Argument | Result, field: str) -> str:
    """Return the value of a field that may be misspelt; empty for another one."""
    if field == "variable" and isinstance(item, Result):
        return item.variable.text.strip()
    return item.name if field == "name" else ""
