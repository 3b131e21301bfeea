"""One browser window: what it has been told already, and what it follows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import msgspec

from .outbox import Outbox
from .protocol import Closed, DocumentPush, Output, Push, Snapshot, Stale, Structure, encode
from .rendering import Rendering, full, patch

if TYPE_CHECKING:
    from .tab import Tab

__all__ = ["Window"]


class Window:
    """Gets the changes of all tabs from the moment it is `greeted`, each as far as it is new to it."""

    def __init__(self, outbox: Outbox) -> None:
        self._outbox = outbox
        self._told: dict[int, Rendering] = {}  # the documents as the window has them, by tab
        self.greeted = False

    def greet(self) -> None:
        """Tell everything from now on; the window knows nothing yet."""
        self.greeted = True
        self._told.clear()

    def push(self, push: Push) -> None:
        """Tell something; an older value of the same thing that still waits is left out."""
        if not self.greeted:
            return
        if isinstance(push, Output):
            self._outbox.output(push)
        else:
            of = push.component if isinstance(push, Snapshot | Structure | Stale) else getattr(push, "tab", 0)
            self._outbox.push((type(push), of), lambda: encode(push))

    def show(self, tab: Tab) -> None:
        """Tell what is new in the document of a tab."""
        if self.greeted:
            self._outbox.push((DocumentPush, tab.id), lambda: self._document(tab))

    def close(self, tab: int) -> None:
        """Tell that a tab is closed, and nothing of it any more."""
        self._told.pop(tab, None)
        self._outbox.forget(lambda key: isinstance(key, tuple) and key[1] == tab)
        self.push(Closed(tab=tab))

    def _document(self, tab: Tab) -> bytes:
        # Made when it is sent: a window that is slow gets one patch over all that happened meanwhile.
        shown = tab.shown
        known = self._told.get(tab.id)
        self._told[tab.id] = shown.rendering
        change = None if known is None else patch(known, shown.rendering)
        return encode(
            DocumentPush(
                tab=tab.id,
                revision=shown.revision,
                undo=shown.undo,
                redo=shown.redo,
                dirty=shown.dirty,
                full=full(shown.rendering) if change is None else msgspec.UNSET,
                patch=msgspec.UNSET if change is None else change,
            )
        )
