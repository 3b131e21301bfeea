"""Set pieces of code by their place, and replace a text in all of them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Final

import msgspec

from codegen.hfsm.document import Document
from codegen.messages import Message
from visualhfsm._base.errors import EditError, VisualHfsmError

from ..places import CODE, Place, pattern_for, spots
from ..serialization import MAX_SIZE
from .automata import SetAutomatonCode
from .base import Command, Index
from .states import SetArgument, SetResult, SetStateCode
from .transitions import SetTransitionCode

_Short = Annotated[str, msgspec.Meta(max_length=1000)]
_SHOWN: Final = 30
"""Characters of a text in the name of a step."""


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
            document = with_code(document, place, "\n".join(lines))
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


def with_code(document: Document, place: Place, code: str) -> Document:
    """Return a document with another text for a piece of code; raises VisualHfsmError when there is none."""
    where: dict[str, Any] = {"automaton": place.automaton}
    command: Command
    match place.kind, place.part:
        case "state", "argument":
            command = SetArgument(**where, state=place.id, name=place.name, value=code, child=place.child)
        case "state", "result":
            command = SetResult(**where, state=place.id, name=place.name, variable=code, child=place.child)
        case "state", "entry" | "code" | "exit" as part:
            command = SetStateCode(**where, state=place.id, part=part, text=code)
        case "transition", "trigger" | "guard" | "fired" as part:
            command = SetTransitionCode(**where, transition=place.id, part=part, text=code)
        case "automaton", "variables" | "functions" as part:
            command = SetAutomatonCode(**where, part=part, text=code)
        case _:
            raise VisualHfsmError.because(
                "there is no code in the {part} of a {kind}", part=place.part or "whole", kind=place.kind
            )
    return command.apply(document)
