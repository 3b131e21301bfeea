"""A servant that keeps notes, and says under which name it was called."""

from __future__ import annotations

import threading
from concurrent.futures import Future
from typing import ClassVar, Final

from tests.support.limits import LIMIT
from zenoh_ice.generated import Current, Interface, Object, ObjectPrx, Operation, Struct

__all__ = ["Notebook", "NotebookPrx"]


class _Nothing(Struct):
    pass


class _Text(Struct):
    text: str


class _Texts(Struct):
    returnValue: list[str]


class _About(Struct):
    returnValue: dict[str, str]


_note: Final[Operation[[str], None]] = Operation("note", arguments=_Text, result=_Nothing)
_notes: Final[Operation[[], list[str]]] = Operation(
    "notes", arguments=_Nothing, result=_Texts, idempotent=True
)
_about: Final[Operation[[], dict[str, str]]] = Operation("about", arguments=_Nothing, result=_About)
_who: Final[Operation[[], dict[str, str]]] = Operation(
    "who", arguments=_Nothing, result=_About, idempotent=True
)

NOTEBOOK: Final = Interface(
    "::test::Notebook",
    operations=(_note, _notes, _about, _who),
    fingerprint="c0ffee0000000005",
)


class NotebookPrx(ObjectPrx):
    ice_interface: ClassVar[Interface] = NOTEBOOK

    def note(self, text: str) -> None:
        return self.ice_invoke(_note, text)

    def noteAsync(self, text: str) -> Future[None]:
        return self.ice_invokeAsync(_note, text)

    def notes(self) -> list[str]:
        return self.ice_invoke(_notes)

    def about(self) -> dict[str, str]:
        return self.ice_invoke(_about)

    def who(self) -> dict[str, str]:
        return self.ice_invoke(_who)


class Notebook(Object):
    ice_interface: ClassVar[Interface] = NOTEBOOK

    def __init__(self, name: str = "") -> None:
        self._name = name
        self._changed = threading.Condition()
        self._notes: list[str] = []
        self.called = 0

    def note(self, text: str, current: Current) -> None:
        with self._changed:
            self._notes.append(text)
            self._changed.notify_all()

    @property
    def notes_so_far(self) -> list[str]:
        """What was noted."""
        return list(self._notes)

    def notes(self, current: Current) -> list[str]:
        return self.notes_so_far

    def about(self, current: Current) -> dict[str, str]:
        self.called += 1
        return {"servant": self._name, "identity": current.identity}

    def who(self, current: Current) -> dict[str, str]:
        return self.about(current)

    def wait_for(self, count: int) -> list[str]:
        """Wait until so many notes are there, and return them."""
        with self._changed:
            self._changed.wait_for(lambda: len(self._notes) >= count, LIMIT)
            return list(self._notes)
