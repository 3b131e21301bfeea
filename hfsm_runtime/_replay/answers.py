"""The answers to what user code asks for in a replay: the recorded ones, or the newest values instead."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any, Final, NoReturn

from hfsm_runtime.recording_file.messages import Reading, Result

from .._recording.results import arguments_of
from ..coroutine import current_coroutine
from .comparison import Comparison
from .script import ReplayEndedError, ReplayError, Script, TimedMessage, Want, attribute_of, context_of

_MOST_GUESSES: Final = 100_000
"""Most answers without a record in one cycle: code that asks for more would not end."""
_NUMBERS: Final = frozenset({"component", "now", "rate"})
_CLOCKS: Final = {"now", "time.time", "time.monotonic", "time.perf_counter"}
_CLOCKS_NS: Final = {"time.time_ns", "time.monotonic_ns", "time.perf_counter_ns"}
_VALUES: Final = frozenset({"call", "latest", "wait", "async", "sample"})
_READ_DURATION: Final = 1000
"""ns that pass when an edited document reads a clock, so that a loop that polls it ends."""
_SECOND: Final = 1_000_000_000


class Answers:
    """Answer the requests of user code from a script.

    If the next record is the answer, it is used at once; otherwise the code waits until its replay provides
    the answer, or reports that there is none. While `own_time` in ns is set, the code was not recorded, and
    there is never an answer.
    """

    def __init__(self, script: Script) -> None:
        self.comparison = Comparison()
        self.latest = LatestValues()
        self.expected: dict[str, Callable[[TimedMessage], object]] = {}
        """The function to call when something arrives in a context."""
        self.own_time: int | None = None
        self.fatal: ReplayError | None = None
        """Why the replay cannot continue."""
        self.guesses_in_cycle = 0
        self.turns = 0
        """Number of times that code was let run, or asked for something: code that hangs adds none."""
        self._script = script

    @property
    def context(self) -> str | None:
        """The context of the code that runs here; None outside the code of the replay."""
        code = current_coroutine()
        return None if code is None else code.context

    def now(self) -> int:
        """Return the component time in ns at which the replay is."""
        return self._script.time if self.own_time is None else self.own_time

    def fetch(self, want: Want, arguments: bytes | None = None, *, park: bool = True) -> TimedMessage | None:
        """Return the recorded answer to a request of code, or None if there is none.

        With `park` it may wait until the replay has reached the answer.
        """
        code = current_coroutine()
        if code is None:
            return None
        self.turns += 1
        record = None
        if self.own_time is None:
            record = self._script.peek_input()
            if record is not None and context_of(record.message) == code.context and want.fits(record):
                self._script.advance()
            else:
                record = code.wait(want) if park else self._script.find(code.context, want)
        if record is None:
            self.guesses_in_cycle += 1
            if self.guesses_in_cycle > _MOST_GUESSES:
                self.give_up(ReplayError(f"a cycle of {code.context} does not end: it asks for {want}"))
        elif arguments is not None and isinstance(record.message, Result):
            made, shown = record.message.arguments, arguments_of(arguments)
            what = f"{want.attribute}.{want.operation}"
            self.comparison.called(self.now(), code.context, what, made, shown)
        return record

    def ask(
        self,
        kind: str,
        read: Callable[[], Any] | None = None,  # noqa: ARG002 - that is what a recording does
        waits: Callable[[], float] | None = None,
    ) -> Any:  # noqa: ANN401
        """Return a reading: the recorded one, or one that follows from the time."""
        want = Want(kind)
        record = self.fetch(want)
        if record is not None:
            assert isinstance(record.message, Reading)
            value = record.message.value
            if kind in _NUMBERS and not isinstance(value, int | float):
                self.give_up(ReplayError(f"the recorded {kind} is malformed: {value!r:.40}"))
            return value
        context = self.context
        if context is None:
            return self.now() if kind == "component" else self.now() / _SECOND
        if waits is not None:
            self.wait(waits())
        elif kind not in ("component", "future", "handover", "sleep"):
            self.latest.guesses[str(want)] += 1
        return self.latest.reading(want, context, self.now())

    def wait(self, seconds: float) -> None:
        """Let time pass for the code that runs here, where the recording does not say how it passed."""
        context = self.context
        if context is not None:
            self.latest.wait(context, seconds)

    def guess(self, want: Want) -> TimedMessage | None:
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
        if record is None or context_of(record.message) != self.context or not Want("break").fits(record):
            return False
        self._script.advance()
        return True


class LatestValues:
    """Keep the newest values of a recording, and answer requests that have no recorded answer."""

    def __init__(self) -> None:
        self.guesses: Counter[str] = Counter()
        """Number of requests without a recorded answer that got an older one, by request."""
        self._results: dict[tuple[str, str], TimedMessage] = {}
        self._readings: dict[str, tuple[float, int]] = {}
        self._passed: dict[str, int] = {}

    def learn(self, record: TimedMessage) -> None:
        """Take the value of a record."""
        message = record.message
        if isinstance(message, Result):
            if message.kind in _VALUES and message.packed is not None:
                self._results[attribute_of(record), message.operation] = record
        elif (
            isinstance(message, Reading)
            and message.kind in _CLOCKS | _CLOCKS_NS
            and isinstance(message.value, int | float)
        ):
            self._readings[message.kind] = float(message.value), record.time

    def newest(self, want: Want) -> TimedMessage | None:
        """Return the newest value that an operation had, or None."""
        return self._results.get((want.attribute, want.operation))

    def begin_cycle(self, context: str) -> None:
        """Forget how long the code of a context has waited in its cycle."""
        self._passed[context] = 0

    def wait(self, context: str, seconds: float) -> None:
        """Let time pass for the code of a context, until the end of its cycle."""
        self._passed[context] = self._passed.get(context, 0) + round(max(0.0, seconds) * _SECOND)

    def time(self, context: str, now: int) -> int:
        """Return the component time in ns as the code of a context sees it."""
        self._passed[context] = self._passed.get(context, 0) + _READ_DURATION
        return now + self._passed[context]

    def reading(self, want: Want, context: str, now: int) -> float | int | bool | str | None:
        """Return what a clock shows, or how a wait ends, at a component time in ns."""
        time = self.time(context, now)
        kind = want.kind
        if kind == "component":
            return time
        if kind in _CLOCKS or kind in _CLOCKS_NS:
            value, at = self._readings.get(kind, (0.0, 0))
            return int(value + (time - at)) if kind in _CLOCKS_NS else value + (time - at) / _SECOND
        endings: dict[str, float | bool | str] = {
            "rate": 1.0, "sleep": "done", "clock.wait": False, "future": True,
        }  # fmt: skip
        return endings.get(kind)
