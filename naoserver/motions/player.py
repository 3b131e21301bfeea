"""Ways of the whole body, to a posture or into a motion, and the player that moves it along them.

After each leg, the player asks the route for the next one, which depends on how the body lies, sits or stands
then. A failed attempt to get up is thus repeated, and the robot recovers from a fall on the way. The player
follows the robot's clock, commands through the safety layer, and plays one route at a time.
"""

from __future__ import annotations

import dataclasses
import threading
from collections import Counter, deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, Protocol

from msgspec.structs import replace

from interfaces.nao import ActionState, ActionStatus, Severity
from naoserver.body import H25
from naoserver.errors import CommandRefused, InvalidCommand, RobotError
from naoserver.guarded_device import GuardedDevice
from naoserver.motions.keyframes import Interpolation, Key, Motion
from naoserver.motions.postures import POSTURES, STANCES, Situation, Stance, nearest_posture, stance_of
from naoserver.robot import LIMP, JointReading

_FRACTION: Final = 0.3
"""Highest speed of a change of posture at full pace, as a fraction of the joints' full speed."""
_SLOWEST: Final = 0.01
"""Smallest fraction of the full pace; smaller ones are raised to it, so that every way ends."""
_SHORTEST: Final = 0.4
"""Minimum duration of a change of posture in s."""
_SAME: Final = 0.02
"""Angle in rad within which a joint's setpoint needs no separate leg."""
_TRIES: Final = 3
"""Number of attempts at a motion out of a stance."""


class RouteError(InvalidCommand):
    """The route cannot be continued; the message says why."""

    def __init__(self, message: str) -> None:
        super().__init__("name", message)


class Route(Protocol):
    """The body's actions, leg by leg."""

    def next_leg(self, situation: Situation, commands: Mapping[str, float]) -> Motion | None:
        """Return the next leg, None at the end; `commands` are the joints' setpoints. Raises RouteError."""


class PostureRoute:
    """The way to a posture: legs from stance to stance, and then within the posture's stance."""

    def __init__(self, posture: str, motions: Iterable[Motion], fraction: float = 1.0) -> None:
        self._posture = posture
        self._fraction = fraction
        self._motions = tuple(motions)
        self._tries: Counter[Stance] = Counter()
        self._arrived = False

    def next_leg(self, situation: Situation, commands: Mapping[str, float]) -> Motion | None:
        """Return the next leg; None once the body is in the posture. Raises RouteError."""
        stance, wanted = stance_of(situation), STANCES[self._posture]
        if stance is wanted:
            if self._arrived:
                return None
            self._arrived = True
            return within_stance(self._posture, self._motions, situation, commands, self._fraction)
        self._arrived = False
        if self._tries[stance] == _TRIES:
            raise RouteError(f"it is still {stance} after {_TRIES} motions")
        if stance in _SIDES:
            self._tries[stance] += 1
            # The arms in that posture tip the body onto its belly or its back: either will do.
            leg = change_posture(_OFF_THE_SIDE[self._tries[stance] % 2], commands, self._fraction)
            return dataclasses.replace(leg, end="")
        bridge = self._first_bridge(stance, wanted)
        if bridge is None:
            raise RouteError(f"it is {stance}, and no motions lead from there to {self._posture}")
        if stance in _UPRIGHT and not _is_near(commands, bridge.start):
            return within_stance(bridge.start, self._motions, situation, commands, self._fraction)
        self._tries[stance] += 1
        return bridge

    def _first_bridge(self, begin: Stance, end: Stance) -> Motion | None:
        """Return the first of the fewest motions that lead from a stance to another."""
        paths: deque[tuple[Stance, Motion | None]] = deque([(begin, None)])
        seen = {begin}
        while paths:
            stance, first = paths.popleft()
            if stance is end:
                return first
            for motion in self._motions:
                if not motion.start or not motion.end or STANCES[motion.start] is not stance:
                    continue
                after = STANCES[motion.end]
                if after not in seen:
                    seen.add(after)
                    paths.append((after, first or motion))
        return None


class MotionRoute:
    """A motion, after the way into the posture in which it begins."""

    def __init__(self, motion: Motion, motions: Iterable[Motion] = ()) -> None:
        self._motion = motion
        self._motions = tuple(motions)
        self._legs = [motion]
        self._prepared = not motion.start

    def next_leg(self, situation: Situation, commands: Mapping[str, float]) -> Motion | None:
        """Return the next leg. Raises RouteError when the motion cannot begin in the body's situation."""
        start = self._motion.start
        if not self._prepared:
            self._prepared = True
            stance = stance_of(situation)
            if stance is not STANCES[start]:
                name = self._motion.name
                raise RouteError(f"{name} begins {STANCES[start]}, in {start}, but the robot is {stance} now")
            if stance in _UPRIGHT and not _is_near(commands, start):
                return within_stance(start, self._motions, situation, commands, 1.0)
        return self._legs.pop() if self._legs else None


def within_stance(
    posture: str,
    motions: Iterable[Motion],
    situation: Situation,
    commands: Mapping[str, float],
    fraction: float,
) -> Motion:
    """Return the leg into a posture of the same stance: a motion made for it, or else the straight way."""
    begin = nearest_posture(situation)
    for motion in motions:
        if begin != posture and (motion.start, motion.end) == (begin, posture):
            return motion
    return change_posture(posture, commands, fraction)


def change_posture(posture: str, commands: Mapping[str, float], fraction: float) -> Motion:
    """Return the motion from where the joints are into a posture at a fraction of the full pace."""
    seconds = max(
        abs(POSTURES[posture][joint.name] - commands[joint.name]) / joint.max_velocity
        for joint in H25.joints
        if joint.name in commands
    )
    seconds = max(seconds * Interpolation.SMOOTH.peak / (_FRACTION * max(fraction, _SLOWEST)), _SHORTEST)
    keys = {joint: (Key(seconds, angle),) for joint, angle in POSTURES[posture].items() if joint in commands}
    for pair in H25.couplings:
        del keys[pair.follower]
    return Motion(f"to {posture}", MappingProxyType(keys), end=posture)


_SIDES: Final = (Stance.LEFT_SIDE, Stance.RIGHT_SIDE)
_OFF_THE_SIDE: Final = ("LyingBack", "StandZero")
_UPRIGHT: Final = {Stance.STANDING, Stance.SITTING}


def _is_near(commands: Mapping[str, float], posture: str) -> bool:
    angles = POSTURES[posture]
    return all(abs(command - angles[joint]) <= _SAME for joint, command in commands.items())


PERIOD: Final = 0.02
"""Robot seconds between two commands: 50 Hz, the cycle of NAOqi's motion."""
_AHEAD: Final = 2 * PERIOD
"""Time in s that a command looks ahead, so that the next may come late."""
_STIFFENING: Final = 0.4
"""Seconds in which limp motors become stiff before a motion."""
_STIFF: Final = 0.99
_FASTEST: Final = {joint.name: joint.max_velocity for joint in H25.joints}
_SETTLING: Final = 0.3
"""Seconds after a leg before the body's situation is checked."""


_IDLE: Final = ActionState(time=0.0, name="", status=ActionStatus.Idle, progress=0.0, message="", count=0)


@dataclass(slots=True)
class _Action:
    """The present motion, and its progress."""

    kind: str
    name: str
    route: Route
    pace: float
    client: str
    leg: Motion | None = None
    begin: Mapping[str, float] | None = None
    """Setpoints at the beginning of the leg."""
    since: float = 0.0
    """Robot time at which the leg begins, or at which the route is asked for it."""

    @property
    def owner(self) -> str:
        """Owner of the joints while it is played."""
        return f"the {self.kind} {self.name}"


class MotionPlayer:
    """Move the joints of `body` along routes; `tick` is due every PERIOD of robot time while one is `busy`.

    `situation` returns the body's situation; `on_begin` is called when an action begins. A running action
    claims its joints: other commands to them are refused, and stopping one of them stops the action. If its
    client is lost, the action still runs to its end, as a position command does. Thread-safe.
    """

    def __init__(
        self, body: GuardedDevice, situation: Callable[[], Situation], on_begin: Callable[[], None]
    ) -> None:
        self._body = body
        self._names = [joint.name for joint in body.joints]
        self.robot_time: Final = body.events.robot_time
        self.situation: Final = situation
        """Return the body's situation. Raises RobotError when it is unknown."""
        self._on_begin = on_begin
        self._lock = threading.RLock()
        self._action: _Action | None = None
        self._progress: dict[str, ActionState] = {}
        self._closed = False

    @property
    def busy(self) -> bool:
        """Whether an action moves."""
        return self._action is not None

    def progress(self, kind: str) -> ActionState:
        """Return the state of the newest action of a kind; `progress` is that of its present leg."""
        return replace(self._progress.get(kind, _IDLE), time=self.robot_time())

    def begin(self, kind: str, name: str, route: Route, *, pace: float = 1.0, client: str = "") -> None:
        """Begin an action in place of the running one.

        Stiffens the body first when a motor is limp. Raises InvalidCommand when something else moves the
        joints, CommandRefused when the client may not command, RobotError when no route is possible.
        """
        with self._lock:
            self._body.gate.require(client)
            if self._closed:
                return
            action = _Action(kind, name, route, max(pace, _SLOWEST), client)
            first = route.next_leg(self.situation(), self._commands())
            self._finish(ActionStatus.Stopped, f"{action.owner} began")
            try:
                self._begin_leg(action, first)
            except RobotError:
                self._body.claims.release(action.owner)
                raise
            status = ActionStatus.Moving if first else ActionStatus.Done
            count = self.progress(kind).count + 1
            self._progress[kind] = replace(_IDLE, name=name, status=status, count=count)
            self._action = action if first else None
        if self.busy:
            self._on_begin()

    def moves_for(self, client: str) -> bool:
        """Return whether an action of a client moves."""
        action = self._action
        return action is not None and action.client == client

    def stop(self, kind: str = "", message: str = "stopped") -> None:
        """Stop the running action, of a kind or any, and hold its joints where they are."""
        with self._lock:
            action = self._action
            if action is None or (kind and action.kind != kind):
                return
            self._finish(ActionStatus.Stopped, message)
        self._body.hold(_joints(action.leg))

    def tick(self) -> None:
        """Command the joints for the robot's present time; continue with the next leg when one is done."""
        with self._lock:
            action = self._action
            if action is None:
                return
            try:
                self._go_on(action)
            except RobotError as error:
                refused = isinstance(error, CommandRefused)
                self._finish(ActionStatus.Stopped if refused else ActionStatus.Failed, str(error))
                self._body.events.add(Severity.Warning, "Motions", f"{action.owner} ended: {error}", "failed")
            else:
                return
        self._body.hold(_joints(action.leg))

    def close(self) -> None:
        """Stop, and begin no further actions."""
        with self._lock:
            self._closed = True
        self.stop(message="the server ends")

    def _go_on(self, action: _Action) -> None:
        leg, begin = action.leg, action.begin
        assert leg is not None
        assert begin is not None
        time = self.robot_time() - action.since
        if time >= leg.duration / action.pace + _SETTLING:
            self._check(leg, self._body.read())
            self._begin_leg(action, action.route.next_leg(self.situation(), self._commands()))
            if action.leg is None:
                self._finish(ActionStatus.Done)
            return
        if time < 0.0:
            return  # the motors are still becoming stiff
        reading = self._body.read()
        part = min(1.0, max(0.0, time * action.pace / leg.duration))
        self._progress[action.kind] = replace(self.progress(action.kind), progress=part)
        self._check(leg, reading)
        wanted = leg.at((time + _AHEAD) * action.pace, begin)
        commands = dict(zip(self._names, reading.commands, strict=True))
        # After a late tick a joint may be too far behind to catch up at once.
        speeds = {
            joint: min(abs(angle - commands[joint]) / _AHEAD, _FASTEST[joint])
            for joint, angle in wanted.items()
        }
        self._body.move(wanted, speeds, client=action.client, owner=action.owner)

    def _begin_leg(self, action: _Action, leg: Motion | None) -> None:
        """Claim the joints of the next leg and make them stiff. Raises InvalidCommand or CommandRefused."""
        if leg is not None:
            leg = leg.of(self._names)
        action.leg = leg
        if leg is None:
            return
        joints = _joints(leg)
        self._body.claims.claim(action.owner, joints, lambda: self._let_go(action))
        action.begin, action.since = self._commands(), self.robot_time()
        stiffnesses = zip(self._names, self._body.read().stiffnesses, strict=True)
        limp = [joint for joint, stiffness in stiffnesses if stiffness < _STIFF and joint in joints]
        if limp:
            self._body.stiffen(dict.fromkeys(limp, 1.0), _STIFFENING, client=action.client)
            action.since += _STIFFENING

    def _let_go(self, action: _Action) -> None:
        """Stop without holding the joints: the next owner does."""
        with self._lock:
            if self._action is action:
                self._finish(ActionStatus.Stopped, "its joints were stopped")

    def _finish(self, status: ActionStatus, message: str = "") -> None:
        action, self._action = self._action, None
        if action is None:
            return
        self._body.claims.release(action.owner)
        before = self.progress(action.kind)
        part = 1.0 if status is ActionStatus.Done else before.progress
        self._progress[action.kind] = replace(before, status=status, message=message, progress=part)

    def _check(self, leg: Motion, reading: JointReading) -> None:
        """Raise RobotError if a motor has gone limp, or the body lies during a leg from feet to feet."""
        ends = {STANCES[posture] for posture in (leg.start, leg.end) if posture}
        if ends and ends <= _UPRIGHT and stance_of(self.situation()) not in _UPRIGHT:
            raise RobotError("the robot has fallen")
        for joint, stiffness in zip(self._names, reading.stiffnesses, strict=True):
            if joint in leg.keys and stiffness <= LIMP:
                raise RobotError(f"{joint} has gone limp")

    def _commands(self) -> dict[str, float]:
        return dict(zip(self._names, self._body.read().commands, strict=True))


def _joints(leg: Motion | None) -> frozenset[str]:
    """Return the joints that a leg moves, including those that share a motor."""
    joints = set(leg.keys) if leg else set()
    for pair in H25.couplings:
        if {pair.leader, pair.follower} & joints:
            joints |= {pair.leader, pair.follower}
    return frozenset(joints)
