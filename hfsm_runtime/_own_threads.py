"""Report exceptions that no cycle sees: on threads of user code, in its callbacks, and what Python drops."""

from __future__ import annotations

import sys
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import PurePath
from traceback import walk_tb
from typing import Any, Final, Protocol
from weakref import WeakSet

from zenoh_ice.data.exceptions import CommunicatorDestroyedException
from zenoh_ice.data.text import sentence
from zenoh_ice.objects.callbacks import CallFuture, failure_watchers, unseen

from .component import Component, source_of
from .errors import ComponentStoppedError, CycleCutError, describe
from .source_map import locate


class Run(Protocol):
    """The run of a component."""

    component: Component
    ended: threading.Event

    def thread_failed(self, location: str, message: str) -> None:
        """Handle an exception that has ended a thread of its code."""

    def callback_failed(self, location: str, message: str, error: BaseException) -> None:
        """Handle what a callback of its code has raised, or a call for whose outcome it does not ask."""


_ENDS: Final = ComponentStoppedError, CycleCutError, CommunicatorDestroyedException
"""Exceptions that are no errors: the component, or a cycle, ends by them, or has ended."""
_runs: Final = WeakSet[Run]()
_here: Final = threading.local()
_lock: Final = threading.Lock()
_before: Any = threading.__excepthook__
"""What is called further: it writes the traceback."""
_ignore: Any = sys.__unraisablehook__
"""The same for what Python ignores: it writes that, too."""
_ignored: Final = deque[BaseException](maxlen=1000)
"""What Python has ignored since the last cycle: raised in a finalizer, or a generator that was left."""
_ASKERS: Final = ("concurrent.futures._base", "asyncio.base_events")
"""Modules that ask for the outcomes of what they submit."""
_CALLERS: Final = ("concurrent", "threading", "zenoh_ice", "zenoh_ros2")
"""Packages that only call what failed."""
_submit: Final[Callable[..., Future[Any]]] = ThreadPoolExecutor.submit


def report_threads_of(run: Run) -> None:
    """Report, as errors of a component, exceptions of its document's code on threads and in callbacks.

    Its policy is applied. One that the end of the component ends, in `self.sleep`, is no error. So is what
    Python drops without a word, or with one that nobody reads: at the end of the next cycle.
    """
    global _before, _ignore
    with _lock:
        if all(each.ended.is_set() for each in tuple(_runs)):
            _ignored.clear()  # is of the time before
            unseen.clear()
        _runs.add(run)
        if _report_callback not in failure_watchers:
            failure_watchers.append(_report_callback)
        if threading.excepthook is not _report:
            _before, threading.excepthook = threading.excepthook, _report
        if sys.unraisablehook is not _keep_ignored:
            _ignore, sys.unraisablehook = sys.unraisablehook, _keep_ignored
        ThreadPoolExecutor.submit = _submit_watched  # type: ignore[method-assign, assignment]


def forget_threads_of(run: Run) -> None:
    """Report nothing of a run any more, which is over."""
    _runs.discard(run)


def _submit_watched(
    pool: ThreadPoolExecutor, task: Callable[..., object], /, *args: object, **named: object
) -> Future[Any]:
    """Submit a task to a pool, with a future that lets others see what nobody asks it for."""
    future = _submit(pool, task, *args, **named)
    # Who maps or awaits asks for some of the outcomes, and has heard enough by the first that failed.
    if type(future) is Future and str(sys._getframe(1).f_globals.get("__name__")) not in _ASKERS:
        future.__class__ = CallFuture
    return future


def _keep_ignored(args: Any) -> None:  # noqa: ANN401 - `sys.UnraisableHookArgs`
    """Keep what Python ignores for the next cycle: within a garbage collection, locks may be held."""
    if getattr(_here, "ignores", False):
        sys.__unraisablehook__(args)
        return
    _here.ignores = True
    try:
        if isinstance(args.exc_value, BaseException):
            _ignored.append(args.exc_value)
        _ignore(args)
    finally:
        _here.ignores = False


def report_dropped(component: Component) -> None:
    """Report what code has raised since the last cycle, and Python has dropped.

    If it was raised in the code of no component, it is of the one whose cycle ends.
    """
    while _ignored:
        error = _ignored.popleft()
        if isinstance(error, _ENDS):
            continue
        for run, place in _located(error):
            run.thread_failed(place, sentence(f"Python ignores what its code raised: {describe(error)}"))
    while unseen:
        error = unseen.popleft()
        if not isinstance(error, _ENDS):
            what = sentence(
                f"a call or a task of its code failed, which asks for no outcome: {describe(error)}"
            )
            own = [(run, _place(error)) for run in tuple(_runs) if run.component is component]
            for run, place in _located(error) or own:
                run.callback_failed(place, what, error)


def drops_anything() -> bool:
    """Return whether there is anything for `report_dropped`."""
    return bool(_ignored or unseen)


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
