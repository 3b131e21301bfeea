"""A servant that keeps notes, and returns the name under which it was called."""

# mypy: disable-error-code="empty-body"
from __future__ import annotations

import threading

from tests.support.limits import EVENT_LIMIT
from zenoh_ice import generated as ice
from zenoh_ice.generated import Current

__all__ = ["Notebook", "NotebookPrx"]


class NotebookPrx(ice.ObjectPrx, id="::test::Notebook", fingerprint="c0ffee0000000005"):
    @ice.operation()
    def note(self, text: str) -> None: ...

    @ice.operation(idempotent=True)
    def notes(self) -> list[str]: ...

    @ice.operation()
    def about(self) -> dict[str, str]: ...

    @ice.operation(idempotent=True)
    def who(self) -> dict[str, str]: ...


NotebookPrx.ice_interface.module = ""  # it has no schema


class Notebook(ice.Object, proxy=NotebookPrx):
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
        """The notes."""
        return list(self._notes)

    def notes(self, current: Current) -> list[str]:
        return self.notes_so_far

    def about(self, current: Current) -> dict[str, str]:
        self.called += 1
        return {"servant": self._name, "identity": current.identity}

    def who(self, current: Current) -> dict[str, str]:
        return self.about(current)

    def wait_for(self, count: int) -> list[str]:
        """Wait for a number of notes, and return them."""
        with self._changed:
            self._changed.wait_for(lambda: len(self._notes) >= count, EVENT_LIMIT)
            return list(self._notes)
