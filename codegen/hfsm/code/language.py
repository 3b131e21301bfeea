"""Find the code of a document, and whether it is Python."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Final, NamedTuple

from ...diagnostics import Diagnostics, Location, Note
from ...messages import Message
from ..codes import Code
from ..document import Automaton, Document, State, Text, Transition
from .former import former_code

_PYTHON: Final = ("", "python", "py", "python3")


class DocumentCode(NamedTuple):
    """A text with code, its description, and its file."""

    what: Message
    text: Text
    path: Path

    @property
    def place(self) -> Location:
        """The place of its first character."""
        return Location(self.path, self.text.line, max(1, self.text.column))


def code_of(document: Document, path: Path) -> Iterator[DocumentCode]:
    """Yield the code of the automata in the order of the document at `path`."""
    for automaton in document.automata:
        for what, text in _texts(automaton):
            if not text.is_blank:
                yield DocumentCode(what, text, automaton.path or path)


def _texts(automaton: Automaton) -> Iterator[tuple[Message, Text]]:
    yield Message("the variables of automaton {id}", id=automaton.id), automaton.variables
    yield Message("a function of automaton {id}", id=automaton.id), automaton.functions
    for state in automaton.states:
        label = f"`{state.name}`" if state.name.strip() else f"{state.id}"
        yield Message("the entry code of state {label}", label=label), state.entry
        yield Message("the code of state {label}", label=label), state.code
        yield Message("the exit code of state {label}", label=label), state.exit
        for argument in state.arguments:
            yield (
                Message("the argument `{name}` of state {label}", name=argument.name, label=label),
                argument.value,
            )
    for transition in automaton.transitions:
        label = f"`{transition.name}`" if transition.name.strip() else f"{transition.id}"
        if transition.type == "condition":
            yield Message("the condition of transition {label}", label=label), transition.trigger
        yield Message("the guard of transition {label}", label=label), transition.guard
        yield Message("the code of transition {label}", label=label), transition.code


def change_code(document: Document, change: Callable[[Text], Text]) -> Document:
    """Return a document in which `change` has been applied to each piece of code that is not blank."""

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


def is_foreign(document: Document) -> bool:
    """Return whether the declared language of a document is not Python."""
    return document.language.text.strip().lower() not in _PYTHON


def first_foreign(document: Document, path: Path) -> DocumentCode | None:
    """Return the first code of a document in another language, or None.

    The language is that which the document declares; `path` is that of the document.
    """
    found = list(code_of(document, path)) if is_foreign(document) else []
    is_certain = former_code().is_other_language
    return next((each for each in found if is_certain(each.text.text)), found[0] if found else None)


def report_foreign(first: DocumentCode, language: str, diagnostics: Diagnostics, *notes: Note) -> None:
    """Report that a document is in another language, at its `first` code."""
    message = Message(
        "{language} in {what}: it is kept, but only Python can run", language=language, what=first.what
    )
    diagnostics.error(Code.FOREIGN_LANGUAGE, message, first.place, notes)
