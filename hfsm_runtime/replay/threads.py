"""Threads that run the user code of a replay one at a time, and their answers from the recording."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, Final, NoReturn

from hfsm_runtime.recording_file.messages import Reading, Result

from ..recording.results import arguments_of
from .comparison import Comparison
from .script import LatestValues, Record, ReplayEndedError, ReplayError, Script, Want, context_of

_PATIENCE: Final = 30.0
"""Wall seconds that a piece of user code may take until it asks for something recorded, or ends."""
_CLOSE: Final = 2.0
_MOST: Final = 10_000
"""Most threads at the same time."""
_MOST_GUESSES: Final = 100_000
"""Most answers without a record in one cycle: code that asks for more would not end."""
_NUMBERS: Final = frozenset({"component", "now", "rate"})
_SECOND: Final = 1_000_000_000


class ReplayThread:
    """The code of one context. It runs only during `run` and `resume`, which return when it waits or ends."""

    def __init__(self, context: str, here: threading.local) -> None:
        self.context: Final = context
        self.want: Want | None = None
        """What the code waits for; None while it runs, and after its end."""
        self.failure: BaseException | None = None
        """The exception that ended the code, if any."""
        self._here = here
        self._answer: Record | None = None
        self._function: Callable[[], object] | None = None
        self._go = threading.Semaphore(0)
        self._back = threading.Semaphore(0)
        self._closing = False
        self._thread = threading.Thread(target=self._run, name=f"replay of {context}", daemon=True)

    @property
    def idle(self) -> bool:
        """Whether no code waits here."""
        return self.want is None

    def run(self, function: Callable[[], object]) -> None:
        """Run a piece of code until it waits or ends."""
        assert self.idle, f"{self.context} still waits"
        self._function, self.failure = function, None
        if self._thread.ident is None:
            self._thread.start()
        self._switch()

    def resume(self, answer: Record | None) -> None:
        """Give the code what it waits for, and let it run until it waits again or ends."""
        self.want, self._answer = None, answer
        self._switch()

    def wait(self, want: Want) -> Record | None:
        """Wait for the answer from `resume`; called by the code."""
        self.want = want
        if not self._closing:
            self._back.release()
            self._go.acquire()
        if self._closing:
            raise ReplayEndedError
        answer, self._answer = self._answer, None
        return answer

    def close(self) -> None:
        """End the thread."""
        self._closing = True
        self.want = None
        if self._thread.ident is not None:
            self._go.release(2)  # one for code that waits
            self._thread.join(_CLOSE)

    def _switch(self) -> None:
        self._go.release()
        if not self._back.acquire(timeout=_PATIENCE):
            raise ReplayError(
                f"the code of {self.context} neither ends nor reads anything recorded within {_PATIENCE:g} s"
            )

    def _run(self) -> None:
        self._here.thread = self
        while self._go.acquire() and not self._closing:
            try:
                assert self._function is not None
                self._function()
            except ReplayEndedError:
                pass  # either the replay is over, or the driver knows why
            except BaseException as error:  # noqa: BLE001 - the driver reports it
                self.failure = error
            self._back.release()


class ReplayThreads(dict[str, ReplayThread]):
    """The threads of a replay, by context, made when they are needed."""

    def __init__(self) -> None:
        super().__init__()
        self._here = threading.local()

    @property
    def current(self) -> ReplayThread | None:
        """The calling thread; None on one that does not belong to the replay."""
        found: ReplayThread | None = getattr(self._here, "thread", None)
        return found

    @property
    def context(self) -> str | None:
        """The context of the code that this thread runs."""
        thread = self.current
        return thread.context if thread else None

    def __missing__(self, context: str) -> ReplayThread:
        if len(self) >= _MOST:
            raise ReplayError(f"the recording has the code of more than {_MOST} contexts at a time")
        self[context] = thread = ReplayThread(context, self._here)
        return thread

    def close(self) -> None:
        """End all threads."""
        for thread in self.values():
            thread.close()


class Answers:
    """Answer the requests of user code from a script.

    If the next record is the answer, it is used at once; otherwise the thread waits until its driver provides
    the answer, or reports that there is none. While `own_time` in ns is set, the code was not recorded, and
    there is never an answer.
    """

    def __init__(self, script: Script, threads: ReplayThreads) -> None:
        self.comparison = Comparison()
        self.latest = LatestValues()
        self.expected: dict[str, Callable[[Record], object]] = {}
        """The function to call when something arrives in a context."""
        self.own_time: int | None = None
        self.fatal: ReplayError | None = None
        """Why the replay cannot continue."""
        self.guesses_in_cycle = 0
        self._script = script
        self._threads = threads

    @property
    def context(self) -> str | None:
        """The context of the code that this thread runs."""
        return self._threads.context

    def now(self) -> int:
        """Return the component time in ns at which the replay is."""
        return self._script.time if self.own_time is None else self.own_time

    def take(self, want: Want, arguments: bytes | None = None, *, park: bool = True) -> Record | None:
        """Return the recorded answer to a request of code, or None if there is none.

        With `park` it may wait until the replay has reached the answer.
        """
        thread = self._threads.current
        if thread is None:
            return None
        record = None
        if self.own_time is None:
            record = self._script.peek_input()
            fits = record is not None and context_of(record.message) == thread.context
            if fits and record is not None and want.fits(record):
                self._script.advance()
            else:
                record = thread.wait(want) if park else self._script.find(thread.context, want)
        if record is None:
            self.guesses_in_cycle += 1
            if self.guesses_in_cycle > _MOST_GUESSES:
                self.give_up(ReplayError(f"a cycle of {thread.context} does not end: it asks for {want}"))
        elif arguments is not None and isinstance(record.message, Result):
            made, shown = record.message.arguments, arguments_of(arguments)
            what = f"{want.attribute}.{want.operation}"
            self.comparison.called(self.now(), thread.context, what, made, shown)
        return record

    def ask(
        self,
        kind: str,
        read: Callable[[], Any] | None = None,  # noqa: ARG002 - that is what a recording does
        waits: Callable[[], float] | None = None,
    ) -> Any:  # noqa: ANN401
        """Return a reading: the recorded one, or one that follows from the time."""
        want = Want(kind)
        record = self.take(want)
        if record is not None:
            assert isinstance(record.message, Reading)
            value = record.message.value
            if kind in _NUMBERS and not isinstance(value, int | float):
                self.give_up(ReplayError(f"the recorded {kind} is malformed: {value!r:.40}"))
            return value
        context = self._threads.context
        if context is None:
            return self.now() if kind == "component" else self.now() / _SECOND
        if waits is not None:
            self.wait(waits())
        elif kind not in ("component", "sleep", "future"):
            self.latest.guesses[str(want)] += 1
        return self.latest.reading(want, context, self.now())

    def wait(self, seconds: float) -> None:
        """Let time pass for the code on this thread, where the recording does not say how it passed."""
        if self._threads.context is not None:
            self.latest.wait(self._threads.context, seconds)

    def guess(self, want: Want) -> Record | None:
        """Return the newest value that an operation had until now."""
        self.latest.guesses[str(want)] += 1
        return self.latest.newest(want)

    def give_up(self, error: ReplayError) -> NoReturn:
        """End the replay from within user code, which must not catch that."""
        self.fatal = self.fatal or error
        raise ReplayEndedError

    def was_stopped(self) -> bool:
        """Return whether a breakpoint stopped the running code at this very moment."""
        record = self._script.peek_input() if self.own_time is None else None
        if record is None or context_of(record.message) != self._threads.context:
            return False
        if not Want("break").fits(record):
            return False
        self._script.advance()
        return True
