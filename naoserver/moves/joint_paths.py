"""Paths of joints: curves of their angles over time, and what moves joints along them.

The robot's control loop takes the steps, or the jobs of a server whose robot has none, so that no late thread
comes in between. A path claims no joints: an activity that does, such as the walk or a motion, ends it.
"""

from __future__ import annotations

import threading
from bisect import bisect_right
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from itertools import count, pairwise
from typing import Final

from interfaces.nao import Severity
from naoserver.errors import CommandRefused, InvalidCommand
from naoserver.safety._guarded_device import GuardedDevice
from naoserver.safety._limits import clamp
from zenoh_ice import Clock
from zenoh_ice.data.text import sentence, text_of

PERIOD: Final = 0.02
"""Robot seconds between two setpoints."""
_BISECTIONS: Final = 30
_EXACT: Final = 1e-12  # s
_SETTLING_LIMIT: Final = 3.0
"""Robot seconds for joints to arrive after the end of a curve that was too fast for them."""
_REACHED: Final = 1e-6  # rad
_RESOLUTION: Final = 1e-6
"""Seconds by which the end of a curve may be early."""
_CHECK_PERIOD: Final = 0.1
"""Wall seconds between two checks whether a path that waits for joints was stopped."""


def check_times(joint: str, times: Sequence[float], keys: int) -> None:
    """Raise InvalidCommand unless there are `keys` times, above 0 and increasing."""
    if len(times) != keys or not times:
        raise InvalidCommand(joint, f"{joint}: there are {len(times)} times for {keys} keys")
    if times[0] <= 0.0 or any(later <= time for time, later in pairwise(times)):
        raise InvalidCommand(joint, f"{joint}: the times must be above 0 and increase, not {list(times)}")


@dataclass(frozen=True, slots=True)
class Key:
    """A key of a curve, and its handles: each a time in s and an angle in rad relative to the key."""

    time: float
    angle: float
    before: tuple[float, float] = (0.0, 0.0)
    after: tuple[float, float] = (0.0, 0.0)


class Curve:
    """An angle in rad for each time in s: cubic Bezier curves from key to key."""

    def __init__(self, joint: str, start: Key, keys: Sequence[Key]) -> None:
        """Begin at `start`, at time 0. Raises InvalidCommand unless the times of the keys increase."""
        check_times(joint, [key.time for key in keys], len(keys))
        self._keys = (start, *keys)
        self._times = [key.time for key in self._keys]
        self.duration: Final = self._times[-1]
        """When the last key is reached in s."""

    def at(self, time: float) -> float:
        """Return the angle at a time; before the start the first angle, after the end the last."""
        time = clamp(time, 0.0, self.duration)
        i = bisect_right(self._times, time, hi=len(self._times) - 1) - 1
        begin, end = self._keys[i], self._keys[i + 1]
        span, time = end.time - begin.time, time - begin.time
        # Handles end within the piece, so that the time along the curve never runs backwards.
        handles = min(max(begin.after[0], 0.0), span), span + max(min(end.before[0], 0.0), -span)
        times = (0.0, *handles, span)
        low = 0.0
        high = 1.0
        s = time / span  # with handles of a third of the span, the first guess is exact
        for _ in range(_BISECTIONS):
            late = _bernstein(times, s) - time
            if abs(late) < _EXACT:
                break
            low, high = (s, high) if late < 0.0 else (low, s)
            s = (low + high) / 2
        return _bernstein(
            (begin.angle, begin.angle + begin.after[1], end.angle + end.before[1], end.angle), s
        )


def smooth_curve(joint: str, start: float, times: Sequence[float], angles: Sequence[float]) -> Curve:
    """Return the curve through keys, at rest at both ends, that never overshoots a key.

    The slope at an inner key is the harmonic mean of the slopes on both sides, 0 where the angle turns back:
    Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984). Raises InvalidCommand unless the times increase,
    one for each angle.
    """
    check_times(joint, times, len(angles))
    spans = [later - time for time, later in pairwise((0.0, *times))]
    ways = pairwise((start, *angles))
    rises = [(after - before) / span for (before, after), span in zip(ways, spans, strict=True)]
    inner = [
        2.0 * before * after / (before + after) if before * after > 0.0 else 0.0
        for before, after in pairwise(rises)
    ]
    keys = [
        Key(time, angle, (-before / 3, -slope * before / 3), (after / 3, slope * after / 3))
        for time, angle, slope, before, after in zip(
            times, angles, (*inner, 0.0), spans, (*spans[1:], 0.0), strict=True
        )
    ]
    return Curve(joint, Key(0.0, start, after=(spans[0] / 3, 0.0)), keys)


def _bernstein(values: tuple[float, float, float, float], s: float) -> float:
    begin, after, before, end = values
    r = 1.0 - s
    return r * r * r * begin + 3.0 * r * s * (r * after + s * before) + s * s * s * end


@dataclass(eq=False)
class Path:
    """Joints that a client moves along curves, or that it waits for."""

    name: str
    joints: frozenset[str]
    client: str
    stopped: threading.Event = field(default_factory=threading.Event)
    """Set when it is to end."""
    may_step: Callable[[], AbstractContextManager[bool]] = lambda: nullcontext(True)
    """Return the context of a step, which gets whether it may be taken: where stops wait for steps."""
    moves: Callable[[Iterable[str]], object] = lambda _joints: None
    """Called with the joints that were sent on."""
    ended: threading.Event = field(default_factory=threading.Event, init=False)
    """Set at its end."""
    error: BaseException | None = field(default=None, init=False)
    """What ended it early."""
    number: int = field(default=0, init=False)
    """Its number among all paths of the robot."""
    _stops: int = field(default=0, init=False)  # of the robot before it
    _reported: bool = field(default=False, init=False)  # whether its error is an event
    _curves: Mapping[str, Curve] = field(default_factory=dict, init=False)
    _begin: float = field(default=0.0, init=False)
    # Times of the newest setpoints, and at which those of the end were sent.
    _sent: float = field(default=0.0, init=False)
    _done: float = field(default=0.0, init=False)


class JointPaths:
    """Move the joints of a body along curves; `tick` is due every PERIOD of robot time while it is `busy`.

    A path moves those of its joints that no later command has taken from it. `on_begin` is called when one
    begins. Thread-safe.
    """

    def __init__(self, body: GuardedDevice, clock: Clock, on_begin: Callable[[], None]) -> None:
        self._body = body
        self._clock = clock
        self._on_begin = on_begin
        self._changed = threading.Condition()
        self._paths: list[Path] = []
        self._owners: dict[str, Path] = {}  # by joint
        self._numbers = count(1)

    @property
    def busy(self) -> bool:
        """Whether a path moves joints, or waits for them."""
        return bool(self._paths)

    def all(self) -> list[Path]:
        """Return the paths that move joints or wait for them."""
        with self._changed:
            return list(self._paths)

    def release(self, joints: Iterable[str]) -> None:
        """Remove joints from the paths that move them, which continue with the others."""
        with self._changed:
            for joint in joints:
                self._owners.pop(joint, None)

    def follow(self, path: Path, curves: Callable[[], Mapping[str, Curve]]) -> None:
        """Move joints along curves, asked for once no other path moves them; return at the end.

        Raises InvalidCommand and CommandRefused as `GuardedDevice.move` does, the latter also when an
        emergency stop has ended it.
        """
        path._stops = self._body.gate.stops
        try:
            with self._changed:
                self._add(path)
                while not path.stopped.is_set() and not self._owners.keys().isdisjoint(path.joints):
                    self._changed.wait(_CHECK_PERIOD)
                if path.stopped.is_set():  # it takes no joints
                    return
                self._owners.update(dict.fromkeys(path.joints, path))
            found = curves()
            self._body.gate.require(path.client)  # even when nothing is left to move
            self._begin(path, found)
            while not self._clock.wait(path.ended, PERIOD) and not path.stopped.is_set():
                pass
        finally:
            self._end(path)
        if path.error is not None:
            raise path.error
        if path.stopped.is_set():
            self._body.gate.require(path.client, begun=True)

    def start(self, path: Path, curves: Mapping[str, Curve]) -> None:
        """Begin to move joints along curves, in place of what else moves them along some; return at once.

        An error on the way is reported as an event. Raises InvalidCommand or CommandRefused.
        """
        path._stops = self._body.gate.stops
        self._body.gate.require(path.client)
        self._body.claims.check(path.joints)
        with self._changed:
            for other in self.all():
                if other._reported and other.joints <= path.joints:
                    # At once: nobody waits, and many may be begun while the time stands still.
                    self._end(other)
            self._add(path)
            self._owners.update(dict.fromkeys(path.joints, path))
        path._reported = True
        self._begin(path, curves)

    def stop(self, client: str | None = None) -> None:
        """End every path, or those of a client; joints stay at their newest setpoints."""
        for path in self.all():
            if client in {None, path.client}:
                path.stopped.set()

    def tick(self) -> None:
        """Take the next step of every path."""
        for path in self.all():
            try:
                goes_on = not path._curves or self._step(path)
            except (Exception, SystemExit) as error:  # noqa: BLE001 - of a driver; who waits for it raises it
                path.error, goes_on, what = error, False, path.name
                if path._reported:
                    text = sentence(f"{what} ended: {text_of(error)}")
                    self._body.events.add(Severity.Warning, self._body.name, text, "failed")
            if not goes_on:
                self._end(path)

    def _add(self, path: Path) -> None:
        path.number = next(self._numbers)
        self._paths.append(path)

    def _begin(self, path: Path, curves: Mapping[str, Curve]) -> None:
        path._begin = self._clock.now()
        path._curves = curves
        self._on_begin()

    def _end(self, path: Path) -> None:
        with self._changed:
            if path in self._paths:
                self._paths.remove(path)
            for joint in self._own(path, path.joints):
                del self._owners[joint]
            self._changed.notify_all()
        path.ended.set()

    def _own(self, path: Path, joints: Iterable[str]) -> list[str]:
        """Return the joints that no other command has taken from a path."""
        with self._changed:
            return [joint for joint in joints if self._owners.get(joint) is path]

    def _step(self, path: Path) -> bool:
        """Send the setpoints to where they are to be now; return whether the path continues."""
        if path.stopped.is_set():
            return False
        if path._stops != self._body.gate.stops:
            self._body.gate.require(path.client, begun=True)  # which says why it is stopped, if it still is
            raise CommandRefused("the robot was stopped")
        curves, time = path._curves, self._clock.now() - path._begin
        end = max(each.duration for each in curves.values())
        if time < end - _RESOLUTION or path._sent < end:  # those of the end, however late this is
            path._sent, path._done = min(time + PERIOD, end), time
            with path.may_step() as may:  # no step follows a stop
                if may:
                    self._move(path, path._sent)
            return True
        # Wait until the setpoints have arrived; full speed where they are late.
        late = any(map(self._late, self._own(path, curves)))
        return time < max(end, path._done) + _SETTLING_LIMIT and late

    def _move(self, path: Path, time: float) -> None:
        """Send the setpoints to their angles at a time one period from now."""
        setpoints = self._body.angles(measured=False)
        targets, speeds = {}, {}
        for joint in self._own(path, path._curves):
            curve = path._curves[joint]
            target = curve.at(time)
            if target == setpoints[joint]:
                continue
            speed, cap = abs(target - setpoints[joint]) / PERIOD, self._body.speed_cap(joint)
            if abs(target - curve.at(time - PERIOD)) <= cap * PERIOD:
                speed = min(speed, cap)  # catching up is no reason for a warning
            targets[joint], speeds[joint] = target, speed
        if targets:
            self._body.move(targets, speeds, client=path.client)
            path.moves(targets)

    def _late(self, joint: str) -> bool:
        """Return whether a setpoint still has to reach its goal; that of a limp motor never does."""
        reading, index = self._body.read(), self._body.index(joint)
        way = reading.commands[index] - self._body.goal(joint).target
        return reading.stiffnesses[index] > 0.0 and abs(way) > _REACHED
