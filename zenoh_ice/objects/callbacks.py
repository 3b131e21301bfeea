"""Functions that users give to be called when something arrives: watchers are notified of what they raise."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from typing import Any, Final

failure_watchers: Final[list[Callable[[BaseException], object]]] = []
"""Called, on the thread of the callback, with what one has raised."""


def notify_of_failure(error: BaseException) -> None:
    """Notify the watchers of what a callback has raised."""
    for watcher in failure_watchers:
        watcher(error)


class CallFuture(Future[Any]):
    """The outcome of a call; watchers are notified of what its callbacks raise, which Python only logs."""

    def add_done_callback(self, fn: Callable[[Future[Any]], object]) -> None:
        """Call a function when there is an outcome, as every future does."""
        super().add_done_callback(partial(_call, fn))


def _call(callback: Callable[[Future[Any]], object], future: Future[Any]) -> None:
    try:
        callback(future)
    except BaseException as error:
        notify_of_failure(error)
        raise
