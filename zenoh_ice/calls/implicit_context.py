"""The context that a communicator's calls have in common."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from typing import Final

from ..wire.attachment import check_context

__all__ = ["ImplicitContext"]

_NOTHING: Final[Mapping[str, str]] = {}


class ImplicitContext:
    """Texts by name that every call of a communicator tells the servant, shared by all threads.

    What a proxy or a call says itself under the same name comes before it.
    """

    def __init__(self) -> None:
        self._lock: Final = threading.Lock()
        self.context = _NOTHING
        """What there is; it is replaced rather than changed, so that calls take no lock."""

    def getContext(self) -> dict[str, str]:
        """Return a copy."""
        return dict(self.context)

    def setContext(self, context: Mapping[str, str] | None) -> None:
        """Replace all; raises MarshalException for what is no context or too large."""
        checked = check_context(context or _NOTHING)
        with self._lock:
            self.context = checked

    def containsKey(self, key: str) -> bool:
        """Return whether there is a text of this name."""
        return key in self.context

    def get(self, key: str) -> str:
        """Return the text of a name, empty when there is none, as in Ice."""
        return self.context.get(key, "")

    def put(self, key: str, value: str) -> str:
        """Set the text of a name and return the one before, empty when there was none."""
        with self._lock:
            before = self.context
            self.context = check_context({**before, key: value})
        return before.get(key, "")

    def remove(self, key: str) -> str:
        """Take the text of a name away and return it, empty when there was none."""
        with self._lock:
            before = self.context
            self.context = {name: text for name, text in before.items() if name != key}
        return before.get(key, "")

    def merged(self, context: Mapping[str, str] | None) -> Mapping[str, str]:
        """Return the context of a call that has one of its own, or none.

        Raises MarshalException when both together are too large.
        """
        shared = self.context
        return check_context({**shared, **context}) if context else shared
