"""The operations of ALMotion that move joints, or tell where they are."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from naoserver.errors import InvalidCommand
from naoserver.qi_service.access import Access
from naoserver.qi_service.calls import Call, long_call
from naoserver.qi_service.chains import joints_of
from naoserver.qi_service.joint_motion import PERIOD, JointMotion
from naoserver.qi_service.trajectory import BezierKey, BezierTrajectory, SmoothTrajectory, Trajectory
from naoserver.qi_service.values import fraction, listed, number, number_lists, numbers

__all__ = ["JointOperations"]

_PEAK = 1.5
"""How many times as fast as on average a cubic from rest to rest is in its middle."""


class JointOperations:
    """Read and move joints. The safety layer caps every speed: what is too fast takes longer."""

    def __init__(self, access: Access, motion: JointMotion) -> None:
        self._body = access.body
        self._motion = motion

    def setAngles(self, names: object, angles: object, maxSpeedFraction: object) -> None:
        """Send joints to angles in rad at a fraction of their full speed; returns at once."""
        joints = joints_of(names)
        self._send(joints, numbers(angles, "angles", len(joints)), fraction(maxSpeedFraction, "the fraction"))

    def changeAngles(self, names: object, changes: object, maxSpeedFraction: object) -> None:
        """Send joints to angles beside where they are commanded to be; returns at once."""
        joints = joints_of(names)
        commands = self._motion.commands()
        targets = [
            commands[joint] + change
            for joint, change in zip(joints, numbers(changes, "changes", len(joints)), strict=True)
        ]
        self._send(joints, targets, fraction(maxSpeedFraction, "the fraction"))

    def getAngles(self, names: object, useSensors: object) -> list[float]:
        """Return where joints are in rad, or where they are commanded to be."""
        reading = self._body.read()
        values = reading.positions if useSensors else reading.commands
        return [values[self._body.index(joint)] for joint in joints_of(names)]

    @long_call
    def angleInterpolation(
        self, call: Call, names: object, angleLists: object, timeLists: object, isAbsolute: object
    ) -> None:
        """Move joints smoothly through angles at times in s; returns when they are there."""
        joints = joints_of(names)
        angles = number_lists(angleLists, "angleLists", len(joints))
        times = number_lists(timeLists, "timeLists", len(joints))

        def paths() -> dict[str, Trajectory]:
            commands = self._motion.commands()
            return {
                joint: SmoothTrajectory(
                    joint,
                    commands[joint],
                    times[i],
                    [angle if isAbsolute else commands[joint] + angle for angle in angles[i]],
                )
                for i, joint in enumerate(joints)
            }

        self._follow(call, "angleInterpolation", joints, paths)

    @long_call
    def angleInterpolationWithSpeed(
        self, call: Call, names: object, targetAngles: object, maxSpeedFraction: object
    ) -> None:
        """Move joints to angles, the slowest at a fraction of its full speed; returns when they are there."""
        joints = joints_of(names)
        targets = numbers(targetAngles, "targetAngles", len(joints))
        share = fraction(maxSpeedFraction, "the fraction")

        def paths() -> dict[str, Trajectory]:
            commands = self._motion.commands()
            duration = PERIOD
            for joint, target in zip(joints, targets, strict=True):
                speed = min(share * self._body.facts(joint).max_velocity, self._body.speed_cap(joint))
                duration = max(duration, _PEAK * abs(target - commands[joint]) / speed)
            return {
                joint: SmoothTrajectory(joint, commands[joint], [duration], [target])
                for joint, target in zip(joints, targets, strict=True)
            }

        self._follow(call, "angleInterpolationWithSpeed", joints, paths)

    @long_call
    def angleInterpolationBezier(
        self, call: Call, jointNames: object, times: object, controlPoints: object
    ) -> None:
        """Move joints along Bezier curves, as Choregraphe exports them; returns when they are there."""
        joints = joints_of(jointNames)
        moments = number_lists(times, "times", len(joints))
        points = listed(controlPoints, "controlPoints")
        if len(points) != len(joints):
            message = f"controlPoints has {len(points)} entries for {len(joints)} joints"
            raise InvalidCommand("controlPoints", message)
        keys = [_bezier_keys(joint, moments[i], points[i]) for i, joint in enumerate(joints)]

        def paths() -> dict[str, Trajectory]:
            commands = self._motion.commands()
            return {
                joint: BezierTrajectory(joint, commands[joint], keys[i]) for i, joint in enumerate(joints)
            }

        self._follow(call, "angleInterpolationBezier", joints, paths)

    @long_call
    def openHand(self, call: Call, handName: object) -> None:
        """Open a hand, `LHand` or `RHand`; returns when it is open."""
        self.angleInterpolationWithSpeed(call, handName, 1.0, 1.0)

    @long_call
    def closeHand(self, call: Call, handName: object) -> None:
        """Close a hand, `LHand` or `RHand`; returns when it is closed."""
        self.angleInterpolationWithSpeed(call, handName, 0.0, 1.0)

    def _send(self, joints: Sequence[str], targets: Sequence[float], share: float) -> None:
        self._motion.take(joints)
        speeds = {joint: share * self._body.facts(joint).max_velocity for joint in joints}
        self._body.move(dict(zip(joints, targets, strict=True)), speeds)

    def _follow(
        self, call: Call, name: str, joints: Sequence[str], paths: Callable[[], dict[str, Trajectory]]
    ) -> None:
        with self._motion.task(name, joints, call) as task:
            if joints and not call.stopped.is_set():
                self._motion.follow(task, paths())


def _bezier_keys(joint: str, times: Sequence[float], points: object) -> list[BezierKey]:
    entries = listed(points, "controlPoints")
    if len(entries) != len(times):
        raise InvalidCommand(joint, f"{joint}: there are {len(entries)} keys for {len(times)} times")
    keys = []
    for time, entry in zip(times, entries, strict=True):
        parts = listed(entry, "controlPoints") if isinstance(entry, (list, tuple)) else [entry]
        if not parts:
            raise InvalidCommand(joint, f"{joint}: a key has no angle")
        keys.append(BezierKey(time, number(parts[0], "an angle"), *(_handle(part) for part in parts[1:3])))
    return keys


def _handle(part: object) -> tuple[float, float]:
    values = listed(part, "a handle")
    if len(values) != 3:
        message = f"a handle has {len(values)} entries, not 3: the kind of interpolation, time and angle"
        raise InvalidCommand("controlPoints", message)
    return number(values[1], "a handle's time"), number(values[2], "a handle's angle")
