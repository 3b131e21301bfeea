"""ALMotion: joints, stiffness, and what is known of the body."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from naoserver.errors import InvalidCommand
from naoserver.qi_service.access import Access
from naoserver.qi_service.calls import Call, long_call
from naoserver.qi_service.chains import joints_of
from naoserver.qi_service.joint_motion import PERIOD, JointMotion
from naoserver.qi_service.trajectory import BezierKey, BezierTrajectory, SmoothTrajectory, Trajectory
from naoserver.qi_service.values import fraction, listed, number, numbers

__all__ = ["ALMotion"]


class ALMotion:
    """Read and move joints.

    Speeds are capped by the safety layer: what is too fast takes longer.
    """

    def __init__(self, access: Access, motion: JointMotion) -> None:
        self._body = access.body
        self._motion = motion

    # -- joints ------------------------------------------------------------------------------------------

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
        angles = _lists(angleLists, "angleLists", len(joints))
        times = _lists(timeLists, "timeLists", len(joints))

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
            # A cubic from rest to rest is 1.5 times as fast in its middle as on average.
            duration = max(
                1.5 * abs(target - commands[joint]) / min(share * self._full(joint), self._cap(joint))
                for joint, target in zip(joints, targets, strict=True)
            )
            duration = max(duration, PERIOD)
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
        moments = _lists(times, "times", len(joints))
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

    # -- stiffness ---------------------------------------------------------------------------------------

    def setStiffnesses(self, names: object, stiffnesses: object) -> None:
        """Let joints hold from 0, limp, to 1; returns at once."""
        joints = joints_of(names)
        values = numbers(stiffnesses, "stiffnesses", len(joints))
        self._body.stiffen(dict(zip(joints, values, strict=True)), 0.0)

    def getStiffnesses(self, names: object) -> list[float]:
        """Return how strongly joints hold, from 0 to 1."""
        values = self._body.read().stiffnesses
        return [values[self._body.index(joint)] for joint in joints_of(names)]

    @long_call
    def stiffnessInterpolation(
        self, call: Call, names: object, stiffnessLists: object, timeLists: object
    ) -> None:
        """Change how strongly joints hold, evenly from key to key at times in s; returns at the last."""
        joints = joints_of(names)
        values = _lists(stiffnessLists, "stiffnessLists", len(joints))
        times = _lists(timeLists, "timeLists", len(joints))
        keys: dict[float, dict[str, tuple[float, float]]] = {}  # begin, joint: stiffness, seconds
        for i, joint in enumerate(joints):
            path = SmoothTrajectory(joint, 0.0, times[i], values[i])  # checks the keys
            begins = [0.0, *times[i]]
            for begin, end, value in zip(begins, times[i], values[i], strict=False):
                keys.setdefault(begin, {})[joint] = (value, end - begin)
            keys.setdefault(path.duration, {})
        now = 0.0
        for begin in sorted(keys):
            if call.wait(begin - now):
                return
            now = begin
            for joint, (value, seconds) in keys[begin].items():
                self._body.stiffen({joint: value}, seconds)

    # -- tasks -------------------------------------------------------------------------------------------

    def getTaskList(self) -> list[list[object]]:
        """Return name, number, broker and resources of each task that moves joints."""
        return [[task.name, task.number, "", sorted(task.joints)] for task in self._motion.tasks()]

    def areResourcesAvailable(self, resourceNames: object) -> bool:
        """Return whether no task moves any of some joints."""
        joints = joints_of(resourceNames)
        return all(task.joints.isdisjoint(joints) for task in self._motion.tasks())

    def killTask(self, motionTaskID: object) -> bool:
        """Break a task off; returns whether there was one."""
        tasks = [task for task in self._motion.tasks() if task.number == motionTaskID]
        self._motion.stop(tasks)
        return bool(tasks)

    def killTasksUsingResources(self, resourceNames: object) -> None:
        """Break off the tasks that move any of some joints."""
        joints = joints_of(resourceNames)
        self._motion.stop(task for task in self._motion.tasks() if not task.joints.isdisjoint(joints))

    def killAll(self) -> None:
        """Break every task off and hold every joint where it is."""
        self._motion.stop(self._motion.tasks())
        self._body.hold()

    # -- the body ----------------------------------------------------------------------------------------

    def getBodyNames(self, name: object) -> list[str]:
        """Return the joints of a chain, such as `Body` or `LArm`."""
        return list(joints_of(name))

    def getJointNames(self, name: object) -> list[str]:
        """Return the joints of a chain, as NAOqi called it before getBodyNames."""
        return list(joints_of(name))

    def getLimits(self, name: object) -> list[list[float]]:
        """Return least and greatest angle in rad, full speed in rad/s and torque in N m of each joint."""
        facts = [self._body.facts(joint) for joint in joints_of(name)]
        return [[joint.lower, joint.upper, joint.max_velocity, joint.max_torque] for joint in facts]

    def getMotionCycleTime(self) -> int:
        """Return the period of the setpoints in ms."""
        return round(PERIOD * 1000)

    def getRobotConfig(self) -> list[list[object]]:
        """Return names and values of what the body consists of."""
        facts: dict[str, object] = {
            "Model Type": "naoH25",
            "Head Version": "VERSION_60",
            "Body Version": "VERSION_60",
            "Arm Version": "VERSION_60",
            "Laser": False,
            "Extended Arms": False,
            "Extended Hand": True,
            "Number of Legs": 2,
        }
        return [list(facts), list(facts.values())]

    def getSummary(self) -> str:
        """Return a table of joints with stiffness, command and position, for people."""
        reading = self._body.read()
        rows = zip(self._body.joints, reading.stiffnesses, reading.commands, reading.positions, strict=True)
        lines = [
            f"{joint.name:<16}{stiff:>10.2f}{command:>12.6f}{at:>12.6f}" for joint, stiff, command, at in rows
        ]
        return "\n".join([f"{'Joint':<16}{'Stiffness':>10}{'Command':>12}{'Sensor':>12}", *lines])

    # -- within ------------------------------------------------------------------------------------------

    def _full(self, joint: str) -> float:
        return self._body.facts(joint).max_velocity

    def _cap(self, joint: str) -> float:
        return self._body.speed_cap(joint)

    def _send(self, joints: Sequence[str], targets: Sequence[float], share: float) -> None:
        self._motion.take(joints)
        speeds = {joint: share * self._full(joint) for joint in joints}
        self._body.move(dict(zip(joints, targets, strict=True)), speeds)

    def _follow(
        self, call: Call, name: str, joints: Sequence[str], paths: Callable[[], dict[str, Trajectory]]
    ) -> None:
        with self._motion.task(name, joints, call) as task:
            if joints and not call.stopped.is_set():
                self._motion.follow(task, paths())


def _lists(value: object, what: str, count: int) -> list[list[float]]:
    """Return a list of numbers for each of `count` joints.

    NAOqi takes one number for all; a number or a list for each; and of one joint also its list alone.
    """
    if not isinstance(value, (list, tuple)):
        return [[number(value, what)] for _ in range(count)]
    entries = listed(value, what)
    if count == 1 and not any(isinstance(entry, (list, tuple)) for entry in entries):
        return [[number(entry, what) for entry in entries]]
    if len(entries) != count:
        raise InvalidCommand(what, f"{what} has {len(entries)} entries for {count} joints")
    return [
        [number(one, what) for one in listed(entry, what)]
        if isinstance(entry, (list, tuple))
        else [number(entry, what)]
        for entry in entries
    ]


def _bezier_keys(joint: str, times: Sequence[float], points: object) -> list[BezierKey]:
    entries = listed(points, "controlPoints")
    if len(entries) != len(times):
        raise InvalidCommand(joint, f"{joint}: there are {len(entries)} keys for {len(times)} times")
    keys = []
    for time, entry in zip(times, entries, strict=True):
        parts = listed(entry, "controlPoints") if isinstance(entry, (list, tuple)) else [entry]
        handles = [_handle(part) for part in parts[1:3]] + [(0.0, 0.0)] * (3 - len(parts))
        if not parts:
            raise InvalidCommand(joint, f"{joint}: a key has no angle")
        keys.append(BezierKey(time, number(parts[0], "an angle"), *handles))
    return keys


def _handle(part: object) -> tuple[float, float]:
    values = listed(part, "a handle")
    if len(values) != 3:
        message = f"a handle has {len(values)} entries, not 3: the kind of interpolation, time and angle"
        raise InvalidCommand("controlPoints", message)
    return number(values[1], "a handle's time"), number(values[2], "a handle's angle")
