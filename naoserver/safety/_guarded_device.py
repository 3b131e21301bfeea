"""A device behind its safety layer: the only way for servants to command and claim joints."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterable, Mapping
from typing import Final

from interfaces.nao import Severity
from naoserver.bodies.parts import JointFacts
from naoserver.errors import InvalidCommand, JointTaken
from naoserver.protocol.robot import JointDevice, JointFault, JointReading
from naoserver.safety._gate import Gate
from naoserver.safety._limits import Goal, JointSafety, LimitedCommand
from zenoh_ice.data.text import few, sentence

_logger = logging.getLogger(__name__)


class Claims:
    """Claims on the joints of a device by activities, such as "the walk". Thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._claims: dict[str, tuple[frozenset[str], Callable[[], None]]] = {}

    def claim(self, activity: str, joints: Iterable[str], stop: Callable[[], None]) -> None:
        """Claim joints for an activity, in place of its earlier ones.

        `stop` is called when one of them must hold still: it ends the activity.
        Raises JointTaken, and then claims nothing, while another activity has one of them.
        """
        wanted = frozenset(joints)
        with self._lock:
            self.check(wanted, activity)
            self._claims[activity] = (wanted, stop)

    def release(self, activity: str) -> frozenset[str]:
        """Release the joints of an activity; return those that it had."""
        with self._lock:
            joints, _ = self._claims.pop(activity, (frozenset[str](), None))
        return joints

    def check(self, joints: Iterable[str], activity: str = "") -> None:
        """Raise JointTaken if another activity has one of the joints."""
        with self._lock:
            for joint in joints:
                for name, (claimed, _) in self._claims.items():
                    if name != activity and joint in claimed:
                        what = name.removesuffix(f" to {joint}")  # it claims each joint for itself
                        raise JointTaken(joint, name, f"{joint} is moved by {what} now: stop it first")

    def taken(self) -> frozenset[str]:
        """Return the joints that activities have."""
        with self._lock:
            return frozenset().union(*(joints for joints, _ in self._claims.values()))

    def stop(self, joints: Iterable[str]) -> frozenset[str]:
        """Stop the activities that have any of the joints; return the joints that they still have."""
        wanted = frozenset(joints)
        with self._lock:
            claims = [claim for claim in self._claims.values() if claim[0] & wanted]
        for claimed, stop in claims:
            try:
                stop()
            except (Exception, SystemExit):  # stop the others and the joints anyway
                _logger.exception("cannot stop what moves %s", ", ".join(sorted(claimed)))
        return wanted & self.taken()


class GuardedDevice:
    """Pass commands through `safety` to `device`, one at a time, and log its changes as events.

    `gate` accepts each command or refuses it with CommandRefused; a hold is never refused. The client of a
    command is the caller, as known to the gate; an empty client cannot hold a lease.
    `check_within` is called after a command with the wall seconds within which `watch` is due.
    """

    def __init__(
        self, device: JointDevice, safety: JointSafety, gate: Gate, check_within: Callable[[float], None]
    ) -> None:
        self.name: Final = device.name
        self.joints: Final = device.joints
        self.read: Final = device.read
        """Return the newest snapshot of the joints without blocking."""
        self.with_coupled: Final = safety.with_coupled
        """Return joints, in their order, and all that share a motor with them."""
        self.check: Final = safety.check
        self._device = device
        self._safety = safety
        self.gate: Final = gate
        self.events: Final = gate.events
        self.check_within: Final = check_within
        self._lock = threading.Lock()
        self._closed = False
        self._unsure: set[str] = set()
        """Joints whose newest command failed: the device may move them, and is to hold them."""
        self.claims: Final = Claims()
        """The joints of running activities, which alone may command them."""
        self.balancing: Callable[[], Iterable[str]] = tuple
        """Return the joints by which the robot keeps its balance now: only motions and postures move them."""
        self._index = {joint.name: index for index, joint in enumerate(device.joints)}

    def facts(self, joint: str) -> JointFacts:
        """Return the limits of a joint."""
        return self.joints[self._index[joint]]

    def speed_cap(self, joint: str) -> float:
        """Return the highest speed that a command of a joint gets now, in rad/s or m/s."""
        return self._safety.speed_cap(joint, self.read())

    def index(self, joint: str) -> int:
        """Return the place of a joint in every reading."""
        return self._index[joint]

    def angles(self, *, measured: bool) -> dict[str, float]:
        """Return the measured angle, or else the setpoint, of every joint by name, in rad or m."""
        reading = self.read()
        return dict(zip(self._index, reading.positions if measured else reading.commands, strict=True))

    def goal(self, joint: str) -> Goal:
        """Return target and speed of the joint's position command; without one, its setpoint and 0."""
        with self._lock:
            goal = self._safety.goal(joint)
        return goal or Goal(self.read().commands[self._index[joint]], 0.0)

    def velocity(self, joint: str) -> float:
        """Return the velocity that the joint is commanded to reach."""
        with self._lock:
            return self._safety.velocity(joint)

    def move(
        self,
        targets: Mapping[str, float],
        speeds: Mapping[str, float],
        *,
        client: str = "",
        activity: str = "",
    ) -> LimitedCommand:
        """Send joints to targets. Raises InvalidCommand or CommandRefused, and then commands nothing.

        An `activity` may command joints that it has claimed, at full speed; it then ends the motion itself
        when its client is lost.
        """

        def command(reading: JointReading) -> LimitedCommand:
            self._admit(targets, reading, client, activity)
            sender = "" if activity else client
            return self._safety.safe_goals(targets, speeds, reading, sender, full_speed=bool(activity))

        return self._obey(command)

    def drive(self, velocities: Mapping[str, float], client: str) -> LimitedCommand:
        """Move joints at velocities until the timeout.

        Raises InvalidCommand or CommandRefused, and then commands nothing.
        """
        now = self.events.wall_time()

        def command(reading: JointReading) -> LimitedCommand:
            self._admit(velocities, reading, client)
            return self._safety.safe_velocities(velocities, reading, client, now)

        return self._obey(command)

    def hold(self, joints: Iterable[str] | None = None) -> None:
        """Stop joints at once, or all; joints that one motor drives stop together.

        The activity that has claimed one is asked to end; it keeps the joints that it still needs for that.
        """
        names = self.with_coupled(self._index if joints is None else joints)
        left = self.claims.stop(names)
        names = tuple(name for name in names if name not in left)
        self._obey(lambda reading: self._safety.hold(names, reading))

    def free(self, activity: str) -> None:
        """Release the joints of an activity, and hold them where they are.

        The next activity can command them only after that.
        """
        with self._lock:
            if joints := self.claims.release(activity):
                self._apply(self._safety.hold(joints, self.read()))

    def forget(self, joint: str) -> None:
        """Leave a joint to the activity that has claimed it, and that moves it without setpoints."""
        with self._lock:
            self._safety.forget(joint)

    def stiffen(
        self, stiffnesses: Mapping[str, float], seconds: float, *, client: str = "", activity: str = ""
    ) -> dict[str, float]:
        """Change how strongly joints hold; return the stiffnesses that were set.

        With `activity`, for a motion that may outlive its client, as in `move`. Raises InvalidCommand or
        CommandRefused, and then changes nothing.
        """
        with self._lock:
            self.gate.require(client, begun=bool(activity))
            require_reached(stiffnesses, self.read().faults)
            safe = self._safety.safe_stiffnesses(stiffnesses)
            if not self._closed:
                self._device.command_stiffnesses(safe, seconds)
        return {joint: safe[joint] for joint in stiffnesses}

    def moves_for(self, client: str) -> bool:
        """Return whether joints still move because a client commanded it."""
        with self._lock:
            return self._safety.moves_for(client, self.read())

    def drop_client(self, client: str) -> None:
        """Hold the joints that a lost client moves."""
        outcome = self._obey(lambda reading: self._safety.drop_client(client, reading))
        if outcome.stopped:
            message = sentence(f"stopped {few(outcome.stopped)}: the client that commanded it is gone")
            self.events.add(Severity.Warning, self.name, message, "lost")

    def watch(self) -> float | None:
        """Check the moving joints; return the wall seconds until the next check, None while all rest."""
        with self._lock:
            reading, now = self.read(), self.events.wall_time()
            if self._unsure:
                self._apply(self._safety.hold(sorted(self._unsure - self.claims.taken()), reading))
            outcome = self._apply(self._safety.watch(reading, now))
            due = self._safety.next_watch(reading, now)
        if outcome.stopped:
            self.events.count_timeout()
        timeout = self._safety.options.velocity_timeout
        for joint in outcome.stopped:
            message = sentence(f"stopped: its velocity was not renewed within {timeout:g} s")
            self.events.add(Severity.Warning, joint, message, "timeout")
        self.events.add_limited(outcome.limitations)
        return due

    def close(self) -> None:
        """Stop all joints and refuse further motion.

        Joints that an activity still moves, such as the legs in the last step of a walk, are left to it.
        """
        if self._closed:
            return
        left = self.claims.stop(self._index)
        with self._lock:
            joints = [name for name in self._index if name not in left]
            self._apply(self._safety.hold(joints, self.read()))
            self._closed = True

    def _admit(
        self, joints: Mapping[str, float], reading: JointReading, client: str, activity: str = ""
    ) -> None:
        """Raise CommandRefused or InvalidCommand unless the joints may be commanded now."""
        self.gate.require(client, begun=bool(activity))
        self.claims.check(joints, activity)
        if not activity and (balancing := joints.keys() & set(self.balancing())):
            joint = min(balancing)  # moved alone, it would let the robot fall
            raise InvalidCommand(
                joint,
                f"{joint} keeps the robot upright: use postures or motions, or make its legs limp",
            )
        if reading.faults:
            require_reached(joints, reading.faults)

    def _obey(self, command: Callable[[JointReading], LimitedCommand]) -> LimitedCommand:
        due: float | None = None
        try:
            with self._lock:
                reading = self.read()
                outcome = self._apply(command(reading))
                due = self._safety.next_watch(reading, self.events.wall_time())
        finally:
            if due is not None or self._unsure:
                self.check_within(due or 0.0)
        if outcome.limitations:
            self.events.add_limited(outcome.limitations)
        return outcome

    def _apply(self, outcome: LimitedCommand) -> LimitedCommand:
        if not self._closed:
            joints = outcome.positions.keys() | outcome.velocities.keys()
            self._unsure |= joints
            if outcome.positions:
                self._device.command_positions(outcome.positions, outcome.max_speeds)
            if outcome.velocities:
                self._device.command_velocities(outcome.velocities)
            self._unsure -= joints
        return outcome


def require_reached(joints: Iterable[str], faults: Mapping[str, JointFault]) -> None:
    """Raise InvalidCommand if the servo of a joint is lost."""
    for joint in joints:
        if (fault := faults.get(joint)) is not None and fault.lost:
            raise InvalidCommand(joint, f"{joint} is not reached: {fault.message}; command other joints")
