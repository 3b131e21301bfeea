"""Report exceptions on threads that user code starts, and of its callbacks: no cycle sees them."""

from __future__ import annotations

import threading
from traceback import walk_tb
from typing import Any, Final, Protocol
from weakref import WeakSet

from zenoh_ice.data.text import sentence
from zenoh_ice.objects.callbacks import failure_watchers

from .component import Component, source_of
from .errors import ComponentStoppedError, CycleCutError, describe
from .source_map import locate


class Run(Protocol):
    """The run of a component."""

    component: Component

    def thread_failed(self, location: str, message: str) -> None:
        """Handle an exception that has ended a thread of its code."""

    def callback_failed(self, location: str, error: BaseException) -> None:
        """Handle what a callback of its code has raised."""


_runs: Final = WeakSet[Run]()
_here: Final = threading.local()
_lock: Final = threading.Lock()
_before: Any = threading.__excepthook__
"""What is called further: it writes the traceback."""


def report_threads_of(run: Run) -> None:
    """Report, as errors of a component, exceptions of its document's code on threads and in callbacks.

    Its policy is applied. One that the end of the component ends, in `self.sleep`, is no error.
    """
    global _before
    with _lock:
        _runs.add(run)
        if _report_callback not in failure_watchers:
            failure_watchers.append(_report_callback)
        if threading.excepthook is not _report:
            _before, threading.excepthook = threading.excepthook, _report


def _report(args: Any) -> None:  # noqa: ANN401 - `threading.ExceptHookArgs`, which has no type of its own
    error = args.exc_value
    if isinstance(error, ComponentStoppedError):
        return
    if getattr(_here, "reports", False):  # who has replaced the hook meanwhile calls it in turn
        threading.__excepthook__(args)
        return
    _here.reports = True
    try:
        if isinstance(error, BaseException):
            name = "" if args.thread is None else f" {args.thread.name}"
            for run, place in _runs_of(error):
                what = sentence(f"the thread{name}, which its code started, failed: {describe(error)}")
                run.thread_failed(place, what)
        _before(args)
    finally:
        _here.reports = False


def _report_callback(error: BaseException) -> None:
    if not isinstance(error, ComponentStoppedError | CycleCutError):
        for run, place in _runs_of(error):
            run.callback_failed(place, error)


def _runs_of(error: BaseException) -> list[tuple[Run, str]]:
    """Return the runs in whose code an exception was raised, each with the place there.

    Of several runs of one file it is that of the component which is `self` in the code, if it is known;
    otherwise it may be any of them.
    """
    places = [(run, locate(error, source_of(run.component))) for run in tuple(_runs)]
    found = [(run, place) for run, place in places if place]
    frames = (frame for frame, _ in walk_tb(error.__traceback__))
    own = {id(frame.f_locals.get("self")) for frame in frames}
    return [each for each in found if id(each[0].component) in own] or found
