"""The base of all commands: values that arrive as JSON and turn a document into a new one."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import Annotated, Any, ClassVar, Final, Self

import msgspec

from codegen.hfsm.document import Automaton, Document
from codegen.hfsm.formats.native import MAX_ID
from codegen.messages import Message
from visualhfsm._base.errors import EditError
from visualhfsm._base.languages import known_language, said

from ..nodes import with_automaton

Id = Annotated[int, msgspec.Meta(ge=0, le=MAX_ID)]
Index = Annotated[int, msgspec.Meta(ge=0, le=1_000_000)]
Ids = tuple[Id, ...]
Language = Annotated[str, msgspec.Meta(max_length=40)]
"""The language of a name that a command makes up; blank is English."""


def _tag(name: str) -> str:
    return name[0].lower() + name[1:]


AUTOMATIC_LAYOUT: Final = Message("Automatic layout")
AS_FILE: Final = Message("Take the file as it is now")
MERGED: Final = Message("Merge with the file as it is now")
DUPLICATED: Final = Message("Duplicate")
_OURS: Final = {str(each): each for each in (AUTOMATIC_LAYOUT, AS_FILE, MERGED, DUPLICATED)}


def step_name(name: str) -> Message:
    """Return the name of a step that a command carries: one of ours, or what the page called it."""
    return _OURS.get(name) or Message.verbatim(name[:80])


class Command(
    msgspec.Struct,
    frozen=True,
    kw_only=True,
    forbid_unknown_fields=True,
    tag_field="command",
    tag=_tag,
    rename="camel",
):
    """A change of a document.

    In JSON, `command` is the name of the class with a lower-case first letter; fields are in camelCase.
    """

    typed: ClassVar[tuple[str, ...]] = ()
    """The fields that change while typing: commands that differ in nothing else make one step."""

    def apply(self, document: Document) -> Document:
        """Return the changed document, or the same object when nothing changes.

        The result depends on nothing else, so that commands can be replayed. Raises EditError.
        """
        raise NotImplementedError

    def title(self, document: Document) -> Message:
        """Return the name of the step in the undo list; `document` is the one before it."""
        raise NotImplementedError

    @property
    def merge_key(self) -> Hashable | None:
        """The key that consecutive commands of one step share, such as while typing; None to never merge."""
        if not self.typed:
            return None
        return type(self), *(getattr(self, name) for name in self.__struct_fields__ if name not in self.typed)

    @property
    def text_typed(self) -> str:
        """The typed text of a command for one piece of text."""
        text: str = getattr(self, self._text_field())
        return text

    def with_text(self, text: str) -> Self:
        """Return the command with another text. Raises EditError when it sets no piece of text."""
        return msgspec.structs.replace(self, **{self._text_field(): text})

    def _text_field(self) -> str:
        return only_text(self, self.typed)

    def own_fields(self, base: type[Command]) -> dict[str, Any]:
        """Return the fields of a command, by name, without those of its base class."""
        names = (name for name in self.__struct_fields__ if name not in base.__struct_fields__)
        return {name: getattr(self, name) for name in names}


class AutomatonCommand(Command, frozen=True, kw_only=True):
    """A change of one automaton."""

    automaton: Id

    def change(self, automaton: Automaton) -> Automaton:
        """Return the changed automaton, or the same object when nothing changes. Raises EditError."""
        raise NotImplementedError

    def apply(self, document: Document) -> Document:
        """Return the document with the changed automaton."""
        return with_automaton(document, self.automaton, self.change)


def made_up(name: Message, language: Language) -> str:
    """Return a name in the language of a command."""
    return said(name, known_language(language))


def only_text(command: Command, fields: Sequence[str]) -> str:
    """Return the typed field. Raises EditError when a command has none, or several."""
    if len(fields) != 1:
        raise EditError(
            "Cannot merge what was typed",
            Message("{name} sets no piece of text", name=type(command).__name__),
        )
    return fields[0]
