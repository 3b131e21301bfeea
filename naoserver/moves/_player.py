"""The player that moves the body along routes, leg by leg.

It follows the robot's time, commands through the safety layer, and plays one route at a time.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from msgspec.structs import replace

from interfaces.nao import ActionState, ActionStatus, Severity
from naoserver.bodies.body import Body
from naoserver.bodies.parts import Stance
from naoserver.errors import CommandRefused, RobotError
from naoserver.moves.motion_file import Motion, load_motions
from naoserver.moves.routes import (
    SLOWEST_PACE,
    UPRIGHT,
    Route,
    RouteError,
    Situation,
    changes_stance,
    stance_of,
)
from naoserver.protocol.robot import LIMP, JointReading
from naoserver.safety._guarded_device import GuardedDevice
from zenoh_ice.data.text import sentence, text_of

_logger = logging.getLogger(__name__)

PERIOD: Final = 0.02
"""Robot seconds between two commands: 50 Hz, the cycle of NAOqi's motion."""
_AHEAD: Final = 2 * PERIOD
"""Time in s that a command looks ahead, so that the next may come late."""
_STIFFENING: Final = 0.4
"""Seconds in which limp motors become stiff before a motion."""
_STIFF: Final = 0.99
_SETTLING_TIME: Final = 0.3
"""Seconds after a leg before the body's situation is checked."""


_GONE: Final = sentence("the client that commanded it is gone")
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
    cut_short: str = ""
    """Why it ends before it is done; empty while it does not."""

    @property
    def activity(self) -> str:
        """What it is called that moves the joints while it is played."""
        if self.kind == "posture":
            return sentence(f"the posture {self.name}")
        return sentence(f"the motion {self.name}")


class MotionPlayer:
    """Move the joints of a body along routes; `tick` is due every PERIOD of robot time while one is `busy`.

    `situation` returns the body's situation; `on_begin` is called when an action begins. A running action
    claims its joints: other commands to them are refused, and stopping one of them stops the action. If its
    client is lost, it stops at once; where the body might fall then, it ends its leg and goes into the safest
    posture. Thread-safe; nothing waits for the robot under its lock: the robot's control loop ticks it.
    """

    def __init__(
        self,
        body: Body,
        device: GuardedDevice,
        situation: Callable[[], Situation],
        on_begin: Callable[[], None],
    ) -> None:
        self.body: Final = body
        self._device = device
        self._names = body.joint_names
        self.robot_time: Final = device.events.robot_time
        self.situation: Final = situation
        """Return the body's situation. Raises RobotError when it is unknown."""
        self._on_begin = on_begin
        self._lock = threading.RLock()
        self._action: _Action | None = None
        self._progress: dict[str, ActionState] = {}
        self._closed = False
        self.stops = 0
        """How often an action was stopped, but not because another one began."""

    @property
    def motions(self) -> Mapping[str, Motion]:
        """The motions of the body by name. Raises MotionError when a file cannot be used."""
        return load_motions(self.body)

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
        joints or a motor is too hot, CommandRefused when the client may not command, RobotError when no route
        is possible.
        """
        with self._lock:
            self._device.gate.require(client)
            if self._closed:
                return
            action = _Action(kind, name, route, max(pace, SLOWEST_PACE), client)
            first = route.next_leg(self.situation(), self._device.angles(measured=False))
            if first is not None:
                self._require_cool(first)
            self._finish(ActionStatus.Stopped, f"{action.activity} began")
            try:
                self._begin_leg(action, first)
            except BaseException:
                self._device.claims.release(action.activity)
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
            self.stops += 1
            self._finish(ActionStatus.Stopped, message)
        self._hold(action.leg)

    def drop_client(self, client: str) -> None:
        """End the action of a lost client: at once, or after its present leg in the safest posture."""
        with self._lock:
            action = self._action
            if action is None or not client or action.client != client:
                return
            ending = action.route.abandoned()
            if ending is None:
                self._finish(ActionStatus.Stopped, _GONE)
            else:
                action.route, action.cut_short = ending, _GONE
        if ending is None:
            self._hold(action.leg)
        what, reason = action.activity, _GONE
        message = sentence(f"{what} will end in the safest posture that it reaches: {reason}")
        if ending is None:
            message = sentence(f"{what} stopped: {reason}")
        self._device.events.add(Severity.Warning, "Motions", message, "lost")

    def tick(self) -> None:
        """Command the joints for the robot's present time; continue with the next leg when one is done."""
        with self._lock:
            action = self._action
            if action is None:
                return
            try:
                self._go_on(action)
            except (Exception, SystemExit) as error:
                refused = isinstance(error, CommandRefused)
                self._finish(ActionStatus.Stopped if refused else ActionStatus.Failed, text_of(error))
                what = action.activity
                if not isinstance(error, RobotError):
                    _logger.error("%s failed", what, exc_info=error)
                message = sentence(f"{what} ended: {text_of(error)}")
            else:
                return
        self._device.events.add(Severity.Warning, "Motions", message, "failed")
        self._hold(action.leg)

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
        if time >= leg.duration / action.pace + _SETTLING_TIME:
            self._check(leg, self._device.read())
            commands = self._device.angles(measured=False)
            self._begin_leg(action, action.route.next_leg(self.situation(), commands))
            if action.leg is None:
                self._finish(
                    ActionStatus.Stopped if action.cut_short else ActionStatus.Done, action.cut_short
                )
            return
        if time < 0.0:
            return  # the motors are still becoming stiff
        reading = self._device.read()
        part = min(1.0, max(0.0, time * action.pace / leg.duration))
        self._progress[action.kind] = replace(self.progress(action.kind), progress=part)
        self._check(leg, reading)
        wanted = leg.at((time + _AHEAD) * action.pace, begin)
        commands = dict(zip(self._names, reading.commands, strict=True))  # of the same moment
        # After a late tick a joint may be too far behind to catch up at once.
        speeds = {
            joint: min(abs(angle - commands[joint]) / _AHEAD, self.body.joint[joint].max_velocity)
            for joint, angle in wanted.items()
        }
        self._device.move(wanted, speeds, client=action.client, activity=action.activity)

    def _begin_leg(self, action: _Action, leg: Motion | None) -> None:
        """Claim the joints of the next leg and make them stiff. Raises InvalidCommand or CommandRefused."""
        if leg is not None:
            self._require_cool(leg)
            leg = leg.of(self._names)
        action.leg = leg
        if leg is None:
            return
        joints = self._device.with_coupled(leg.keys)
        self._device.claims.claim(action.activity, joints, lambda: self._let_go(action))
        action.begin, action.since = self._device.angles(measured=False), self.robot_time()
        stiffnesses = zip(self._names, self._device.read().stiffnesses, strict=True)
        limp = [joint for joint, stiffness in stiffnesses if stiffness < _STIFF and joint in joints]
        if limp:
            full = dict.fromkeys(limp, 1.0)
            self._device.stiffen(full, _STIFFENING, client=action.client, activity=action.activity)
            action.since += _STIFFENING

    def _let_go(self, action: _Action) -> None:
        """Stop without holding the joints: the next activity does."""
        with self._lock:
            if self._action is action:
                self.stops += 1
                self._finish(ActionStatus.Stopped, "its joints were stopped")

    def _finish(self, status: ActionStatus, message: str = "") -> None:
        action, self._action = self._action, None
        if action is None:
            return
        self._device.claims.release(action.activity)
        before = self.progress(action.kind)
        part = 1.0 if status is ActionStatus.Done else before.progress
        self._progress[action.kind] = replace(before, status=status, message=message, progress=part)

    def _check(self, leg: Motion, reading: JointReading) -> None:
        """Raise RobotError if a motor has gone limp, or the body lies during a leg from feet to feet."""
        ends = {self.body.postures[posture].stance for posture in (leg.start, leg.end) if posture}
        if ends and ends <= set(UPRIGHT) and stance_of(self.body, self.situation()) not in UPRIGHT:
            raise RobotError(sentence("the robot has fallen"))
        for joint, stiffness in zip(self._names, reading.stiffnesses, strict=True):
            if joint in leg.keys and stiffness <= LIMP:
                raise RobotError(sentence(f"{joint} has gone limp"))

    def _require_cool(self, leg: Motion) -> None:
        """Raise RouteError if a motor is too hot for a leg that lifts the body off the floor."""
        heat = self.body.motor_heat
        if heat is None or not changes_stance(self.body, leg):
            return
        if self.body.postures[leg.start].stance is not Stance.STANDING:
            for joint, temperature in zip(self._names, self._device.read().temperatures, strict=True):
                if joint in leg.keys and temperature >= heat.hot:
                    message = sentence(
                        f"{joint} is at {temperature:.0f} degrees: let it cool below {heat.hot:.0f}"
                    )
                    raise RouteError(message)

    def _hold(self, leg: Motion | None) -> None:
        self._device.hold(leg.keys if leg else ())
