"""Replace a misspelt name by the one that is meant, where the checks have found it."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import groupby
from typing import Annotated, Final, get_args

import msgspec

from codegen.hfsm.document import Argument, Document, Result, Text
from codegen.messages import Message
from visualhfsm._base.errors import EditError

from ..nodes import changed, checked, find_automaton, find_state, swapped, with_automaton
from ..places import CODE, Place, pattern_for, spots
from .base import Command, Index
from .component import ChangeEntry, ListName
from .text import SetText

_Short = Annotated[str, msgspec.Meta(max_length=1000)]
_MOST_PLACES: Final = 1000
_SHOWN: Final = 30
"""Characters of a name in that of a step."""


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
        for place, found in groupby(
            sorted(self.at, key=_position, reverse=True), key=lambda each: each.place
        ):
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
        if place.part in CODE:
            return SetText(place=place, text="\n".join(lines)).apply(document)
        return self._in_entry(document, place, {place.name: "\n".join(lines)})

    def _in_field(self, document: Document, place: Place, field: str) -> Document:
        """Return the document with another value of a field of the element at a place."""
        if place.kind != "state":
            value = _text_at(document, msgspec.structs.replace(place, name=field))
            if value.strip() != self.name:
                raise self._changed()
            return self._in_entry(document, place, {field: self.meant})
        automaton = find_automaton(document, place.automaton)
        state = find_state(automaton, place.id)
        items: tuple[Argument | Result, ...] = state.results if place.part == "result" else state.arguments
        found = [each for each in items if (each.name, each.child) == (place.name, place.child)]
        if len(found) != 1 or _value(found[0], field) != self.name:
            raise self._changed()
        meant = checked(self.meant, Message("the name"))
        new = changed(found[0], **{field: Text(meant) if field == "variable" else meant})
        part = "results" if place.part == "result" else "arguments"
        state_now = changed(state, **{part: swapped(items, found[0], new)})
        return with_automaton(
            document,
            place.automaton,
            lambda each: changed(each, states=swapped(each.states, state, state_now)),
        )

    def _in_entry(self, document: Document, place: Place, fields: Mapping[str, str]) -> Document:
        """Return the document with other fields of an entry of a list."""
        lists: Mapping[str, ListName] = {each: each for each in get_args(ListName)}
        if place.part not in lists:
            raise self._changed()
        return ChangeEntry(
            list=lists[place.part], automaton=place.automaton, index=place.index, fields=dict(fields)
        ).apply(document)

    def _changed(self) -> EditError:
        return EditError(
            Message("Cannot replace “{text}”", text=self.name[:_SHOWN]),
            Message("it stands there no longer"),
            Message("wait until the checks have run again"),
        )


def _text_at(document: Document, place: Place) -> str:
    return next((spot.text for spot in spots(document) if spot.place == place and spot.text), "")


def _value(item: Argument | Result, field: str) -> str:
    """Return the value of a field that may be misspelt; empty for another one."""
    if field == "variable" and isinstance(item, Result):
        return item.variable.text.strip()
    return item.name if field == "name" else ""


def _position(correction: Correction) -> tuple[str, int, int]:
    return repr(correction.place), correction.line, correction.column
