"""Report exceptions that no cycle sees: on threads of user code, in its callbacks, or only written."""

from __future__ import annotations

import sys
import threading
from collections import deque
from collections.abc import Callable
from functools import partial
from pathlib import PurePath
from traceback import walk_tb
from typing import Any, Final, Protocol
from weakref import WeakSet

from zenoh_ice.data.exceptions import CommunicatorDestroyedException
from zenoh_ice.data.text import sentence
from zenoh_ice.objects.callbacks import failure_watchers

from .component import Component, source_of
from .errors import ComponentStoppedError, CycleCutError, describe
from .places import locate


class Run(Protocol):
    """The run of a component."""

    component: Component
    ended: threading.Event

    def thread_failed(self, location: str, message: str) -> None:
        """Handle an exception that has ended a thread of its code."""

    def callback_failed(self, location: str, message: str, error: BaseException) -> None:
        """Handle what a callback of its code has raised."""


_ENDS: Final = ComponentStoppedError, CycleCutError, CommunicatorDestroyedException
"""Exceptions that are no errors: the component, or a cycle, ends by them, or has ended."""
_runs: Final = WeakSet[Run]()
_lock: Final = threading.Lock()
_ignored: Final = deque[BaseException](maxlen=1000)
"""What Python has ignored since the last cycle: raised in a finalizer, or a generator that was left."""
_CALLERS: Final = ("concurrent", "threading", "zenoh_ice", "zenoh_ros2")
"""Packages that only call what failed."""


def report_threads_of(run: Run) -> None:
    """Report, as errors of a component, exceptions of its document's code on threads and in callbacks.

    Its policy is applied. One that the end of the component ends, in `self.sleep`, is no error. So is what
    Python only writes, where nobody reads it: at the end of the next cycle.
    """
    with _lock:
        if all(each.ended.is_set() for each in tuple(_runs)):
            _ignored.clear()  # is of the time before
        _runs.add(run)
        if _report_callback not in failure_watchers:  # the first one of the process
            failure_watchers.append(_report_callback)
            threading.excepthook = partial(_report, threading.excepthook)
            sys.unraisablehook = partial(_keep_ignored, sys.unraisablehook)


def forget_threads_of(run: Run) -> None:
    """Report nothing of a run any more, which is over."""
    _runs.discard(run)


def _keep_ignored(write: Callable[[Any], object], args: Any) -> None:  # noqa: ANN401 - `sys.UnraisableHookArgs`
    """Keep what Python ignores for the next cycle: within a garbage collection, locks may be held."""
    if isinstance(args.exc_value, BaseException):
        _ignored.append(args.exc_value)
    write(args)


def report_ignored() -> None:
    """Report what code of documents has raised since the last cycle, and Python has only written."""
    while _ignored:
        error = _ignored.popleft()
        if not isinstance(error, _ENDS):
            for run, place in _located(error):
                run.thread_failed(place, sentence(f"Python ignores what its code raised: {describe(error)}"))


def _report(write: Callable[[Any], object], args: Any) -> None:  # noqa: ANN401 - `threading.ExceptHookArgs`
    error = args.exc_value
    if isinstance(error, ComponentStoppedError):
        return
    if isinstance(error, BaseException):
        name = "" if args.thread is None else f" {args.thread.name}"
        for run, place in _runs_of(error):
            what = sentence(f"the thread{name}, which its code started, failed: {describe(error)}")
            run.thread_failed(place, what)
    write(args)


def _report_callback(error: BaseException) -> None:
    if not isinstance(error, _ENDS):
        what = sentence(f"a callback of its code failed: {describe(error)}")
        for run, place in _runs_of(error):
            run.callback_failed(place, what, error)


def _runs_of(error: BaseException) -> list[tuple[Run, str]]:
    """Return the runs in whose code an exception was raised, each with the place there.

    If that is in none, as in a library that the code uses, it is the only run of this process.
    """
    found = _located(error)
    if not found:
        going = [run for run in tuple(_runs) if not run.ended.is_set()]
        found = [(run, _place(error)) for run in going if len(going) == 1]
    return found


def _place(error: BaseException) -> str:
    """Return where a library raised an exception, as `reader.py:7`; empty if only what called it is known."""
    frames = [
        (each.f_globals.get("__name__"), each.f_code, line) for each, line in walk_tb(error.__traceback__)
    ]
    names = (
        f"{PurePath(code.co_filename).name}:{line}"
        for module, code, line in reversed(frames)
        if str(module).partition(".")[0] not in _CALLERS
    )
    return next(names, "")


def _located(error: BaseException) -> list[tuple[Run, str]]:
    """Return the runs in whose code an exception was raised, each with the place there.

    Of several runs of one file it is that of the component which is `self` in the code, if it is known;
    otherwise it may be any of them.
    """
    places = [(run, locate(error, source_of(run.component))) for run in tuple(_runs)]
    found = [(run, place) for run, place in places if place]
    frames = (frame for frame, _ in walk_tb(error.__traceback__))
    own = {id(frame.f_locals.get("self")) for frame in frames}
    return [each for each in found if id(each[0].component) in own] or found
