"""ALMotion: joints, stiffness, the walk, and facts of the body."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import astuple
from functools import partial
from operator import mul
from typing import Final

from naoserver.bodies.capabilities import WalkVelocity
from naoserver.bodies.kinematics import numbers_of
from naoserver.errors import InvalidCommand
from naoserver.moves.effector_paths import curves_on_feet
from naoserver.moves.joint_paths import PERIOD, Curve, Key, Path, check_times, smooth_curve
from visualhfsm_naoqi._names import gait_limits
from visualhfsm_naoqi.programs._access import ROBOT, Access, Service
from visualhfsm_naoqi.programs._arguments import (
    Check,
    Operation,
    chosen,
    constant,
    fraction,
    kept,
    listed,
    number,
    number_lists,
    number_within,
    numbers,
    one_of,
    switch,
    text,
    texts,
    vector,
)
from visualhfsm_naoqi.programs._behaviors import ALRobotPosture
from visualhfsm_naoqi.programs._clients import CHECK_PERIOD, MOTION, Activity, Call, begins, begins_any

_PEAK: Final = 1.5
"""Ratio of the highest to the mean speed of a cubic from rest to rest."""
_WAKING: Final = 0.5
"""Robot seconds in which the motors of a limp robot become stiff."""
_RESTING: Final = 1.0
"""Robot seconds in which the motors of a crouching robot go limp."""
_PACE: Final = 0.8
_MOVE_CONFIG: Final = {
    "MaxStepX": (0.001, 0.04, 0.08),
    "MaxStepY": (0.101, 0.14, 0.16),
    "MaxStepTheta": (0.001, 0.349, 0.524),
    "MaxStepFrequency": (0.0, 1.0, 1.0),
    "StepHeight": (0.005, 0.02, 0.04),
    "TorsoWx": (-0.122, 0.0, 0.122),
    "TorsoWy": (-0.122, 0.0, 0.122),
}
"""Minimum, default and maximum of each parameter of NAOqi's gait; the parameters of steps limit the walk."""
_CONFIGS: Final = ("Min", "Default", "Max")
_ROBOT_CONFIG: Final[dict[str, object]] = {
    **dict.fromkeys(("Head Version", "Body Version", "Arm Version"), "VERSION_60"),
    "Laser": False,
    "Extended Arms": False,
    **dict.fromkeys(("Number of Legs", "Number of Arms"), 2),
}

_Paths = Callable[[dict[str, float]], dict[str, Curve]]
"""Curves of joints from their present angles."""


def _reflex(what: str, default: bool = True, **part: Check) -> tuple[Operation, Operation]:
    """Return the operations that set and get a switch of the robot, or of a part of it: a chain or joint."""
    return kept(f"whether {what} is enabled", default, result=bool(part) or None, **part, enable=switch)


class ALMotion(Service):
    """Move the robot. The safety layer limits every speed: a motion that is too fast takes longer."""

    def __init__(self, access: Access) -> None:
        super().__init__(access)
        self._body = access.body
        self._joints = access.joints
        self._paths = access.paths
        self._postures = access.service(ALRobotPosture)
        self._walking = access.walking

    # -- joints ------------------------------------------------------------------------------------------

    @begins(Activity.JOINTS)
    def setAngles(self, names: object, angles: object, maxSpeedFraction: object) -> None:
        """Send joints to angles in rad at a fraction of their full speed; returns at once."""
        joints = self._joints.of(names)
        self._send_joints(joints, numbers(angles, "angles", len(joints)), maxSpeedFraction)

    @begins(Activity.JOINTS)
    def changeAngles(self, names: object, changes: object, maxSpeedFraction: object) -> None:
        """Send joints to angles relative to their setpoints; returns at once."""
        joints = self._joints.of(names)
        setpoints = self._access.angles(measured=False)
        shifts = numbers(changes, "changes", len(joints))
        targets = [setpoints[joint] + shift for joint, shift in zip(joints, shifts, strict=True)]
        self._send_joints(joints, targets, maxSpeedFraction)

    def getAngles(self, names: object, useSensors: object) -> list[float]:
        """Return the angles of joints in rad as measured, or their setpoints."""
        angles = self._access.angles(measured=bool(useSensors))
        return [angles[joint] for joint in self._joints.of(names)]

    @begins(Activity.JOINTS)
    def angleInterpolation(
        self, call: Call, names: object, angleLists: object, timeLists: object, isAbsolute: object
    ) -> None:
        """Move joints smoothly through angles at times in s; returns when they are there."""
        joints = self._joints.of(names)
        angles = number_lists(angleLists, "angleLists", len(joints))
        times = number_lists(timeLists, "timeLists", len(joints))

        def paths(start: dict[str, float]) -> dict[str, Curve]:
            origins = dict.fromkeys(joints, 0.0) if isAbsolute else start
            return {
                joint: smooth_curve(joint, start[joint], moments, [origins[joint] + key for key in keys])
                for joint, keys, moments in zip(joints, angles, times, strict=True)
            }

        self._follow(call, "angleInterpolation", *self._on_feet(joints, paths))

    @begins(Activity.JOINTS)
    def angleInterpolationWithSpeed(
        self, call: Call, names: object, targetAngles: object, maxSpeedFraction: object
    ) -> None:
        """Move joints to angles, the slowest at a fraction of its full speed; returns when they are there."""
        joints = self._joints.of(names)
        targets = dict(zip(joints, numbers(targetAngles, "targetAngles", len(joints)), strict=True))
        share = fraction(maxSpeedFraction, "the fraction")

        def paths(start: dict[str, float]) -> dict[str, Curve]:
            duration = PERIOD
            for joint, target in targets.items():
                speed = min(share * self._body.facts(joint).max_velocity, self._body.speed_cap(joint))
                duration = max(duration, _PEAK * abs(target - start[joint]) / speed)
            return {
                joint: smooth_curve(joint, start[joint], [duration], [target])
                for joint, target in targets.items()
            }

        self._follow(call, "angleInterpolationWithSpeed", *self._on_feet(joints, paths))

    @begins(Activity.JOINTS)
    def angleInterpolationBezier(
        self, call: Call, jointNames: object, times: object, controlPoints: object
    ) -> None:
        """Move joints along Bezier curves, as Choregraphe exports them; returns when they are there."""
        joints = self._joints.of(jointNames)
        moments = number_lists(times, "times", len(joints))
        points = listed(controlPoints, "controlPoints", len(joints))
        keys = {joint: _bezier_keys(joint, moments[i], points[i]) for i, joint in enumerate(joints)}

        def paths(start: dict[str, float]) -> dict[str, Curve]:
            return {joint: Curve(joint, Key(0.0, start[joint]), keys[joint]) for joint in joints}

        self._follow(call, "angleInterpolationBezier", *self._on_feet(joints, paths))

    @begins(Activity.JOINTS)
    def openHand(self, call: Call, handName: object) -> None:
        """Open a hand, `LHand` or `RHand`; returns when it is open."""
        self.angleInterpolationWithSpeed(call, handName, 1.0, 1.0)

    @begins(Activity.JOINTS)
    def closeHand(self, call: Call, handName: object) -> None:
        """Close a hand, `LHand` or `RHand`; returns when it is closed."""
        self.angleInterpolationWithSpeed(call, handName, 0.0, 1.0)

    # -- stiffness ---------------------------------------------------------------------------------------

    @begins(Activity.JOINTS)
    def setStiffnesses(self, names: object, stiffnesses: object) -> None:
        """Set how strongly joints hold, from 0, limp, to 1; returns at once."""
        joints = self._joints.of(names)
        values = numbers(self._joints.spread(names, stiffnesses), "stiffnesses", len(joints))
        self._stiffen(dict(zip(joints, values, strict=True)), 0.0)

    def getStiffnesses(self, names: object) -> list[float]:
        """Return how strongly joints hold, from 0 to 1."""
        values = self._body.read().stiffnesses
        return [values[self._body.index(joint)] for joint in self._joints.of(names)]

    @begins(Activity.JOINTS)
    def stiffnessInterpolation(
        self, call: Call, names: object, stiffnessLists: object, timeLists: object
    ) -> None:
        """Change how strongly joints hold, evenly from key to key at times in s; returns at the last."""
        joints = self._joints.of(names)
        values = number_lists(self._joints.spread(names, stiffnessLists), "stiffnessLists", len(joints))
        times = number_lists(self._joints.spread(names, timeLists), "timeLists", len(joints))
        changes: list[tuple[float, str, float, float]] = []  # when, joint, stiffness, seconds
        for joint, own, moments in zip(joints, values, times, strict=True):
            check_times(joint, moments, len(own))
            begins = [0.0, *moments[:-1]]
            changes += [(b, joint, v, e - b) for b, e, v in zip(begins, moments, own, strict=True)]
        now = 0.0
        for begin, joint, value, seconds in sorted(changes):
            if call.wait(begin - now) or not self._stiffen({joint: value}, seconds, call):
                return
            now = begin
        call.wait(max((moments[-1] for moments in times), default=0.0) - now)

    @begins(Activity.JOINTS, Activity.POSTURE)
    def wakeUp(self, call: Call) -> None:
        """Make every motor stiff, and stand up; returns when the robot stands."""
        joints, values = self._joints.of("Body"), self.getStiffnesses("Body")
        if limp := {joint: 1.0 for joint, stiffness in zip(joints, values, strict=True) if stiffness < 1.0}:
            self._stiffen(limp, _WAKING, call)
            call.wait(_WAKING)
        self._postures.goToPosture(call, "Stand", _PACE)

    @begins(Activity.JOINTS, Activity.POSTURE, urgent=True)
    def rest(self, call: Call) -> None:
        """Crouch, and then let every motor go limp; returns when they are."""
        if max(self._body.read().stiffnesses) > 0.0:
            self._postures.goToPosture(call, "Crouch", _PACE)
        if self._stiffen(dict.fromkeys(self._joints.of("Body"), 0.0), _RESTING, call):
            call.wait(_RESTING)

    def robotIsWakeUp(self) -> bool:
        """Return whether all motors are stiff."""
        return min(self.getStiffnesses("Body")) > 0.0

    # -- the walk, as fast as that of a Nao with the parameters of its gait ---------------------------------

    @begins(Activity.WALK)
    def move(self, x: object, y: object, theta: object, *moveConfig: object) -> None:
        """Walk at a velocity in m/s and rad/s until further notice; returns at once."""
        wanted = WalkVelocity(number(x, "x"), number(y, "y"), number(theta, "theta"))
        self._walking.begin(wanted, self._walk_limits(moveConfig))

    @begins(Activity.WALK)
    def moveToward(self, x: object, y: object, theta: object, *moveConfig: object) -> None:
        """Walk at fractions, from -1 to 1, of the top velocities until further notice; returns at once."""
        shares = [number_within(v, what, -1.0, 1.0) for v, what in ((x, "x"), (y, "y"), (theta, "theta"))]
        highest = astuple(self._walk_limits(moveConfig))
        self._walking.begin(WalkVelocity(*map(mul, shares, highest)))

    @begins(Activity.WALK)
    def setWalkTargetVelocity(
        self, x: object, y: object, theta: object, frequency: object, *moveConfig: object
    ) -> None:
        """Walk as moveToward does, at a fraction of the highest frequency; its former name."""
        share = abs(number_within(frequency, "frequency", -1.0, 1.0))
        self.moveToward(x, y, theta, [["MaxStepFrequency", share]], *moveConfig)

    @begins(Activity.WALK)
    def moveTo(self, call: Call, *goal: object) -> bool:
        """Walk by x, y, theta in m and rad, or through a list of such; returns whether it arrived."""
        if goal and isinstance(goal[0], (list, tuple)):
            places, rest = listed(goal[0], "controlPoints"), goal[1:]
        else:
            places, rest = [list(goal[:3])], goal[3:]
        # A number is a duration in s, which older versions accepted.
        limits = self._walk_limits([config for config in rest if not isinstance(config, (int, float))])
        ways = [vector(place, "a place", 3) for place in places]
        start = self._walking.guard.read()
        return all(self._walking.go_to(call, (x, y, theta), start, limits) for x, y, theta in ways)

    def moveInit(self) -> None:
        """Do nothing, since the walk begins from any stance. Raises HardwareFailure when there is none."""
        _ = self._walking.guard

    def moveIsActive(self) -> bool:
        """Return whether it walks, or comes to a stand."""
        return self._walking.moving

    def waitUntilMoveIsFinished(self, call: Call) -> None:
        """Return when it stands."""
        while self._walking.moving and not call.wait(CHECK_PERIOD):
            pass

    def stopMove(self) -> None:
        """End the walk on both feet."""
        with self._access.calls.stopping(begins_any(Activity.WALK)):
            self._walking.stop()

    killMove = stopMove
    # Former names.
    walkTo = moveTo
    walkInit = moveInit
    walkIsActive = moveIsActive
    waitUntilWalkIsFinished = waitUntilMoveIsFinished
    stopWalk = stopMove
    killWalk = stopMove

    def getMoveConfig(self, config: object) -> list[list[object]]:
        """Return the parameters of NAOqi's gait: `Min`, `Default` or `Max`."""
        which = _CONFIGS.index(chosen(config, "configuration", _CONFIGS))
        return [[name, values[which]] for name, values in _MOVE_CONFIG.items()]

    def getRobotPosition(self, useSensors: object) -> list[float]:  # noqa: ARG002 - it is always measured
        """Return the robot's estimate of its place: x and y in m and the heading in rad."""
        odometry = self._walking.guard.read()
        return [odometry.x, odometry.y, odometry.heading]

    def getNextRobotPosition(self) -> list[float]:
        """Return what getRobotPosition does, since no step is planned ahead."""
        return self.getRobotPosition(True)

    def getRobotVelocity(self) -> list[float]:
        """Return the commanded velocity of the walk in m/s and rad/s."""
        return list(astuple(self._walking.guard.commanded()))

    # -- tasks -------------------------------------------------------------------------------------------

    def getTaskList(self) -> list[list[object]]:
        """Return name, number, broker and joints of each task that moves joints."""
        return [[task.name, task.number, "", sorted(task.joints)] for task in self._paths.all()]

    def areResourcesAvailable(self, resourceNames: object) -> bool:
        """Return whether no task moves any of some joints."""
        joints = self._joints.of(resourceNames)
        return all(task.joints.isdisjoint(joints) for task in self._paths.all())

    def killTask(self, motionTaskID: object) -> bool:
        """Cancel a task; returns whether there was one."""
        events = [task.stopped for task in self._paths.all() if task.number == motionTaskID]
        with self._access.calls.stopping(lambda call: call.stopped in events):
            return bool(events)

    def killTasksUsingResources(self, resourceNames: object) -> None:
        """Cancel the calls that move any of some joints along a path, or wait for it."""
        joints = self._joints.of(resourceNames)
        with self._access.calls.stopping(lambda call: self._needs(call, joints)):
            pass

    def killAll(self) -> None:
        """Cancel every call that moves the robot or waits for it, end the walk, and hold every joint."""
        with self._access.calls.stopping(begins_any(*MOTION)):
            self._walking.stop()
            self._body.hold()

    # -- the body ----------------------------------------------------------------------------------------

    def getBodyNames(self, name: object) -> list[str]:
        """Return the joints of a chain, such as `Body` or `LArm`; of `Chains` the chains."""
        return ["Head", "LArm", "LLeg", "RLeg", "RArm"] if name == "Chains" else list(self._joints.of(name))

    getJointNames = getBodyNames  # its former name

    def getLimits(self, name: object) -> list[list[float]]:
        """Return lowest and highest angle in rad, full speed in rad/s and torque in N m of each joint."""
        facts = [self._body.facts(joint) for joint in self._joints.of(name)]
        return [[joint.lower, joint.upper, joint.max_velocity, joint.max_torque] for joint in facts]

    getMotionCycleTime = constant("Return the period of the setpoints in ms.", round(PERIOD * 1000))
    getSensorNames = constant("Return the names of the cameras.", ["CameraTop", "CameraBottom"])

    def getRobotConfig(self) -> list[list[object]]:
        """Return names and values of facts about the body."""
        hands = len(self._joints.hands)
        config = {"Model Type": f"nao{self._robot.body.name}", **_ROBOT_CONFIG}
        config |= {"Extended Hand": hands > 0, "Number of Hands": hands}
        return [list(config), list(config.values())]

    def getSummary(self) -> str:
        """Return a table of joints with stiffness, command and position, as text."""
        reading = self._body.read()
        rows = zip(self._body.joints, reading.stiffnesses, reading.commands, reading.positions, strict=True)
        lines = [
            f"{joint.name:<16}{stiff:>10.2f}{command:>12.6f}{at:>12.6f}" for joint, stiff, command, at in rows
        ]
        return "\n".join([f"{'Joint':<16}{'Stiffness':>10}{'Command':>12}{'Sensor':>12}", *lines])

    def getPosition(self, name: object, frame: object, useSensorValues: object) -> list[float]:
        """Return x, y and z in m and the angles about x, y and z in rad of a joint, effector or camera."""
        return numbers_of(self._access.place(name, frame, measured=bool(useSensorValues)))

    def getTransform(self, name: object, frame: object, useSensorValues: object) -> list[float]:
        """Return the 16 entries of a homogeneous transform, row by row, of a joint, effector or camera."""
        place = self._access.place(name, frame, measured=bool(useSensorValues))
        return [float(value) for value in place.ravel()]

    def getMass(self, name: object) -> float:
        """Return the mass in kg of a joint with its link, of a chain or of the `Body`."""
        return self._access.kinematics.center_of_mass(
            text(name, "name"), self._access.angles(measured=False)
        )[0]

    def getCOM(self, name: object, frame: object, useSensorValues: object) -> list[float]:
        """Return the center of mass in m of a joint with its link, of a chain or of the `Body`."""
        measured = bool(useSensorValues)
        angles = self._access.angles(measured=measured)
        _, center = self._access.kinematics.center_of_mass(text(name, "name"), angles)
        place = self._access.place("Torso", frame, measured=measured)
        return [float(part) for part in (place @ [*center, 1.0])[:3]]

    # -- NAOqi's reflexes: remembered for programs that switch them before anything else --------------------

    setFallManagerEnabled, getFallManagerEnabled = _reflex("the fall manager")
    setSmartStiffnessEnabled, getSmartStiffnessEnabled = _reflex("smart stiffness")
    setDiagnosisEffectEnabled, getDiagnosisEffectEnabled = _reflex("the effect of a diagnosis")
    setPushRecoveryEnabled, getPushRecoveryEnabled = _reflex("push recovery")
    setCollisionProtectionEnabled, getCollisionProtectionEnabled = _reflex("collision protection", name=text)
    setExternalCollisionProtectionEnabled, getExternalCollisionProtectionEnabled = _reflex(
        "external collision protection", name=text
    )
    isCollision = constant(
        "Return `none`, since near collisions are not reported.",
        "none",
        pChainName=one_of("chain", ("Arms", "LArm", "RArm")),
    )
    setBreathEnabled, getBreathEnabled = _reflex("breathing", False, chain=text)
    setIdlePostureEnabled, getIdlePostureEnabled = _reflex("the idle posture", False, chain=text)
    _set_arm, getMoveArmsEnabled = _reflex("the swing of an arm", arm=text)

    def setMoveArmsEnabled(self, leftArm: object, rightArm: object) -> None:
        """Remember whether the arms are to swing; they do unless they are commanded."""
        self._set_arm("LArm", leftArm)
        self._set_arm("RArm", rightArm)

    setWalkArmsEnabled = setMoveArmsEnabled  # its former name

    # -- configuration -----------------------------------------------------------------------------------

    setMotionConfig = constant(
        "Do nothing but check that it is a list of names and values: the parameters have no effect.",
        config=lambda value, what: [text(listed(entry, what, 2)[0], what) for entry in listed(value, what)],
    )

    # -- internal ----------------------------------------------------------------------------------------

    def _send_joints(self, joints: Sequence[str], targets: Sequence[float], speed: object) -> None:
        """Send joints to angles, and those of legs together so that feet on the floor stay there."""
        goals = dict(zip(joints, targets, strict=True))
        moved, paths = self._on_feet(
            joints,
            lambda start: {name: smooth_curve(name, start[name], [1.0], [goals[name]]) for name in joints},
        )
        if moved is not joints:
            found = paths(self._access.angles(measured=False))
            targets = [found[joint].at(1.0) for joint in moved]
        self._send(moved, targets, speed, together=moved is not joints)

    def _send(
        self, joints: Sequence[str], targets: Sequence[float], speed: object, *, together: bool
    ) -> None:
        """Send joints to angles at a fraction of full speed, or so that all arrive with the slowest."""
        share, goals = fraction(speed, "the fraction"), dict(zip(joints, targets, strict=True))
        speeds = {joint: share * self._body.facts(joint).max_velocity for joint in joints}
        if together:
            start = self._access.angles(measured=False)
            ways = {joint: abs(goals[joint] - start[joint]) for joint in joints}
            seconds = max(PERIOD, *(ways[joint] / speeds[joint] for joint in joints))
            speeds = {joint: way / seconds for joint, way in ways.items()}
        calls = self._access.calls
        with calls.beginning() as may:
            if may:
                self._paths.release(joints)
                self._body.move(goals, speeds, client=calls.current.client.name)

    def _stiffen(self, stiffnesses: Mapping[str, float], seconds: float, call: Call | None = None) -> bool:
        """Change how strongly joints hold, unless the call was stopped; return whether it did."""
        calls = self._access.calls
        with calls.beginning(call) as may:
            if may:
                self._body.stiffen(stiffnesses, seconds, client=calls.current.client.name)
        return may

    def _needs(self, call: Call, joints: Sequence[str]) -> bool:
        """Return whether a call, perhaps one that still waits for a thread, moves any of some joints."""
        if Activity.JOINTS not in call.activities or not call.arguments:
            return False
        with suppress(InvalidCommand):  # as the call itself will report
            names = ["Legs" if name == "Torso" else name for name in texts(call.arguments[0], "names")]
            return not set(joints).isdisjoint(self._joints.of(names))
        return False

    def _on_feet(self, joints: Sequence[str], paths: _Paths) -> tuple[Sequence[str], _Paths]:
        """Return joints and paths, and those of the legs with which feet on the floor stay there."""
        access, feet = self._access, self._access.planted
        kinematics = access.kinematics
        if not feet or set(self._joints.chains["Legs"]).isdisjoint(joints):
            return joints, paths

        def on_feet(start: dict[str, float]) -> dict[str, Curve]:
            asked, base = paths(start), access.place("Torso", ROBOT, measured=False)
            return asked | curves_on_feet(kinematics, feet, asked, base, start)

        legs = [joint for leg in feet for joint in kinematics.joints_of(leg)]
        return list(dict.fromkeys([*joints, *legs])), on_feet

    def _follow(self, call: Call, name: str, joints: Sequence[str], paths: _Paths) -> None:
        """Move joints along paths from their setpoints, once no other task moves them."""
        access, client = self._access, call.client.name
        may_step = partial(access.calls.beginning, call)
        path = Path(name, frozenset(joints), client, call.stopped, may_step, access.balance)
        if joints:
            self._paths.follow(path, lambda: paths(access.angles(measured=False)))

    def _walk_limits(self, configs: Sequence[object]) -> WalkVelocity:
        """Return the highest velocities with some parameters of the gait, for both feet or for each.

        Raises InvalidCommand unless the parameters are lists of names, such as MaxStepX, and numbers.
        """
        values = {name: default for name, (_, default, _) in _MOVE_CONFIG.items()}
        for entry in (entry for config in configs for entry in listed(config, "moveConfig")):
            parameter, value = listed(entry, "an entry of moveConfig", 2)
            name = text(parameter, "a name in moveConfig").removeprefix("Left").removeprefix("Right")
            name = "MaxStepFrequency" if name == "Frequency" else name
            lowest, _, highest = _MOVE_CONFIG[chosen(name, "parameter", _MOVE_CONFIG)]
            values[name] = min(max(number(value, name), lowest), highest)
        limits = zip(astuple(gait_limits(values)), astuple(self._walking.guard.limits), strict=True)
        return WalkVelocity(*map(min, limits))


def _bezier_keys(joint: str, times: Sequence[float], points: object) -> list[Key]:
    keys = []
    for time, entry in zip(times, listed(points, f"{joint}: controlPoints", len(times)), strict=True):
        parts = listed(entry, "controlPoints") if isinstance(entry, (list, tuple)) else [entry]
        if not parts:
            raise InvalidCommand(joint, f"{joint}: a key has no angle")
        handles = (listed(part, "a handle", 3) for part in parts[1:3])
        sides = [(number(when, "a handle's time"), number(at, "a handle's angle")) for _, when, at in handles]
        keys.append(Key(time, number(parts[0], "an angle"), *sides))
    return keys
