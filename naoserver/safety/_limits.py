"""Make commands safe before they reach a device's joints: pure logic without I/O; callers pass the time.

It treats commands as follows:

- a value that is not finite, a joint that the device does not have: refused with InvalidCommand;
- a target outside the joint's range, or outside the range that the angle of another joint leaves (the
  anti-collision tables of `naoserver.bodies.body`): clamped, also on the way there while both joints move;
- a position speed above the cap (a fraction of the joint's full speed, less while a speed rule of the body
  applies), or at which another joint could not get out of the way in time: capped;
- a velocity: capped, reached and left by a ramp, ended at the joint's limit;
- a velocity that its client does not renew in time: stopped. The deadline counts steady wall time, not
  robot time: if a client hangs, the joint stops as soon, however fast a simulation runs;
- a velocity or a goal whose client is lost: the joint is held where it is;
- joints that one motor drives: the followers where their leader takes them;
- a passive joint, which has no motor: refused with InvalidCommand.

The `LimitedCommand` reports every change. Callers serialise the calls, as `_guarded_device` does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Final, NamedTuple

from msgspec.structs import replace

from naoserver.bodies.parts import Coupling, JointFacts, RangeTable, SpeedRule
from naoserver.errors import InvalidCommand
from naoserver.options import SafetyOptions
from naoserver.protocol.robot import LIMP, JointReading
from zenoh_ice.data.text import sentence

_REACHED: Final = 1e-3
"""Distance in rad (or m) within which a joint's setpoint counts as being at its goal."""
_SAG: Final = 0.05
"""Distance in rad from its setpoint at which a load may hold a joint; beyond it, the joint lags behind."""

_LONGEST_NAME: Final = 64
"""Maximum characters of a client's text in an error."""
_ROUNDING: Final = 1e-9
"""Change in rad (or m) that may be due to rounding: such a value does not count as limited."""


class Limitation(NamedTuple):
    """A value that was changed, and why."""

    joint: str
    reason: str


@dataclass(slots=True)
class LimitedCommand:
    """The command for the device, and the outcome for the client."""

    positions: dict[str, float] = field(default_factory=dict)
    """Targets for `JointDevice.command_positions`, with `max_speeds`."""
    max_speeds: dict[str, float] = field(default_factory=dict)
    velocities: dict[str, float] = field(default_factory=dict)
    """Velocities for `JointDevice.command_velocities`."""
    accepted: dict[str, float] = field(default_factory=dict)
    """The value, after limiting, of each joint that the client named."""
    limitations: list[Limitation] = field(default_factory=list)
    stopped: list[str] = field(default_factory=list)
    """Joints that are held because their velocity was not renewed or their client was lost."""


def couple(values: dict[str, float], pairs: Sequence[Coupling]) -> list[Limitation]:
    """Give coupled joints values that agree: by the leader's, or else by that of a follower."""
    given = dict(values)
    for pair in pairs:
        if pair.follower in given and pair.leader not in values:
            values[pair.leader] = pair.reversed().of(given[pair.follower])
    limitations = []
    for pair in pairs:
        if pair.leader in values:
            value = values[pair.follower] = pair.of(values[pair.leader])
            if abs(given.get(pair.follower, value) - value) > _ROUNDING:
                taken = values[pair.leader]
                reason = sentence(f"shares its motor with {pair.leader}, whose {taken:.4g} it takes")
                limitations.append(Limitation(pair.follower, reason))
    return limitations


def _out_of_range(value: float) -> str:
    return sentence(f"{value:.4g} is out of range")


def _too_fast(speed: float) -> str:
    return sentence(f"speed {speed:.4g} is too fast")


def _would_hit(joint: str, value: float) -> str:
    return sentence(f"{value:.4g} would hit at this {joint}")


def clamp(value: float, lower: float, upper: float) -> float:
    """Return the value nearest to `value` from `lower` to `upper`."""
    return min(max(value, lower), upper)


class Goal(NamedTuple):
    """Target and highest speed of a position command for a joint."""

    target: float
    speed: float


@dataclass(slots=True)
class _Drive:
    """A joint that moves at a commanded velocity."""

    target: float
    velocity: float
    """Velocity reached so far on the ramp to `target`."""
    deadline: float
    client: str


class JointSafety:
    """Watch over the joints of one device; an LimitedCommand reports what its rules change."""

    def __init__(
        self,
        joints: Sequence[JointFacts],
        options: SafetyOptions,
        tables: Iterable[RangeTable] = (),
        couplings: Iterable[Coupling] = (),
        speed_rules: Iterable[SpeedRule] = (),
    ) -> None:
        self.options: Final = options
        self._facts = {joint.name: joint for joint in joints}
        self._passive = {joint.name for joint in joints if joint.passive}
        self._index = {joint.name: index for index, joint in enumerate(joints)}
        self._speed_rules: dict[str, list[SpeedRule]] = {}  # of each joint that has any
        for rule in speed_rules if options.speed_rules else ():
            for joint in rule.slower:
                self._speed_rules.setdefault(joint, []).append(rule)
        self._couplings = tuple(couplings)
        # The same for velocities, for highest speeds and for stiffnesses.
        self._rates = [replace(pair, offset=0.0) for pair in self._couplings]
        self._speeds = [replace(pair, ratio=abs(pair.ratio)) for pair in self._rates]
        self._stiffnesses = [replace(pair, ratio=1.0) for pair in self._rates]
        self._tables = tuple(tables)
        self._table_of = {table.dependent: table for table in self._tables}
        self._tabled = {joint for table in self._tables for joint in (table.independent, table.dependent)}
        # A joint is in at most one of the two; in neither before its first command.
        self._drives: dict[str, _Drive] = {}
        self._goals: dict[str, Goal] = {}
        self._clients: dict[str, str] = {}  # of the goals; empty for those that nobody set
        self._issued: dict[str, tuple[float, float] | float] = {}  # the newest command to each joint
        self._resting: set[str] = set()  # joints whose goal is just the position where they stopped
        self._held_back: set[str] = set()  # joints that a range holds back, and that were reported
        self._time = 0.0  # robot time of the last check

    def goal(self, joint: str) -> Goal | None:
        """Return the joint's goal; None unless its newest command was a position command."""
        return None if joint in self._resting else self._goals.get(joint)

    def velocity(self, joint: str) -> float:
        """Return the velocity that the joint is commanded to reach, 0 unless it is driven by velocity."""
        drive = self._drives.get(joint)
        return drive.target if drive else 0.0

    def safe_goals(
        self,
        targets: Mapping[str, float],
        speeds: Mapping[str, float],
        reading: JointReading,
        client: str = "",
        *,
        full_speed: bool = False,
    ) -> LimitedCommand:
        """Send joints to `targets` at most at `speeds`; without a speed, or with 0, at the default.

        The goals last until the joints are there, or `client` is lost; without one, nothing ends them.
        With `full_speed`, a speed is limited only by the motor, not by the options: for tested motions.
        Raises InvalidCommand, and then commands nothing.
        """
        wanted = self.check(targets, sentence("target"))
        limits = self.check({joint: speeds[joint] for joint in wanted if joint in speeds}, sentence("speed"))
        for joint, speed in limits.items():
            if speed < 0:
                raise InvalidCommand(joint, f"{joint}: a speed of {speed:g} is negative")
        outcome = LimitedCommand(
            limitations=[*couple(wanted, self._couplings), *couple(limits, self._speeds)]
        )
        self._wake(reading)
        for joint, target in wanted.items():
            facts = self._facts[joint]
            safe = self._limit(joint, target, (facts.lower, facts.upper), _out_of_range, outcome)
            speed = limits.get(joint) or self._default_speed(joint, reading)
            cap = facts.max_velocity if full_speed else self.speed_cap(joint, reading)
            speed = self._limit(joint, speed, (-cap, cap), _too_fast, outcome)
            self._set_goal(joint, Goal(safe, speed), client)
        for pair in self._couplings:
            if pair.leader in wanted:
                target, speed = self._goals[pair.leader]
                self._set_goal(pair.follower, Goal(pair.of(target), abs(pair.ratio) * speed), client)
        self._clear_tables(wanted, reading, client, outcome)
        self._leave_time(wanted, reading, outcome)
        self._command(wanted, reading, outcome)
        outcome.accepted = {joint: self._goals[joint].target for joint in targets}
        return outcome

    def safe_velocities(
        self, velocities: Mapping[str, float], reading: JointReading, client: str, now: float
    ) -> LimitedCommand:
        """Move joints at `velocities` until `now` plus the timeout, in steady wall time.

        Raises InvalidCommand, and then commands nothing.
        """
        wanted = self.check(velocities, sentence("velocity"))
        outcome = LimitedCommand(limitations=couple(wanted, self._rates))
        self._wake(reading)
        deadline = now + self.options.velocity_timeout
        for joint, velocity in wanted.items():
            cap = self.speed_cap(joint, reading)
            target = self._limit(joint, velocity, (-cap, cap), _too_fast, outcome)
            reached = self._drives[joint].velocity if joint in self._drives else 0.0
            for former in (self._goals, self._clients, self._issued):
                former.pop(joint, None)
            self._drives[joint] = _Drive(target, reached, deadline, client)
        for pair in self._couplings:
            if pair.leader in wanted:
                self._drives[pair.follower].target = pair.ratio * self._drives[pair.leader].target
        for table in self._tables:
            dependent = table.dependent
            if table.independent in wanted and dependent not in self._goals and dependent not in self._drives:
                self._stay(dependent, reading)
        outcome.accepted = {joint: self._drives[joint].target for joint in velocities}
        self._command(wanted, reading, outcome)
        return outcome

    def safe_stiffnesses(self, stiffnesses: Mapping[str, float]) -> dict[str, float]:
        """Return the stiffness of each motor that a command changes.

        Raises InvalidCommand unless every stiffness is from 0 to 1.
        """
        wanted = self.check(stiffnesses, sentence("stiffness"))
        for joint, value in wanted.items():
            if not 0.0 <= value <= 1.0:
                raise InvalidCommand(joint, f"{joint}: a stiffness of {value:g} is not from 0 to 1")
        couple(wanted, self._stiffnesses)
        return wanted

    def with_coupled(self, joints: Iterable[str]) -> tuple[str, ...]:
        """Return joints, in their order, and all that share a motor with them."""
        found = list(joints)
        for pair in self._couplings:
            if pair.leader in found or pair.follower in found:
                found += (pair.leader, pair.follower)
        return tuple(dict.fromkeys(found))

    def forget(self, joint: str) -> None:
        """Leave a joint to something else: nothing that was commanded to it before goes on."""
        for former in (self._drives, self._goals, self._clients, self._issued):
            former.pop(joint, None)

    def hold(self, joints: Iterable[str], reading: JointReading) -> LimitedCommand:
        """Stop joints at once, wherever they are, except passive ones."""
        outcome = LimitedCommand()
        for joint in joints:
            if joint not in self._passive:
                self._hold(joint, reading, outcome)
        return outcome

    def moves_for(self, client: str, reading: JointReading) -> bool:
        """Return whether a client drives a joint by velocity, or one is on the way to a goal that it set.

        A joint that is limp, or whose servo is lost, comes to no goal: it moves for nobody.
        """
        joints = [joint for joint, drive in self._drives.items() if drive.client == client]
        joints += self._sent_by(client, reading)
        faults = reading.faults
        return any(
            reading.stiffnesses[self._index[joint]] >= LIMP and not (joint in faults and faults[joint].lost)
            for joint in joints
        )

    def drop_client(self, client: str, reading: JointReading) -> LimitedCommand:
        """Hold the joints that a lost client moves."""
        outcome = LimitedCommand()
        sent = self._sent_by(client, reading)
        self._stop(lambda drive: drive.client == client, reading, outcome)
        for joint in sent:
            outcome.stopped.append(joint)
            self._hold(joint, reading, outcome)
        return outcome

    def watch(self, reading: JointReading, now: float) -> LimitedCommand:
        """Check the moving joints: stop expired velocities, continue ramps, keep clear of limits."""
        outcome = LimitedCommand()
        self._stop(lambda drive: now >= drive.deadline, reading, outcome)
        self._command((), reading, outcome)
        return outcome

    def next_watch(self, reading: JointReading, now: float) -> float | None:
        """Return the wall seconds until `watch` is due; None while none of the joints it checks moves."""
        if self._drives:
            first = min(drive.deadline for drive in self._drives.values())
            return min(self.options.period, max(0.0, first - now))
        return self.options.period if self._at_work(reading) else None

    def _clear_tables(
        self, wanted: Mapping[str, float], reading: JointReading, client: str, outcome: LimitedCommand
    ) -> None:
        """Clamp goals to the range that the other joint's goal leaves, also goals of joints not named."""
        for table in self._tables:
            joint = table.dependent
            if (table.independent not in wanted and joint not in wanted) or joint in self._drives:
                continue
            if joint not in self._goals:
                self._stay(joint, reading)
            goal, other = self._goals[joint], self._goals.get(table.independent)
            limits = table.at(other.target if other else self._setpoint(table.independent, reading))
            problem = partial(_would_hit, table.independent)
            safe = self._limit(joint, goal.target, limits, problem, outcome)
            if safe != goal.target:
                self._set_goal(joint, Goal(safe, goal.speed), self._clients[joint] or client)

    def _leave_time(
        self, wanted: Mapping[str, float], reading: JointReading, outcome: LimitedCommand
    ) -> None:
        """Slow down a joint that would approach before the other, at full speed, is out of the way."""
        for table in self._tables:
            joint, other = table.independent, table.dependent
            if joint not in wanted or table.steepest == 0.0:
                continue
            goal = self._goals[joint]
            way = table.over((self._setpoint(joint, reading), goal.target))
            safe = self.speed_cap(other, reading) / table.steepest
            if safe < goal.speed and not _is_within(self._setpoint(other, reading), way):
                what = sentence(f"speed {goal.speed:.4g} leaves {other} no time to make way")
                outcome.limitations.append(Limitation(joint, sentence(f"{what}, limited to {safe:.4g}")))
                self._goals[joint] = Goal(goal.target, safe)

    # -- the rules --------------------------------------------------------------------------------------

    def check(self, values: Mapping[str, float], what: str) -> dict[str, float]:
        """Return a copy of the values.

        Raises InvalidCommand for an unknown or a passive joint, or a value not finite.
        """
        for joint, value in values.items():
            if joint not in self._facts:
                name = joint[:_LONGEST_NAME]
                raise InvalidCommand(name, f"there is no joint {name!r}; there are {', '.join(self._facts)}")
            if joint in self._passive:
                raise InvalidCommand(joint, f"{joint} has no motor: it moves with what touches it")
            if not math.isfinite(value):
                raise InvalidCommand(joint, f"{joint}: a {what} of {value} is not a finite number")
        return dict(values)

    def speed_cap(self, joint: str, reading: JointReading) -> float:
        """Return the highest speed that a command gets at a reading, in rad/s or m/s."""
        fraction = self.options.speed_fraction
        for rule in self._speed_rules.get(joint, ()):
            if all(
                reading.positions[self._index[other]] < below for other, below in rule.while_below.items()
            ):
                fraction = min(fraction, rule.fraction)
        return fraction * self._facts[joint].max_velocity

    def _default_speed(self, joint: str, reading: JointReading) -> float:
        """Return the speed of a position command that gives none, at most the cap."""
        speed = self.options.default_fraction * self._facts[joint].max_velocity
        return min(speed, self.speed_cap(joint, reading))

    def _limit(
        self,
        joint: str,
        value: float,
        limits: tuple[float, float],
        problem: Callable[[float], str],
        outcome: LimitedCommand,
    ) -> float:
        """Return a value clamped to limits; `problem` describes one outside them."""
        lower, upper = limits
        if lower <= value <= upper:
            return value
        safe = clamp(value, lower, upper)
        if abs(safe - value) > _ROUNDING:
            what = problem(value)
            outcome.limitations.append(Limitation(joint, sentence(f"{what}, limited to {safe:.4g}")))
        return safe

    # -- commands to the joints --------------------------------------------------------------------------

    def _set_goal(self, joint: str, goal: Goal, client: str) -> None:
        self._drives.pop(joint, None)
        self._goals[joint] = goal
        self._clients[joint] = client
        self._issued.pop(joint, None)
        self._resting.discard(joint)
        self._held_back.discard(joint)

    def _stay(self, joint: str, reading: JointReading) -> None:
        """Make the present position of a joint its goal, without a command to the device."""
        goal = Goal(self._setpoint(joint, reading), self._default_speed(joint, reading))
        self._set_goal(joint, goal, "")
        self._issued[joint] = (goal.target, goal.speed)
        self._resting.add(joint)

    def _hold(self, joint: str, reading: JointReading, outcome: LimitedCommand) -> None:
        self._stay(joint, reading)
        outcome.velocities[joint] = 0.0
        for table in self._tables:
            goal = self._goals.get(table.dependent)
            if table.independent == joint and goal is not None:
                safe = clamp(goal.target, *table.at(self._setpoint(joint, reading)))
                self._goals[table.dependent] = Goal(safe, goal.speed)

    def _sent_by(self, client: str, reading: JointReading) -> list[str]:
        """Return the joints on the way to a goal that a client set."""
        return self._moving([joint for joint, sender in self._clients.items() if sender == client], reading)

    def _stop(self, which: Callable[[_Drive], bool], reading: JointReading, outcome: LimitedCommand) -> None:
        """Hold the joints with some velocities."""
        for joint, drive in list(self._drives.items()):
            if which(drive):
                if drive.target != 0.0:
                    outcome.stopped.append(joint)
                self._hold(joint, reading, outcome)

    def _command(self, named: Iterable[str], reading: JointReading, outcome: LimitedCommand) -> None:
        """Fill in the commands to the device: for joints that are named, driven, or subject to a table."""
        elapsed = max(0.0, reading.time - self._time)
        self._time = reading.time
        horizon = max(1.5 * elapsed, self.options.period)  # robot seconds that pass before the next check
        for joint, drive in list(self._drives.items()):
            step = self._facts[joint].max_velocity / self.options.ramp_time * elapsed
            if joint in self._held_back and drive.velocity * drive.target <= 0.0:
                drive.velocity = 0.0  # it is at its limit: it rests there, and moves back from rest
            drive.velocity += clamp(drive.target - drive.velocity, -step, step)
            if drive.velocity == drive.target == 0.0:
                self._hold(joint, reading, outcome)
            else:
                self._command_drive(joint, drive.velocity, horizon, reading, outcome)
        for joint in dict.fromkeys((*named, *self._table_of)):
            goal = self._goals.get(joint)
            if goal is not None:
                limits = self._range(joint, horizon, reading)
                safe = clamp(goal.target, *limits)
                if safe == goal.target:
                    self._held_back.discard(joint)
                    setpoint = self._setpoint(joint, reading)
                    if _is_within(setpoint, limits):
                        self._issue_position(joint, safe, goal.speed, outcome)
                    else:  # the other joint approaches: get out of its way first, however slow the goal
                        cap = self.speed_cap(joint, reading)
                        self._issue_position(joint, clamp(setpoint, *limits), cap, outcome)
                    continue
                other = self._table_of[joint].independent if joint in self._table_of else None
                if other in self._drives:  # on the way to a goal it is not reported: the goal was accepted
                    self._report_once(
                        joint, sentence(f"kept at {safe:.4g}, clear of what {other} brings near"), outcome
                    )
                self._issue_position(joint, safe, self.speed_cap(joint, reading), outcome)

    def _command_drive(
        self, joint: str, velocity: float, horizon: float, reading: JointReading, outcome: LimitedCommand
    ) -> None:
        lower, upper = self._range(joint, horizon, reading)
        setpoint = self._setpoint(joint, reading)
        ahead = setpoint + velocity * horizon
        inside = _is_within(setpoint, (lower, upper))
        end = clamp(ahead if inside else setpoint, lower, upper)
        if not inside or end != ahead:
            if not inside or abs(end - setpoint) <= _REACHED:
                self._report_once(joint, sentence(f"stopped at its limit {end:.4g}"), outcome)
            speed = abs(velocity) if inside else self.speed_cap(joint, reading)
            self._issue_position(joint, end, speed, outcome)
            return
        self._held_back.discard(joint)
        if self._issued.get(joint) != velocity:
            self._issued[joint] = velocity
            outcome.velocities[joint] = velocity

    def _issue_position(self, joint: str, target: float, speed: float, outcome: LimitedCommand) -> None:
        if self._issued.get(joint) != (target, speed):
            self._issued[joint] = (target, speed)
            outcome.velocities.pop(joint, None)
            outcome.positions[joint] = target
            outcome.max_speeds[joint] = speed

    def _report_once(self, joint: str, reason: str, outcome: LimitedCommand) -> None:
        if joint not in self._held_back:
            self._held_back.add(joint)
            outcome.limitations.append(Limitation(joint, reason))

    # -- where the joints are ----------------------------------------------------------------------------

    def _setpoint(self, joint: str, reading: JointReading) -> float:
        return reading.commands[self._index[joint]]

    def _range(self, joint: str, horizon: float, reading: JointReading) -> tuple[float, float]:
        """Return the range in which the joint may be until `horizon` robot seconds from now."""
        facts = self._facts[joint]
        table = self._table_of.get(joint)
        if table is None:
            return facts.lower, facts.upper
        other = table.independent
        setpoint = self._setpoint(other, reading)
        if (drive := self._drives.get(other)) is not None:
            step = drive.velocity * horizon
        elif (goal := self._goals.get(other)) is not None:
            step = clamp(goal.target - setpoint, -goal.speed * horizon, goal.speed * horizon)
        else:
            step = 0.0
        angles = [setpoint, setpoint + step]
        if abs(reading.positions[self._index[other]] - setpoint) > _SAG:
            angles.append(reading.positions[self._index[other]])
        lower, upper = table.over(angles)
        return max(lower, facts.lower), min(upper, facts.upper)

    def _wake(self, reading: JointReading) -> None:
        """After a rest, begin ramps and look-ahead with one period, no matter how long the rest was."""
        if not self._at_work(reading):
            self._time = reading.time - self.options.period

    def _at_work(self, reading: JointReading) -> bool:
        """Return whether joints move that `watch` checks: those with a velocity or a table."""
        return bool(self._drives or self._moving(self._tabled & self._goals.keys(), reading))

    def _moving(self, joints: Iterable[str], reading: JointReading) -> list[str]:
        """Return the joints, of some with goals, that are on the way to them."""
        return [
            joint
            for joint in joints
            if joint not in self._resting
            and abs(reading.commands[self._index[joint]] - self._goals[joint].target) > _REACHED
        ]


def _is_within(setpoint: float, limits: tuple[float, float]) -> bool:
    return limits[0] - _REACHED <= setpoint <= limits[1] + _REACHED
