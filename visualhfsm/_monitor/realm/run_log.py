"""The log of one run of a component: moments, changes of state, and numbers over time.

Memory is bounded: the oldest entries are dropped.
"""

from __future__ import annotations

import array
import bisect
import itertools
import math
import threading
import zlib
from collections import deque
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import msgspec

from hfsm_runtime.recording_file.failures import FailureLog, FailureSpan
from interfaces.hfsm import ComponentSnapshot, Mark
from visualhfsm._monitor.realm.automata import LoggedChange, StateLog, number_in
from visualhfsm._monitor.realm.robot import RobotState
from zenoh_ice.data import typed

if TYPE_CHECKING:  # it takes long to load, and is first needed when numbers are plotted
    import numpy as np
    from numpy.typing import NDArray

LARGEST_LOG: Final = 48 << 20
"""Limit of the packed moments in bytes; an hour of a component of five automata takes about half of it."""
_INTERVAL: Final = 0.05
"""Seconds of component time between two moments that are kept, unless a state changes."""
_COMPRESSION_LEVEL: Final = 1
_SAMPLE: Final = 20
"""One of this many moments is unpacked to estimate the total size."""
CAPACITY: Final = 18_000
"""Rows of numbers kept: half an hour at 10 a second."""
MOST_COLUMNS: Final = 1000
"""Limit of the numbers; later ones are left out. With all rows they take 72 MB."""
_LONGEST_TIME: Final = 1e9
"""Seconds of component time: thirty years."""
_LATEST: Final = 1e11
"""Seconds since 1970 at which a component may have been started, some thousand years."""
_MOST_AUTOMATA: Final = 10_000
_MOST_MARKS: Final = 128
_MOST_JOINTS: Final = 128
_LONGEST_LABEL: Final = 60

_NAN: Final = (math.nan,)

_encoder = msgspec.json.Encoder()


class LiveSnapshot(msgspec.Struct, frozen=True, rename="camel"):
    """A component at one moment, in the words of `interfaces/hfsm.idl`, and its robot.

    `at` is the wall time in s since the epoch at which it was received; in a recording, that of the run.
    """

    at: float
    component: ComponentSnapshot
    robot: RobotState = RobotState()


class Timeline(msgspec.Struct, frozen=True, rename="camel"):
    """Everything that is kept: its time span, and the changes of state.

    A change is [time, automaton, origin, destination, transition], a span [automaton, state, whether it was a
    ghost, start, end]. Times are the component's in s; `numbers` are the names of what can be plotted, and
    `failures` are what was made to fail.
    """

    start: float
    end: float
    changes: list[tuple[float, int, int, int, int]]
    spans: list[tuple[int, int, bool, float, float]]
    numbers: list[str]
    failures: list[FailureSpan]


class RunLog:
    """The moments of one run, the newest that fit. It may be used from any thread."""

    def __init__(self, largest: int = LARGEST_LOG, interval: float = _INTERVAL) -> None:
        self._largest = largest
        self._interval = interval
        self._lock = threading.Lock()
        self._times: deque[float] = deque()
        self._packed: deque[bytes] = deque()
        self._bytes = 0
        self._log = StateLog()
        self._failures = FailureLog()
        self._series = SeriesTable()
        self._newest: LiveSnapshot | None = None

    @property
    def newest(self) -> LiveSnapshot | None:
        """The last moment that was added."""
        return self._newest

    @property
    def duration(self) -> float:
        """Seconds of the component's time from the first moment that is kept to the last."""
        with self._lock:
            return self._times[-1] - self._times[0] if self._times else 0.0

    def changes(self, most: int | None = None) -> Sequence[LoggedChange]:
        """Return the newest changes of state, oldest first."""
        with self._lock:
            found = list(self._log.changes)
        return found if most is None else found[max(0, len(found) - most) :]

    def add(self, snapshot: LiveSnapshot) -> None:
        """Add a moment; one that is not later than the last only becomes the newest."""
        time = snapshot.component.time
        with self._lock:
            before, self._newest = self._newest, snapshot
            if before is not None and time <= before.component.time:
                return
            changed = self._log.add(snapshot.component)
            changed |= self._failures.note(snapshot.robot.failing, time)
            self._series.add(time, numbers_of(snapshot))
            if self._times and time - self._times[-1] < self._interval and not changed:
                return
            packed = zlib.compress(_encoder.encode(snapshot), _COMPRESSION_LEVEL)
            self._times.append(time)
            self._packed.append(packed)
            self._bytes += len(packed)
            while self._bytes > self._largest and len(self._packed) > 1:
                self._times.popleft()
                self._bytes -= len(self._packed.popleft())

    def at(self, time: float) -> msgspec.Raw | None:
        """Return the last moment at or before a component time as JSON, the first when all are later."""
        with self._lock:
            if not self._times:
                return None
            packed = self._packed[max(0, bisect.bisect_right(self._times, time) - 1)]
        return msgspec.Raw(zlib.decompress(packed))

    def wall_times(self) -> tuple[float, float]:
        """Return the wall times in s of the first moment that is kept, and of the newest."""
        first = self.at(0.0)
        if first is None or self._newest is None:
            return math.inf, -math.inf
        return typed.from_json(bytes(first), dict[str, Any])["at"], self._newest.at

    def moments(self, largest: int) -> list[tuple[float, bytes]]:
        """Return the moments as JSON, each with its component time.

        If all would take more than about `largest` bytes, some are left out evenly.
        """
        with self._lock:
            kept = list(zip(self._times, self._packed, strict=True))
        unpacked = sum(len(zlib.decompress(packed)) for _, packed in kept[::_SAMPLE]) * _SAMPLE
        step = max(1, math.ceil(unpacked / largest))
        return [(time, zlib.decompress(packed)) for time, packed in kept[::-step]][::-1]

    def timeline(self) -> Timeline:
        """Return the changes of state in the time that is kept."""
        with self._lock:
            start, end = (self._times[0], self._times[-1]) if self._times else (0.0, 0.0)
            return Timeline(
                start,
                end,
                [
                    (change.time, change.automaton, change.origin, change.destination, change.transition)
                    for change in self._log.changes
                    if change.time >= start
                ],
                [
                    (span.automaton, span.state, span.ghost, max(start, span.start), span.end)
                    for span in self._log.spans
                    if span.end >= start
                ],
                self._series.names,
                self._failures.spans(start),
            )

    def series(
        self, names: Sequence[str], start: float = 0.0, end: float = math.inf, points: int = CAPACITY
    ) -> dict[str, Any]:
        """Return numbers over time for a plot, `points` of them at most; None where one is missing."""
        with self._lock:
            times, values = self._series.read(names, start, end, points)
        return {"times": times, "values": values}


_MARK: Final = "mark."


def is_sound(snapshot: ComponentSnapshot) -> bool:
    """Return whether a snapshot is plausible: its times are those of a run, and its parts are not too many.

    The log is searched by time, and any process in the realm may send anything.
    """
    return (
        0.0 <= snapshot.time <= _LONGEST_TIME
        and abs(snapshot.startedAt) <= _LATEST
        and len(snapshot.automata) <= _MOST_AUTOMATA
        and len(snapshot.marks) <= _MOST_MARKS
        and all(map(_is_sound_mark, snapshot.marks))
        and len(snapshot.joints) <= _MOST_JOINTS
        and all(map(math.isfinite, (snapshot.speed, *snapshot.joints.values())))
        and all(math.isfinite(automaton.enteredAt) for automaton in snapshot.automata)
    )


def _is_sound_mark(mark: Mark) -> bool:
    short = len(mark.camera) <= _LONGEST_LABEL and len(mark.label) <= _LONGEST_LABEL
    return short and math.isfinite(mark.u) and math.isfinite(mark.v)


def numbers_of(snapshot: LiveSnapshot) -> dict[str, float]:
    """Return all numbers that can be plotted, by name.

    `4.corner` is a variable of automaton 4, `4:lastCycle` the wall seconds of its last cycle, `self.speed` a
    parameter, `joint.HeadYaw` an angle in rad, `robot.lag` and the like belong to the robot's server, and
    `images.Camera` is the rate of a camera's images. `mark.Camera/ball.u` and `.v` are the position of a
    mark.
    """
    found: dict[str, float] = {}
    for automaton in snapshot.component.automata:
        found[f"{automaton.id}:lastCycle"] = automaton.lastCycle
        found[f"{automaton.id}:overruns"] = float(automaton.overruns)
        for name, text in automaton.variables.items():
            value = number_in(text)
            if value is not None:
                found[f"{automaton.id}.{name}"] = value
    for name, text in snapshot.component.parameters.items():
        value = number_in(text)
        if value is not None:
            found[f"self.{name}"] = value
    for mark in snapshot.component.marks:
        found[f"{_MARK}{mark.camera}/{mark.label}.u"] = mark.u
        found[f"{_MARK}{mark.camera}/{mark.label}.v"] = mark.v
    robot = snapshot.robot
    found |= {f"joint.{name}": angle for name, angle in robot.joints.items()}
    if robot.health is not None:
        found["robot.realTimeFactor"] = robot.health.realTimeFactor
        found["robot.lag"] = robot.health.lag
        found["robot.torsoTilt"] = robot.health.torsoTilt
        found |= {f"images.{camera}": rate for camera, rate in robot.health.cameraRates.items()}
    return {name: value for name, value in found.items() if math.isfinite(value)}


class SeriesTable:
    """Numbers by name over time; a number that is missing at a moment is NaN. Not thread safe."""

    def __init__(self, capacity: int = CAPACITY) -> None:
        self._rows: deque[tuple[float, array.array[float]]] = deque(maxlen=capacity)
        self._places: dict[str, int] = {}
        """The index of each number in a row; rows from before it appeared are shorter."""

    @property
    def names(self) -> list[str]:
        """The names of the numbers, sorted."""
        return sorted(self._places)

    def add(self, time: float, numbers: Mapping[str, float]) -> None:
        """Append a row at a time in s that is not before the last."""
        for name in numbers.keys() - self._places.keys():
            if len(self._places) < MOST_COLUMNS:
                self._places[name] = len(self._places)
        row = array.array("f", _NAN) * len(self._places)
        for name, value in numbers.items():
            if (place := self._places.get(name)) is not None:
                row[place] = value
        self._rows.append((time, row))

    def read(
        self, names: Sequence[str], start: float, end: float, points: int
    ) -> tuple[list[float], dict[str, list[float | None]]]:
        """Return the times from `start` to `end` and the numbers at them; unknown names are left out.

        If there are more rows than `points`, at least 2, the result has those at which a number is lowest or
        highest within its interval, so that no peak is lost.
        """
        import numpy as np

        inside = [row for row in self._rows if start <= row[0] <= end]
        columns = {
            name: np.array([row[place] if place < len(row) else math.nan for _, row in inside])
            for name in names
            if (place := self._places.get(name)) is not None
        }
        kept = _thinned(list(columns.values()), len(inside), max(2, points)).tolist()
        return (
            [inside[number][0] for number in kept],
            {name: _without_nan(column[kept]) for name, column in columns.items()},
        )


def _thinned(columns: Sequence[NDArray[np.float64]], count: int, points: int) -> NDArray[np.intp]:
    """Return the selected rows, in order."""
    import numpy as np

    if count <= points or not columns:
        step = max(1, -(-count // points))
        return np.arange(0, count, step, dtype=np.intp)
    buckets = max(1, points // (2 * len(columns)))
    edges = np.linspace(0, count, buckets + 1).astype(np.intp)
    kept: set[int] = {0, count - 1}
    for first, last in itertools.pairwise(edges):
        for column in columns:
            part = column[first:last]
            if part.size and not np.isnan(part).all():
                kept |= {int(first + np.nanargmin(part)), int(first + np.nanargmax(part))}
    return np.array(sorted(kept), dtype=np.intp)


def _without_nan(values: NDArray[np.float64]) -> list[float | None]:
    return [None if value != value else value for value in values.tolist()]  # noqa: PLR0124 - NaN
