"""What happens to open documents, and the listeners that are notified."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass
from itertools import count
from typing import TYPE_CHECKING, Literal

from codegen.messages import NO_MESSAGE, Message
from visualhfsm._document.problems import Findings

from ._version import Version

if TYPE_CHECKING:
    from ._document import OpenDocument

_logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Opened:
    """A document was opened."""

    document: OpenDocument


@dataclass(frozen=True, slots=True)
class Changed:
    """A document has another version: it was changed, saved, or its file was."""

    document: OpenDocument
    version: Version


@dataclass(frozen=True, slots=True)
class FileChanged:
    """Another program has changed the file of a document.

    `reloaded`: the document had no unsaved changes, and is now as the file, which can be undone. `changed`
    and `deleted`: somebody has to choose how to `resolve` it; `message` says why the file cannot be read.
    `same`: the file is again as it was.
    """

    document: OpenDocument
    state: Literal["reloaded", "changed", "deleted", "same"]
    message: Message = NO_MESSAGE


@dataclass(frozen=True, slots=True)
class Checked:
    """A version of a document was checked."""

    document: OpenDocument
    version: Version
    findings: Findings


@dataclass(frozen=True, slots=True)
class Closed:
    """A document was closed."""

    document: OpenDocument


Event = Opened | Changed | FileChanged | Checked | Closed

Listener = Callable[[Event], None]
"""Called in the thread that made the change, one event of a document at a time and in their order.

The document is locked meanwhile: a listener returns soon, changes no document, and waits for no other thread
that uses one. What it raises is logged.
"""


class Listeners:
    """The listeners of a document or a project; thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._listeners: dict[int, Listener] = {}
        self._numbers = count()

    def subscribe(self, listener: Listener) -> Callable[[], None]:
        """Notify a listener of every event from now on; return the function that ends this."""
        with self._lock:
            number = next(self._numbers)
            self._listeners[number] = listener

        def unsubscribe() -> None:
            with self._lock:
                self._listeners.pop(number, None)

        return unsubscribe

    def notify(self, event: Event) -> None:
        """Notify all listeners of an event."""
        with self._lock:
            listeners = [*self._listeners.values()]
        for listener in listeners:
            try:
                listener(event)
            except Exception:  # what a listener does wrong must not undo the change
                _logger.exception("a listener failed with the event %s", type(event).__name__)
