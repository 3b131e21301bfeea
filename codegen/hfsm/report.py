"""Report diagnostics of a document with their place, and name states and transitions in messages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from ..diagnostics import Diagnostics, Location, Note
from ..messages import NO_MESSAGE, Message, all_of
from .codes import Code
from .document import Automaton, Node, State, Text, Transition

_MAY_BE_IMPORTED: Final = {
    *(Code.UNDEFINED_NAME, Code.UNKNOWN_ATTRIBUTE, Code.UNSENT_EVENT),
    *(Code.UNUSED_EVENT, Code.UNUSED_ROS_INTERFACE),
}


class Report:
    """The diagnostics of one document, parts of which may come from other files.

    After imports of `automata` that failed, it says what may lack only because of them.
    """

    def __init__(self, path: Path, diagnostics: Diagnostics, automata: Sequence[Automaton] = ()) -> None:
        self._path = path
        self._diagnostics = diagnostics
        self._missing = [replace(each.imported, path=each.path) for each in automata if each.imported]
        files = dict.fromkeys(f"`{each.file.text.strip()[:100] or '?'}`" for each in self._missing)
        self._files = all_of([*files]) if files else NO_MESSAGE

    def unseen(self) -> None:
        """Say once what cannot be seen because of imports that failed."""
        if self._missing:
            message = Message(
                "not checked without {files}: what is there, what can never fire, conflicts and properties",
                files=self._files,
            )
            self.note(Code.NOT_SEEN, message, self._missing[0])

    def place(self, node: Node, text: Text | None = None) -> Location:
        """Return the place of an element, or of one of its texts."""
        path = node.path or self._path
        if text is not None and text.line:
            line = text.text.split("\n", 1)[0].strip()
            return Location(path, text.line, max(1, text.column), max(1, len(line)))
        return Location(path, node.line, max(1, node.column))

    def error(self, code: str, message: Message, where: Node | Location, notes: Sequence[Note] = ()) -> None:
        """Report an error: the component cannot be generated."""
        self._diagnostics.error(code, message, self._located(where), notes)

    def warning(
        self,
        code: str,
        message: Message,
        where: Node | Location,
        notes: Sequence[Note] = (),
        *,
        assumes: Message = NO_MESSAGE,
    ) -> None:
        """Report a possible mistake; `assumes` says what it holds under."""
        if self._missing and code in _MAY_BE_IMPORTED:
            note = Note(Message("{files}, which could not be imported, may change this", files=self._files))
            notes = [*notes, note]
        self._diagnostics.warning(code, message, self._located(where), notes, assumes=assumes)

    def note(self, code: str, message: Message, where: Node | Location, notes: Sequence[Note] = ()) -> None:
        """Report something that is probably intended."""
        self._diagnostics.note(code, message, self._located(where), notes)

    def _located(self, where: Node | Location) -> Location:
        return where if isinstance(where, Location) else self.place(where)

    def first(self, node: Node) -> Note:
        """Return a note that points to the first of two elements."""
        return Note(Message("the first is here"), self.place(node))


def state_label(state: State) -> Message:
    """Return the name of a state in messages."""
    name = state.name.strip()
    return Message.verbatim(f"`{name}`") if name else Message("state {id}", id=state.id)


def transition_label(transition: Transition) -> Message:
    """Return the name of a transition in messages."""
    name = transition.name.strip()
    return Message("transition `{name}`", name=name) if name else Message("transition {id}", id=transition.id)
