"""What user code asks of the world in a replay, and what the recording answers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any, Final, NoReturn

from hfsm_recording.messages import Reading, Result
from zenoh_ice import Sample

from ..recording.values import readable
from .comparison import Comparison
from .errors import ReplayEndedError, ReplayError
from .script import Record, Recording, Script, Want, attribute_of, context_of
from .strands import Strand, Strands

__all__ = ["Answers"]

_SECOND: Final = 1_000_000_000
_MOST_GUESSES: Final = 100_000
"""Answers without a record in one cycle: code that asks for more does not end."""
_NUMBERS: Final = frozenset({"component", "now", "rate", "age"})
_CLOCKS: Final = {"now": 1.0, "time.time": 1.0, "time.monotonic": 1.0, "time.perf_counter": 1.0}
_CLOCKS_NS: Final = {"time.time_ns", "time.monotonic_ns", "time.perf_counter_ns"}
_VALUES: Final = frozenset({"call", "latest", "wait", "async", "sample"})
_POLL: Final = 1000
"""ns that pass when an edited document reads a clock, so that a loop that waits by it comes to its end."""


class Knowledge:
    """Collect what a recording brings, and answer from it by the newest."""

    def __init__(self) -> None:
        self.guesses: Counter[str] = Counter()
        """How often what was asked for in vain, and answered by something older."""
        self._results: dict[tuple[str, str], Record] = {}
        self._readings: dict[str, tuple[float, int]] = {}
        self._passed: dict[str, int] = {}

    def learn(self, record: Record) -> None:
        """Take what was recorded."""
        message = record.message
        if isinstance(message, Result):
            if message.kind in _VALUES and message.packed is not None:
                self._results[attribute_of(record), message.operation] = record
        elif (
            isinstance(message, Reading)
            and message.kind in _CLOCKS.keys() | _CLOCKS_NS
            and isinstance(message.value, int | float)
        ):
            self._readings[message.kind] = float(message.value), record.time

    def newest(self, want: Want) -> Record | None:
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
        self._passed[context] = self._passed.get(context, 0) + _POLL
        return now + self._passed[context]

    def reading(self, want: Want, context: str, now: int) -> float | int | bool | str | None:
        """Return what a clock shows, or how a wait ends, at a component time in ns."""
        time = self.time(context, now)
        kind = want.kind
        if kind == "component":
            return time
        if kind in _CLOCKS or kind in _CLOCKS_NS:
            scale = 1.0 if kind in _CLOCKS_NS else _SECOND
            value, at = self._readings.get(kind, (0.0, 0))
            return int(value + (time - at)) if kind in _CLOCKS_NS else value + (time - at) / scale
        endings: dict[str, float | bool | str] = {
            "rate": 1.0, "sleep": "done", "clock.wait": False, "future": True,
        }  # fmt: skip
        return endings.get(kind)


class Answers:
    """Answer the code on strands from a script.

    Where the next record is the answer it is used at once; otherwise the strand waits until its driver brings
    the answer, or says that there is none. While there is an `own_time` in ns the code is none that was
    recorded, and there is never one.
    """

    def __init__(self, recording: Recording, script: Script, strands: Strands) -> None:
        self.comparison = Comparison()
        self.knowledge = Knowledge()
        self.newest_samples: dict[tuple[str, str], Sample[Any]] = {}
        """The sample that was read last, by attribute and operation."""
        self.expected: dict[str, Callable[[Record], object]] = {}
        """What is to be called when something arrives in a context."""
        self.own_time: int | None = None
        self.fatal: ReplayError | None = None
        """Why the replay cannot go on."""
        self.guesses_in_cycle = 0
        self._recording = recording
        self._script = script
        self._strands = strands

    def now(self) -> int:
        """Return the component time in ns at which the replay is."""
        return self._script.time if self.own_time is None else self.own_time

    def take(self, want: Want, arguments: tuple[object, ...] | None = None) -> Record | None:
        """Return what the recording has in answer to code that asks; None where it has nothing."""
        strand = self._strands.current
        if strand is None:
            return None
        if self.own_time is not None:
            record = None
        else:
            following = self._script.peek_input()
            fits = following is not None and context_of(following.message) == strand.context
            if fits and following is not None and want.fits(following):
                self._script.advance()
                record = following
            else:
                record = self._park(strand, want)
        if record is None:
            self.guesses_in_cycle += 1
            if self.guesses_in_cycle > _MOST_GUESSES:
                self.give_up(ReplayError(f"a cycle of {strand.context} does not end: it asks for {want}"))
        elif arguments is not None and isinstance(record.message, Result):
            message = record.message
            shown = readable(arguments)
            what = f"{want.attribute}.{want.operation}"
            self.comparison.called(self.now(), strand.context, what, message.arguments, shown)
        return record

    def ask(self, kind: str, _read: Callable[[], Any], waits: Callable[[], float] | None) -> Any:  # noqa: ANN401
        """Return a reading of a clock."""
        return self.read(kind, waits)

    def read(self, kind: str, waits: Callable[[], float] | None = None) -> Any:  # noqa: ANN401
        """Return a reading: the recorded one, or one that follows from the time."""
        want = Want(kind)
        record = self.take(want)
        if record is not None:
            assert isinstance(record.message, Reading)
            value = record.message.value
            if kind in _NUMBERS and not isinstance(value, int | float):
                self.give_up(ReplayError(f"the recorded {kind} is malformed: {value!r:.40}"))
            return value
        context = self._strands.context
        if context is None:
            return self.now() if kind == "component" else self.now() / _SECOND
        if waits is not None:
            self.knowledge.wait(context, waits())
        elif kind not in ("component", "sleep", "future"):
            self.knowledge.guesses[str(want)] += 1
        return self.knowledge.reading(want, context, self.now())

    def guess(self, want: Want) -> Record | None:
        """Return the newest value that an operation had until now."""
        self.knowledge.guesses[str(want)] += 1
        return self.knowledge.newest(want)

    def expect(self, context: str, deliver: Callable[[Record], object] | None) -> None:
        """Call a function when what belongs to a context arrives; with None, no more."""
        if deliver is None:
            self.expected.pop(context, None)
        else:
            self.expected[context] = deliver

    def image(self, hash: str) -> bytes | None:
        """Return bytes that were recorded, or None."""
        return self._recording.image(hash)

    def give_up(self, error: ReplayError) -> NoReturn:
        """End the replay from within user code, which must not catch that."""
        self.fatal = self.fatal or error
        raise ReplayEndedError

    def was_stopped(self) -> bool:
        """Return whether a breakpoint stopped the running code at this very moment."""
        record = self._script.peek_input() if self.own_time is None else None
        if record is None or context_of(record.message) != self._strands.context:
            return False
        if not Want("break").fits(record):
            return False
        self._script.advance()
        return True

    def _park(self, strand: Strand, want: Want) -> Record | None:
        answer = strand.wait(want)
        assert answer is None or isinstance(answer, Record)
        return answer
