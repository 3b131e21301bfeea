"""The walk, on legs or on wheels, behind its safety layer, the only way to command it; and walks to a place.

A way leads to a place on the floor, as the velocity from where the robot is; on it, that velocity is renewed
through the guard until the robot arrives.
"""

from __future__ import annotations

import cmath
import math
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from typing import Final

from msgspec.structs import replace

from interfaces.nao import ActionState, ActionStatus, Severity
from naoserver.bodies.capabilities import STILL, Odometry, Walker, WalkVelocity
from naoserver.errors import InvalidCommand, RobotError
from naoserver.options import SafetyOptions
from naoserver.safety._guarded_device import GuardedDevice
from zenoh_ice.data.text import few, printable, sentence

_GAIN: Final = 1.5
"""Ratio of the velocity to the rest of the way, in 1/s."""
_CAUTION: Final = 0.6
"""The same times the lag of the robot: with more, it would go beyond the place."""
_PLACE_TOLERANCE: Final = 0.02
"""Distance in m, and in rad / 2, within which a place counts as reached."""
_LEAST_TURN: Final = 0.2
"""Velocity in rad/s below which a turn may come to nothing: the backlash of the legs swallows it."""
_LEAVING: Final = 3.0 * _PLACE_TOLERANCE
"""Distance in m at which a robot that has reached the place, and turns there, counts as off it again."""
_AHEAD: Final = 0.3
"""Angle in rad to the place within which a robot that cannot go sideways drives towards it."""
_EVEN: Final = 1e-6
"""Angle in rad by which driving backwards must save turning."""
_PASSED: Final = 0.1
"""Distance in m within which such a robot that has passed the place returns without turning round."""
_SPARE_TIME: Final = 10.0
"""Robot seconds that a way may take in addition to three times its duration at full speed."""

Place = tuple[float, float, float]
"""x and y in m and a heading in rad, relative to the robot's place at the start."""


def way_to(place: Place, start: Odometry, highest: WalkVelocity, lag: float = 0.0) -> Way:
    """Return the way to a place from the robot's place at `start`, at most at the velocities `highest`.

    A robot whose velocity lags behind commands, by `lag` in s, slows down earlier.

    Raises InvalidCommand for a robot that cannot get to every place: one that cannot turn, or only turns.
    """
    if not (highest.forward and highest.turn):
        what = sentence("turn") if highest.forward else sentence("drive forwards")
        raise InvalidCommand("walk", f"the robot cannot {what}, so it cannot go to a place")
    kind = Way if highest.left else SteeredWay
    return kind(place, start, highest, lag)


class Way:
    """The way to a place: the velocities on it, asked for again and again until the robot is there.

    It is straight, of a robot that goes in every direction, which turns to the heading first.
    """

    def __init__(self, place: Place, start: Odometry, highest: WalkVelocity, lag: float) -> None:
        x, y, heading = place
        self._gain = min(_GAIN, _CAUTION / lag) if lag else _GAIN
        # In the plane, x + iy.
        self._goal = complex(start.x, start.y) + cmath.rect(1.0, start.heading) * complex(x, y)
        self._heading = start.heading + heading
        self._highest = highest
        self._length = self._left(complex(x, y), heading)
        self.patience: Final = _SPARE_TIME + 3.0 * self._duration(complex(x, y), heading)
        """Robot seconds that it may take."""

    def progress(self, now: Odometry) -> float:
        """Return the completed fraction of the way."""
        left = self._left(*self._rest(now))
        return max(1.0 - left / max(self._length, _PLACE_TOLERANCE), 0.0)

    def _rest(self, now: Odometry) -> tuple[complex, float]:
        """Return the place and the turn to its heading in the robot's frame."""
        way = (self._goal - complex(now.x, now.y)) * cmath.rect(1.0, -now.heading)
        return way, math.remainder(self._heading - now.heading, math.tau)

    def velocity(self, now: Odometry) -> WalkVelocity:
        """Return the velocity for the rest of the way, within the limits of each; all 0 at its end."""
        way, turn = self._rest(now)
        if abs(way) < _PLACE_TOLERANCE and abs(turn) < 2 * _PLACE_TOLERANCE:
            return STILL
        highest = self._highest
        turning = min(max(self._gain * turn, -highest.turn), highest.turn)
        if abs(turn) > 2 * _PLACE_TOLERANCE:
            turning = math.copysign(max(abs(turning), min(_LEAST_TURN, highest.turn)), turn)
        # Legs do not turn and go at full speed together. It turns first: sideways it is slow.
        share = 1.0 - abs(turning) / highest.turn
        parts = (way.real, highest.forward), (way.imag, highest.left)
        gain = min((self._gain, *(share * limit / abs(part) for part, limit in parts if part)))
        forward, left = (min(max(gain * part, -limit), limit) for part, limit in parts)
        return WalkVelocity(forward, left, turning)

    def _left(self, way: complex, turn: float) -> float:
        """Return the m and rad that are left together, given the place and the turn in the robot's frame."""
        return abs(way) + abs(turn)

    def _duration(self, way: complex, turn: float) -> float:
        """Return the seconds of the way at full speed."""
        highest = self._highest
        straight = math.hypot(way.real / highest.forward, way.imag / highest.left)
        return straight + abs(turn) / highest.turn


class SteeredWay(Way):
    """The way of a robot that cannot go sideways: it turns to the place, drives there, and turns again.

    It drives backwards where that takes less turning.
    """

    def __init__(self, place: Place, start: Odometry, highest: WalkVelocity, lag: float) -> None:
        super().__init__(place, start, highest, lag)
        way, turn = self._rest(start)
        self._side = 1.0 if _turning(way, turn) <= _turning(-way, turn) + _EVEN else -1.0  # -1: backwards
        self._there = abs(way) < _PLACE_TOLERANCE

    def velocity(self, now: Odometry) -> WalkVelocity:
        way, turn = self._rest(now)
        self._there = abs(way) < (_LEAVING if self._there else _PLACE_TOLERANCE)
        if self._there:
            return STILL if abs(turn) < 2 * _PLACE_TOLERANCE else WalkVelocity(turn=self._turn(turn))
        side = self._side
        if (side * way).real < 0.0 and abs(way) < _PASSED:
            side = -side
        bearing = cmath.phase(side * way)
        if abs(bearing) > _AHEAD:
            return WalkVelocity(turn=self._turn(bearing))
        speed = min(self._gain * abs(way), self._highest.forward)
        return WalkVelocity(forward=side * speed, turn=self._turn(bearing))

    def _turn(self, angle: float) -> float:
        """Return the velocity of the turn with which to turn by an angle."""
        return min(max(self._gain * angle, -self._highest.turn), self._highest.turn)

    def _left(self, way: complex, turn: float) -> float:
        return abs(way) + min(_turning(way, turn), _turning(-way, turn))

    def _duration(self, way: complex, turn: float) -> float:
        turning = min(_turning(way, turn), _turning(-way, turn))
        return abs(way) / self._highest.forward + turning / self._highest.turn


def _turning(way: complex, turn: float) -> float:
    """Return the angle in rad by which a robot turns that drives forwards to a place, and turns there."""
    if abs(way) < _PLACE_TOLERANCE:
        return abs(turn)
    bearing = cmath.phase(way)
    return abs(bearing) + abs(math.remainder(turn - bearing, math.tau))


WALK: Final = sentence("the walk")
"""The activity that claims the legs, or the wheels, while it walks."""
_SOURCE: Final = "Walk"
_LONGEST_NAME: Final = 64
_CANNOT: Final = {
    "forward": sentence("go forwards or backwards"),
    "left": sentence("go sideways"),
    "turn": sentence("turn"),
}
"""What a robot cannot that has the limit 0 of a kind of velocity."""


@dataclass(frozen=True, slots=True)
class _Velocity:
    """A velocity of one kind, with its client and its end in steady wall time."""

    value: float
    client: str
    deadline: float
    renewed: bool
    """Whether its client renews it, not the server."""


class WalkGuard:
    """Pass velocities to `walker`: limited, and each for as long as its client renews it.

    The velocities forwards, to the left and of the turn are commanded, and stop, independently. During the
    walk, the joints of `walker` belong to it. The gate of `body` accepts or refuses each command, but never
    refuses a stop. When the robot itself ends the walk on its feet, velocities of the clients that renewed
    it are limited to 0 until a stop or a pause.
    """

    def __init__(self, walker: Walker, body: GuardedDevice, options: SafetyOptions) -> None:
        self.name: Final = WALK
        self.lag: Final = walker.lag
        """By how many s its velocity lags behind a command."""
        self.limits: Final = walker.limits
        """The highest velocity of each kind."""
        self.read: Final = walker.odometry
        """Return where the robot believes it is."""
        self.commanded: Final = walker.commanded
        """Return the commanded velocity, after limiting."""
        self._walker = walker
        self._body = body
        body.balancing = lambda: walker.joints if walker.balances else ()
        self._events = body.events
        self._options = options
        self._highest: dict[str, float] = asdict(walker.limits)
        self._lock = threading.Lock()
        self._drives: dict[str, _Velocity] = {}
        self._ended: dict[str, float] = {}  # clients that have not let go, and when they last tried
        self._closed = False
        self.stops = 0
        """How often it was stopped."""

    @property
    def failed(self) -> bool:
        """Whether the robot ended the newest walk as a part of it failed."""
        return self._walker.failed

    def drive(
        self,
        velocities: Mapping[str, float],
        client: str,
        limits: WalkVelocity | None = None,
        after: WalkVelocity | None = None,
    ) -> bool:
        """Walk at velocities, by fields of `WalkVelocity`, until the timeout; return whether any was limited.

        `limits` are tighter than the robot's. With `after`, the command is refused unless that velocity is
        still commanded, and lasts four timeouts. Raises InvalidCommand or CommandRefused, and then commands
        nothing.
        """
        limitations = []
        self._check_for_end()
        with self._lock:
            if after is not None and (commanded := self._walker.commanded()) != after:
                if commanded != STILL:
                    others = {each.client for each in self._drives.values()} - {client} or {client}
                    of = few(sorted(printable(each, _LONGEST_NAME) for each in others))
                    raise InvalidCommand("walk", f"another command of the walk ended it, of {of}")
                if self._walker.ended:
                    raise InvalidCommand("walk", f"the robot ended the walk: {self._walker.ended}")
                raise InvalidCommand("walk", "the walk was stopped")
            if any(velocities.values()):  # everybody may stop it
                self._body.gate.require(client)
                if self._clings(client):
                    velocities = dict.fromkeys(velocities, 0.0)
                    limitations.append(
                        (_SOURCE, sentence(f"limited to 0 until it is stopped: {self._walker.ended}"))
                    )
            drives = dict(self._drives)
            # The server itself renews its commands: only a stall of the machine delays that.
            timeout = self._options.velocity_timeout * (1 if after is None else 4)
            deadline = self._events.wall_time() + timeout
            for kind, velocity in velocities.items():
                if not math.isfinite(velocity):
                    raise InvalidCommand(kind, f"{kind} is {velocity}: it must be a finite number")
                highest = min(self._highest[kind], getattr(limits or self.limits, kind))
                safe = max(-highest, min(highest, velocity)) if highest else 0.0
                if safe != velocity:
                    what = _CANNOT[kind]
                    what = sentence(f"{kind} velocity {velocity:.4g} is of no use: the robot cannot {what}")
                    if self._highest[kind] > 0.0:
                        what = sentence(f"{kind} velocity {velocity:.4g} is too high")
                    limitations.append((_SOURCE, sentence(f"{what}, limited to {safe:.4g}")))
                drives.pop(kind, None)
                if safe:
                    drives[kind] = _Velocity(safe, client, deadline, renewed=after is None)
            if not self._closed:
                self._command(drives)
        self._events.add_limited(limitations)
        self._body.check_within(self._options.period)
        return bool(limitations)

    def stop(self) -> None:
        """End the walk; on both feet, if it has feet."""
        with self._lock:
            self.stops += 1
            self._ended = {}
            self._command({})

    def moves_for(self, client: str) -> bool:
        """Return whether it walks at a velocity of a client."""
        with self._lock:
            return any(drive.client == client for drive in self._drives.values())

    def drop_client(self, client: str) -> None:
        """Stop the velocities of a lost client."""
        stopped = self._stop_where(lambda drive: drive.client == client)
        if stopped:
            kinds = " and ".join(stopped)
            message = sentence(f"stopped ({kinds}): the client that drove it is gone")
            self._events.add(Severity.Warning, _SOURCE, message, "lost")

    def watch(self) -> float | None:
        """Stop expired velocities; return the wall seconds until the next check, None while it rests."""
        self._check_for_end()
        now = self._events.wall_time()
        stopped = self._stop_where(lambda drive: now >= drive.deadline)
        if stopped:
            self._events.count_timeout()
            message = sentence(f"stopped ({' and '.join(stopped)}): its velocity was not renewed in time")
            self._events.add(Severity.Warning, _SOURCE, message, "timeout")
        with self._lock:
            walking = self._walker.walking
            if not walking:
                self._body.free(WALK)  # its joints are to stay where they are now
        return self._options.period if walking else None

    def close(self) -> None:
        """End the walk and refuse further commands."""
        with self._lock:
            if not self._closed:
                self._command({})
                self._closed = True

    def _check_for_end(self) -> None:
        """Report it when the robot has ended the walk."""
        with self._lock:
            ended = bool(self._drives) and self._walker.commanded() == STILL
            if ended:
                if self._walker.walking:  # it is still on its feet
                    now = self._events.wall_time()
                    self._ended = {drive.client: now for drive in self._drives.values() if drive.renewed}
                # One that the robot has not taken yet would begin a walk that nobody watches.
                self._command({})
        if ended:
            reason = self._walker.ended or sentence("it fell, its motors became limp, or it was moved")
            self._events.add(
                Severity.Error, _SOURCE, sentence(f"the robot ended the walk: {reason}"), "ended"
            )

    def let_go(self, client: str) -> None:
        """Let a client walk again after a walk that the robot has ended."""
        self._ended.pop(client, None)

    def _clings(self, client: str) -> bool:
        """Return whether a client goes on with a walk that the robot has ended."""
        now = self._events.wall_time()
        clings = now - self._ended.pop(client, -math.inf) < self._options.velocity_timeout
        if clings:
            self._ended[client] = now
        return clings

    def _stop_where(self, condition: Callable[[_Velocity], bool]) -> list[str]:
        """Stop the velocities that meet a condition; return their kinds."""
        with self._lock:
            if not self._walker.walking:
                return []  # the robot has ended the walk, as `watch` reports
            stopped = [kind for kind, drive in self._drives.items() if condition(drive)]
            if stopped:
                self._command({kind: drive for kind, drive in self._drives.items() if kind not in stopped})
        return stopped

    def _command(self, drives: dict[str, _Velocity]) -> None:
        """Command the walker. Raises InvalidCommand, and then commands nothing."""
        if not drives:
            self._walker.command(STILL)
            self._drives = {}  # not earlier: `watch` repeats a stop that fails
            return
        self._body.claims.claim(WALK, self._walker.joints, self.stop)
        former, self._drives = self._drives, drives  # of what fails half way, `watch` finds the end
        try:
            self._walker.command(WalkVelocity(**{kind: drive.value for kind, drive in drives.items()}))
        except InvalidCommand:
            self._drives = former
            if not self._walker.walking:
                self._drives = {}
                self._body.claims.release(WALK)
            raise


PERIOD: Final = 0.05
"""Robot seconds between two corrections of the velocity."""
_IDLE: Final = ActionState(time=0.0, name="", status=ActionStatus.Idle, progress=0.0, message="", count=0)


class WalkTo:
    """Walk to places through `guard`; `tick` is due every PERIOD of robot time while it is `busy`.

    `on_begin` is called when it begins. Thread-safe.
    """

    def __init__(
        self, guard: WalkGuard, robot_time: Callable[[], float], on_begin: Callable[[], None]
    ) -> None:
        self.guard: Final = guard
        self._robot_time = robot_time
        self._on_begin = on_begin
        self._lock = threading.Lock()
        self._way: Way | None = None
        self._client = ""
        self._commanded = STILL
        self._end = math.inf
        self._state = _IDLE

    @property
    def busy(self) -> bool:
        """Whether it is on the way, or ending the walk there."""
        return self._way is not None

    def state(self) -> ActionState:
        """Return the state of the newest walk to a place."""
        return replace(self._state, time=self._robot_time())

    def begin(self, way: Way, client: str) -> None:
        """Begin to walk to the end of a way, in place of the previous walk.

        Raises InvalidCommand when the robot cannot walk now, CommandRefused when the client may not command.
        """
        self.guard.let_go(client)
        with self._lock:
            self._drive(way, client, None)
            self._way = way
            self._client = client
            self._end = self._robot_time() + way.patience
            self._state = replace(_IDLE, status=ActionStatus.Moving, count=self._state.count + 1)
        self._on_begin()

    def stop(self) -> None:
        """End the walk; on both feet, if it has feet."""
        with self._lock:
            self.guard.stop()
            if self._way is not None:
                self._wait_until_it_stands("stopped")

    def tick(self) -> None:
        """Correct and renew the velocity; end the walk at the end of the way."""
        with self._lock:
            way = self._way
            if way is None:
                return
            if self._commanded != STILL:
                self._state = replace(self._state, progress=way.progress(self.guard.read()))
                if self._robot_time() > self._end:
                    self.guard.stop()
                    self._wait_until_it_stands(sentence(f"it did not get there within {way.patience:.0f} s"))
                else:
                    self._renew(way)
            # The joints are free when the guard has nothing more to watch.
            if self._commanded == STILL and self.guard.watch() is None:
                ended = ActionStatus.Failed if self.guard.failed else ActionStatus.Stopped
                self._finish(ended if self._state.message else ActionStatus.Done)

    def _renew(self, way: Way) -> None:
        try:
            self._drive(way, self._client, self._commanded)
        except RobotError as error:
            with suppress(InvalidCommand):  # another command has replaced it, or the walk has ended
                self.guard.drive(asdict(STILL), self._client, after=self._commanded)
            if self.guard.commanded() == STILL:
                self._wait_until_it_stands(str(error))
            else:
                self._finish(ActionStatus.Stopped, str(error))

    def _drive(self, way: Way, client: str, after: WalkVelocity | None) -> None:
        self.guard.drive(asdict(way.velocity(self.guard.read())), client, after=after)
        self._commanded = self.guard.commanded()  # as it was limited

    def _wait_until_it_stands(self, message: str) -> None:
        self._commanded = STILL
        self._state = replace(self._state, message=message)

    def _finish(self, status: ActionStatus, message: str = "") -> None:
        self._way = None
        progress = 1.0 if status is ActionStatus.Done else self._state.progress
        message = message or self._state.message
        self._state = replace(self._state, status=status, message=message, progress=progress)
