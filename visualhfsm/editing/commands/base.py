"""What all commands are: values that come as JSON, and make a new document of one."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Annotated, Any, ClassVar

import msgspec

from codegen.hfsm.document import Document
from codegen.hfsm.formats.native import MAX_ID

__all__ = ["Command", "Id", "Ids", "Index"]

Id = Annotated[int, msgspec.Meta(ge=0, le=MAX_ID)]
Index = Annotated[int, msgspec.Meta(ge=0, le=1_000_000)]
Ids = tuple[Id, ...]


def _tag(name: str) -> str:
    return name[0].lower() + name[1:]


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

    In JSON its `command` is the name of its class with a small first letter, and its fields are in camelCase.
    """

    typed: ClassVar[tuple[str, ...]] = ()
    """The fields that change while a person types: commands that differ in nothing else make one step."""

    def apply(self, document: Document) -> Document:
        """Return the changed document, and the same one when there is nothing to change.

        Depends on nothing else, so that it does the same when it is applied again. Raises EditError.
        """
        raise NotImplementedError

    def title(self, document: Document) -> str:
        """Return what the step is called in the list of what can be undone; `document` is the former one."""
        raise NotImplementedError

    @property
    def merge_key(self) -> Hashable | None:
        """What consecutive commands have in common that make one step, such as typing; None for none."""
        if not self.typed:
            return None
        return type(self), *(getattr(self, name) for name in self.__struct_fields__ if name not in self.typed)

    def own_fields(self, base: type[Command]) -> dict[str, Any]:
        """Return the fields by name that a command has beside those of a class that it is made from."""
        names = (name for name in self.__struct_fields__ if name not in base.__struct_fields__)
        return {name: getattr(self, name) for name in names}
