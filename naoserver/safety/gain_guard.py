"""Commands with gains behind their safety layer: limited, and each for as long as its client renews it."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from functools import partial
from operator import le
from typing import Final

from msgspec.structs import asdict, astuple

from interfaces import nao
from naoserver.bodies.body import Body
from naoserver.bodies.capabilities import GainControl, JointCommand
from naoserver.bodies.parts import Gains
from naoserver.errors import CommandRefused, InvalidCommand, RobotError
from naoserver.options import SafetyOptions
from naoserver.protocol.robot import JointReading
from naoserver.safety._guarded_device import GuardedDevice, require_reached
from naoserver.safety._limits import clamp
from zenoh_ice.data.text import few, sentence

_AHEAD: Final = 0.06
"""Seconds that are looked ahead, so that a joint makes way in time for one that could hit it."""
_MAKING_WAY: Final = 0.5
"""Part of the speed of the one that makes way at which the other may come: both have to accelerate."""
_ACTIVITY: Final = sentence("commands with gains") + " to {}"
RETURN_TIME: Final = 1.0
"""Wall seconds in which the weight of a command falls from 1 to 0."""


@dataclass(slots=True)
class _Followed:
    """The command that a joint follows now."""

    command: JointCommand
    client: str
    deadline: float
    """In steady wall time."""
    rest: tuple[float, ...] = ()
    """What it held before, to which it goes back in the end; empty for one that is damped then."""
    weight: float = 1.0
    damped: bool = False
    """Whether it is damped, or goes back."""

    def back(self, now: float) -> JointCommand:
        """Return the command on the way back at a wall time."""
        left = (self.deadline - now) / max(self.weight * RETURN_TIME, 1e-9)
        return _mixed(self.command, self.rest, left)


class GainGuard:
    """Pass commands with gains to `control`. Implements Watched.

    The gate of `body` accepts or refuses each command; its joints belong to the client until they are held
    again. What a client does not renew is damped, and then held, as is what a lost client commanded; what
    followed by a weight goes back instead to what it held, as its weight falls. A stop holds at once.
    Positions, speeds, torques and gains are limited by the facts and the `options`. Of a pair of joints that
    could hit each other, both are to be commanded, and so are all joints of the legs of a robot that
    balances: its client does that now.
    """

    def __init__(
        self, control: GainControl, body: GuardedDevice, facts: Body, gains: Gains, options: SafetyOptions
    ) -> None:
        self.name: Final = "commands with gains"
        self._control = control
        self._body = body
        self._events = body.events
        self._options = options
        self._tables = facts.tables
        self._ruled = {joint for rule in facts.speed_rules for joint in rule.slower}
        speeds = {joint.name: options.speed_fraction * joint.max_velocity for joint in facts.joints}
        self._limits = {  # the least and the highest of each field, without those of the range
            joint.name: (
                (joint.lower, -speeds[joint.name], -joint.max_torque, 0.0, 0.0),
                (joint.upper, speeds[joint.name], joint.max_torque, gains.kp, gains.kd),
            )
            for joint in facts.joints
            if joint.name in facts.motors
        }
        gears = {joint.name: facts.gears[joint.gear] for joint in facts.joints if joint.gear}
        own = {name: (min(of.stiffness, gains.kp), min(of.damping, gains.kd)) for name, of in gears.items()}
        self.own: Final = dict.fromkeys((joint.name for joint in facts.joints), (gains.kp, gains.kd)) | own
        """The gains with which each joint holds by itself."""
        self._lock = threading.RLock()
        self._followed: dict[str, _Followed] = {}
        self._closed = False

    def command(
        self,
        commands: Mapping[str, nao.JointCommand],
        client: str,
        weights: Mapping[str, float] | None = None,
    ) -> dict[str, nao.JointCommand]:
        """Let joints follow commands until the timeout; return those that were limited, as they were.

        With `weights` from 0 to 1, each follows its command by its weight, and else what it held before.
        Raises InvalidCommand or CommandRefused, and then commands nothing.
        """
        limited: dict[str, nao.JointCommand] = {}
        with self._lock:
            stops = self._body.gate.stops
            self._body.gate.require(client)
            reading, now = self._body.read(), self._events.wall_time()
            safe = {joint: self._safe(joint, given, limited) for joint, given in commands.items()}
            weights = weights or {}
            rests = {joint: self._rest(joint, reading) for joint in weights}
            for joint, weight in weights.items():
                safe[joint] = _mixed(safe[joint], rests[joint], weight)
            self._admit(commands, reading, client)
            for joint, command in self._apart(safe, reading).items():
                if command.position != safe[joint].position:
                    limited[joint] = nao.JointCommand(*command[:5])
                safe[joint] = command
            if safe and not self._closed:
                self._claim(safe)
                self._control.command_gains(safe)
                deadline = now + self._options.gains_timeout
                for joint, command in safe.items():
                    by = rests.get(joint, ()), weights.get(joint, 1.0)
                    self._followed[joint] = _Followed(command, client, deadline, *by)
            if self._body.gate.stops != stops:  # an emergency stop came in between, before the claim
                for joint in safe:
                    self._hold(joint)
                self._body.gate.require(client)
                raise CommandRefused("the robot was stopped")
        self._body.check_within(self._options.period)
        return limited

    def moves_for(self, client: str) -> bool:
        """Return whether joints follow the commands of a client, or are damped after them."""
        with self._lock:
            return any(each.client == client for each in self._followed.values())

    def let_go(self, client: str) -> None:
        """Let joints go back that follow commands of a client by a weight."""
        with self._lock:
            self._damp([joint for joint in self._of(client) if self._followed[joint].rest])

    def drop_client(self, client: str) -> None:
        """Damp what follows the commands of a lost client, or let it go back."""
        with self._lock:
            lost = self._of(client)
            self._damp(lost)
        self._report(lost, "the client that commanded it is gone", "lost")

    def _of(self, client: str) -> list[str]:
        """Return the joints that follow the commands of a client."""
        return [joint for joint, each in self._followed.items() if each.client == client and not each.damped]

    def watch(self) -> float | None:
        """Damp and hold what was not renewed; return the wall seconds until the next check, None at rest."""
        with self._lock:
            now = self._events.wall_time()
            followed = self._followed.items()
            ended = [joint for joint, each in followed if now >= each.deadline and each.damped]
            late = [joint for joint, each in followed if now >= each.deadline and not each.damped]
            self._damp(late)
            for joint in ended:
                self._end(joint)
            back = {joint: each.back(now) for joint, each in followed if each.damped and each.rest}
            newest = {joint: each.command for joint, each in followed} | back
            if changed := back | self._apart(newest, self._body.read()):
                self._control.command_gains(changed)
            due = self._options.period if self._followed else None
        if late:
            self._events.count_timeout()
        timeout = self._options.gains_timeout
        self._report(late, f"its command with gains was not renewed within {timeout:g} s", "timeout")
        return due

    def close(self) -> None:
        """Pass no further command on: the body holds what follows one."""
        with self._lock:
            self._closed = True

    # -- the rules ---------------------------------------------------------------------------------------

    def _safe(
        self, joint: str, given: nao.JointCommand, limited: dict[str, nao.JointCommand]
    ) -> JointCommand:
        """Return a command within the limits of its joint; one that was not is added to `limited`."""
        limits = self._limits.get(joint)
        values: tuple[float, ...] = astuple(given)
        # Also a value that is not a number is not within limits.
        if limits is None or not (all(map(le, limits[0], values)) and all(map(le, values, limits[1]))):
            for field, value in asdict(given).items():
                self._body.check({joint: value}, field)
            if limits is None:
                raise InvalidCommand(joint, f"{joint} shares its motor with another joint: command that one")
            values = tuple(map(clamp, values, *limits))
            limited[joint] = nao.JointCommand(*values)
        least, most = limits
        speed = self._body.speed_cap(joint) if joint in self._ruled else most[1]
        return JointCommand._make((*values, least[0], most[0], speed))

    def _admit(self, joints: Mapping[str, object], reading: JointReading, client: str) -> None:
        """Raise InvalidCommand unless a client may command the joints together."""
        if reading.faults:
            require_reached(joints, reading.faults)
        for joint in joints:
            if (each := self._followed.get(joint)) and each.client != client and not each.damped:
                raise InvalidCommand(joint, f"{joint} follows another client's commands: stop it first")
        balancing = set(self._body.balancing())
        if (lone := balancing & joints.keys()) and lone != balancing:
            joint, others = min(lone), few(sorted(balancing - joints.keys()))
            raise InvalidCommand(joint, f"{joint} keeps the robot upright: command also {others}, or none")
        for table in self._tables:
            pair = {table.independent, table.dependent}
            if len(lone := pair & joints.keys()) == 1 and not pair <= self._followed.keys():
                joint, other = *lone, *(pair - lone)
                raise InvalidCommand(joint, f"{joint} could hit what {other} moves: command also {other}")

    def _apart(self, commands: Mapping[str, JointCommand], reading: JointReading) -> dict[str, JointCommand]:
        """Return commands of joints that could hit each other, so that they do not."""
        narrowed = {}
        for table in self._tables:
            first, second = table.independent, table.dependent
            place, (least, most) = self._body.index(first), self._limits[second]
            if second in commands:
                angle, command = reading.positions[place], commands[second]
                lower, upper = table.over((angle, angle + _AHEAD * reading.velocities[place]))
                lower = max(lower, least[0])
                upper = max(lower, min(upper, most[0]))
                position = clamp(command.position, lower, upper)
                narrowed[second] = command._replace(position=position, lower=lower, upper=upper)
            if first in commands and table.steepest:
                speed = min(commands[first].max_speed, _MAKING_WAY * most[1] / table.steepest)
                narrowed[first] = commands[first]._replace(max_speed=speed)
        return narrowed

    # -- what becomes of joints --------------------------------------------------------------------------

    def _claim(self, joints: Iterable[str]) -> None:
        """Claim joints that follow no command yet. Raises InvalidCommand, and then claims none."""
        with ExitStack() as undo:
            for joint in joints:
                if joint not in self._followed:
                    activity = _ACTIVITY.format(joint)
                    self._body.claims.claim(activity, (joint,), partial(self._hold, joint))
                    undo.callback(self._body.claims.release, activity)
                    self._body.forget(joint)
            undo.pop_all()

    def _damp(self, joints: Iterable[str]) -> None:
        now, commands = self._events.wall_time(), {}
        for joint in joints:
            each, (_, kd) = self._followed[joint], self.own[joint]
            each.damped = True
            if each.rest:
                each.deadline = now + each.weight * RETURN_TIME
                continue
            each.deadline = now + self._options.damping_time
            commands[joint] = each.command = each.command._replace(velocity=0.0, torque=0.0, kp=0.0, kd=kd)
        if commands:
            self._control.command_gains(commands)

    def _rest(self, joint: str, reading: JointReading) -> tuple[float, ...]:
        """Return what a joint holds, as strongly as it does, or held before it followed by a weight."""
        each, (kp, kd), place = self._followed.get(joint), self.own[joint], self._body.index(joint)
        held, stiffness = reading.commands[place], reading.stiffnesses[place]
        return each.rest if each and each.rest else (held, 0.0, 0.0, stiffness * kp, stiffness * kd)

    def _end(self, joint: str) -> None:
        """Release a joint that was damped, which is held where it is, or that went back."""
        each, activity = self._followed[joint], _ACTIVITY.format(joint)
        if each.rest:
            with suppress(RobotError):  # stopped, or held by a lease: it is held where it is
                goal, speed = {joint: each.rest[0]}, {joint: each.command.max_speed}
                self._body.move(goal, speed, activity=activity)
                del self._followed[joint]
                self._body.claims.release(activity)
        self._hold(joint)

    def _hold(self, joint: str) -> None:
        """Hold a joint where it is, and release it."""
        with self._lock:
            if self._followed.pop(joint, None) is not None:
                self._body.free(_ACTIVITY.format(joint))

    def _report(self, joints: list[str], why: str, kind: str) -> None:
        if joints:
            back = all((each := self._followed.get(joint)) and each.rest for joint in joints)
            what = "let go of" if back else "damped"
            self._events.add(nao.Severity.Warning, self.name, f"{what} {few(joints)}: {why}", kind)


def _mixed(command: JointCommand, rest: tuple[float, ...], weight: float) -> JointCommand:
    """Return a part `weight` of the values of a command, and the rest of what was held before."""
    values = (weight * one + (1.0 - weight) * two for one, two in zip(command, rest, strict=False))
    return JointCommand._make((*values, *command[len(rest) :]))
