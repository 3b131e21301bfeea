"""Find what runs in the tests' process, who started it, and what tests leave behind."""

from __future__ import annotations

import os
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeAlias
from weakref import WeakKeyDictionary

import psutil
import pytest
import zenoh

from tests.support.limits import END_LIMIT

__all__ = ["Leaks", "watched_leaks"]

_THREADS: Final = "/proc/self/task"
_LISTED: Final = Path(_THREADS, str(os.getpid()), "children").exists()


@dataclass(frozen=True)
class Origin:
    """Who started a thread, a child process or a Zenoh session, and during which test."""

    thread: threading.Thread
    test: str


@dataclass(frozen=True, eq=False)
class Opened:
    """A Zenoh session."""

    session: zenoh.Session
    origin: Origin


Thing: TypeAlias = threading.Thread | psutil.Process | Opened


class Leaks:
    """Find what the tests within a scope leave behind: threads, child processes and Zenoh sessions.

    Things older than a test may start others during it: a pool grows, a communicator's first call needs a thread
    for its replies. These belong to the older thing, and the wider scope checks that they end with it.
    """

    def __init__(self) -> None:
        self._tester: Final = threading.current_thread()
        self._threads: Final[WeakKeyDictionary[threading.Thread, Origin]] = WeakKeyDictionary()
        self._processes: Final[dict[int, Origin]] = {}
        # Zenoh is not asked which are closed: it would hold the interpreter while it waits for a session's lock,
        # and its other threads hold that lock while they wait for the interpreter, to call a function.
        self._sessions: Final[dict[zenoh.Session, Opened]] = {}
        self._reported: Final[set[Thing]] = set()

    def origin(self) -> Origin:
        """Return the origin for anything that the current thread starts."""
        return Origin(threading.current_thread(), os.environ.get("PYTEST_CURRENT_TEST", "").partition(" ")[0])

    def thread_starts(self, thread: threading.Thread) -> None:
        """Record who starts a thread."""
        self._threads[thread] = self.origin()

    def process_started(self, pid: int) -> None:
        """Record who started a child process."""
        self._processes[pid] = self.origin()

    def session_opened(self, session: zenoh.Session) -> None:
        """Record who opened a Zenoh session."""
        self._sessions[session] = Opened(session, self.origin())

    def session_closes(self, session: zenoh.Session) -> None:
        """Forget a Zenoh session."""
        self._sessions.pop(session, None)

    @contextmanager
    def check(self, scope: str, limit: float = END_LIMIT) -> Iterator[None]:
        """Fail if something that was started within the block has not ended `limit` s after it."""
        before = self._running()
        yield
        deadline = time.monotonic() + limit
        while (left := self._left_since(before)) and time.monotonic() < deadline:
            time.sleep(0.01)
        self._reported.update(left)
        assert not left, f"{scope} left behind {', '.join(sorted(map(self._describe, left)))}"

    def _left_since(self, before: set[Thing]) -> list[Thing]:
        new = self._running() - before - self._reported
        return [thing for thing in new if not self._may_be_older(thing, before)]

    def _running(self) -> set[Thing]:
        threads = (
            thread for thread in threading.enumerate() if not isinstance(thread, threading._DummyThread)
        )
        sessions = tuple(self._sessions.values())  # other threads open and close some
        return {*threads, *_children(), *sessions}

    def _may_be_older(self, thing: Thing, before: set[Thing]) -> bool:
        """Return whether something from before may have started this, and will end it."""
        origin = self._origin_of(thing)
        while origin is not None and origin.thread is not self._tester:
            if origin.thread in before:
                return True
            origin = self._threads.get(origin.thread)
        # A communicator starts threads for its caller: only those left at its end count.
        return isinstance(thing, threading.Thread) and any(
            isinstance(older, Opened) for older in before - self._reported
        )

    def _origin_of(self, thing: Thing) -> Origin | None:
        match thing:
            case Opened():
                return thing.origin
            case psutil.Process():
                return self._processes.get(thing.pid)
            case _:
                return self._threads.get(thing)

    def _describe(self, thing: Thing) -> str:
        match thing:
            case Opened():
                what = f"the Zenoh session {thing.session.zid()}"
            case psutil.Process():
                what = f"the process {_command(thing)!r}"
            case _:
                what = f"the thread {thing.name!r}"
        origin = self._origin_of(thing)
        return f"{what} of {origin.test}" if origin is not None else what


def _children() -> Iterator[psutil.Process]:
    with suppress(ChildProcessError):
        # Raises at once if there are none.
        os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)
        for child in _listed_children() if _LISTED else psutil.Process().children():
            with suppress(psutil.NoSuchProcess):
                if child.status() != psutil.STATUS_ZOMBIE:
                    yield child


def _listed_children() -> Iterator[psutil.Process]:
    """Yield the children as Linux lists them for each thread; psutil reads all processes of the machine."""
    for thread in os.scandir(_THREADS):
        with suppress(FileNotFoundError, ProcessLookupError):  # the thread has ended
            for pid in Path(thread.path, "children").read_text().split():
                with suppress(psutil.NoSuchProcess):
                    yield psutil.Process(int(pid))


def _command(process: psutil.Process) -> str:
    try:
        return " ".join(process.cmdline()) or str(process.name())
    except psutil.NoSuchProcess:
        return f"of number {process.pid}, which has ended now"


@contextmanager
def watched_leaks() -> Iterator[Leaks]:
    """Watch who starts threads, child processes and Zenoh sessions."""
    leaks = Leaks()
    start, popen = threading.Thread.start, subprocess.Popen.__init__
    opens, close = zenoh.open, zenoh.Session.close

    def watched_start(thread: threading.Thread) -> None:
        leaks.thread_starts(thread)
        start(thread)

    def watched_popen(process: subprocess.Popen[Any], *args: Any, **kwargs: Any) -> None:
        popen(process, *args, **kwargs)
        leaks.process_started(process.pid)

    def watched_open(*args: Any, **kwargs: Any) -> zenoh.Session:
        session = opens(*args, **kwargs)
        leaks.session_opened(session)
        return session

    def watched_close(session: zenoh.Session) -> None:
        leaks.session_closes(session)
        close(session)

    def watched_exit(session: zenoh.Session, *_: object) -> None:
        watched_close(session)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(threading.Thread, "start", watched_start)
        patch.setattr(subprocess.Popen, "__init__", watched_popen)
        patch.setattr(zenoh, "open", watched_open)
        patch.setattr(zenoh.Session, "close", watched_close)
        patch.setattr(zenoh.Session, "__exit__", watched_exit)
        yield leaks
