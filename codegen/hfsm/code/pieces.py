"""Go through the code of a document piece by piece."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

from ...diagnostics import Location
from ..document import Automaton, Document, Text

__all__ = ["Piece", "is_foreign", "pieces_of"]

_PYTHON: Final = ("", "python", "py", "python3")


class Piece(NamedTuple):
    """A piece of code that is not blank, what it is, and the file that it stands in."""

    what: str
    text: Text
    path: Path

    @property
    def place(self) -> Location:
        """Where its first character stands."""
        return Location(self.path, self.text.line, max(1, self.text.column))


def is_foreign(document: Document) -> bool:
    """Return whether a document says that its code is in another language than Python."""
    return document.language.text.strip().lower() not in _PYTHON


def pieces_of(document: Document, path: Path) -> Iterator[Piece]:
    """Yield the code of the automata in the order of the document, which lies at `path`."""
    for automaton in document.automata:
        for what, text in _texts(automaton):
            if not text.is_blank:
                yield Piece(what, text, automaton.path or path)


def _texts(automaton: Automaton) -> Iterator[tuple[str, Text]]:
    yield f"the variables of automaton {automaton.id}", automaton.variables
    yield f"a function of automaton {automaton.id}", automaton.functions
    for state in automaton.states:
        label = f"`{state.name}`" if state.name.strip() else f"{state.id}"
        yield f"the entry code of state {label}", state.entry
        yield f"the code of state {label}", state.code
        yield f"the exit code of state {label}", state.exit
        for argument in state.arguments:
            yield f"the argument `{argument.name}` of state {label}", argument.value
    for transition in automaton.transitions:
        label = f"`{transition.name}`" if transition.name.strip() else f"{transition.id}"
        if transition.type == "condition":
            yield f"the condition of transition {label}", transition.trigger
        yield f"the guard of transition {label}", transition.guard
        yield f"the code of transition {label}", transition.code
