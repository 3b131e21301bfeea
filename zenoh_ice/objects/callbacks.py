"""Functions that users give to be called when something arrives: watchers are notified of what they raise.

The same holds for what futures have that nobody asks: it is kept here for the watchers.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from typing import Any, Final

failure_watchers: Final[list[Callable[[BaseException], object]]] = []
"""Called, on the thread of the callback, with what one has raised."""
unseen: Final = deque[BaseException](maxlen=1000)
"""What was raised for futures that are gone, and nobody has asked; kept while there are watchers."""


def notify_of_failure(error: BaseException) -> None:
    """Notify the watchers of what a callback has raised."""
    for watcher in failure_watchers:
        watcher(error)


class CallFuture(Future[Any]):
    """The outcome of a call. What nobody asks it for is `unseen`; Python drops that without a word.

    Watchers are notified of what its callbacks raise, which Python only logs.
    """

    _is_seen = False

    def result(self, timeout: float | None = None) -> Any:  # noqa: ANN401 - of the operation
        """Return the result, or raise the exception, as every future does."""
        self._is_seen = True
        return super().result(timeout)

    def exception(self, timeout: float | None = None) -> BaseException | None:
        """Return the exception, as every future does."""
        self._is_seen = True
        return super().exception(timeout)

    def cancel(self) -> bool:
        """Give up the call, as that of every future: who does that wants no outcome."""
        self._is_seen = True
        return super().cancel()

    def __del__(self) -> None:
        # Perhaps within a garbage collection: it may take no lock that a thread has.
        if failure_watchers and not self._is_seen and self.done() and not self.cancelled():
            error = super().exception(0.0)
            if error is not None:
                unseen.append(error)

    def add_done_callback(self, fn: Callable[[Future[Any]], object]) -> None:
        """Call a function when there is an outcome, as every future does."""
        super().add_done_callback(partial(_call, fn))


def _call(callback: Callable[[Future[Any]], object], future: Future[Any]) -> None:
    try:
        callback(future)
    except BaseException as error:
        notify_of_failure(error)
        raise
