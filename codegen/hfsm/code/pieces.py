"""Go through the code of a document piece by piece, and change it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Final, NamedTuple

from ...diagnostics import Location
from ..document import Automaton, Document, State, Text, Transition

__all__ = ["Piece", "change_code", "is_foreign", "pieces_of"]

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


def change_code(document: Document, change: Callable[[Text], Text]) -> Document:
    """Return a document in which each piece of code that is not blank is what `change` makes of it."""

    def changed(text: Text) -> Text:
        return text if text.is_blank else change(text)

    def state(old: State) -> State:
        arguments = tuple(replace(each, value=changed(each.value)) for each in old.arguments)
        entry, code = changed(old.entry), changed(old.code)
        return replace(old, entry=entry, code=code, exit=changed(old.exit), arguments=arguments)

    def transition(old: Transition) -> Transition:
        trigger = changed(old.trigger) if old.type == "condition" else old.trigger
        return replace(old, trigger=trigger, guard=changed(old.guard), code=changed(old.code))

    def automaton(old: Automaton) -> Automaton:
        return replace(
            old,
            states=tuple(map(state, old.states)),
            transitions=tuple(map(transition, old.transitions)),
            variables=changed(old.variables),
            functions=changed(old.functions),
        )

    return replace(document, automata=tuple(map(automaton, document.automata)))


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
