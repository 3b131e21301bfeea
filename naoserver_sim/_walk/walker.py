"""The walk of the simulated robot: begun and ended by commands, computed at every control tick."""

from __future__ import annotations

from enum import Enum, auto
from functools import cached_property
from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.bodies.capabilities import STILL, Odometry, WalkVelocity
from naoserver.body import Body
from naoserver_sim._locomotion import (
    LYING,
    MOVED,
    OFF_ITS_FEET,
    STUCK,
    TILT,
    ArmSwing,
    Headway,
    Locomotion,
    limp,
)
from naoserver_sim._senses.record import SensorRecord
from naoserver_sim._share import RobotData
from naoserver_sim._simulator import Simulator
from naoserver_sim._walk.gait import AT_REST, LEFT, RIGHT, FootOffset, Gait
from naoserver_sim._walk.legs import FootPose, Legs, Odometer, leg_motors
from naoserver_sim.model import Model
from zenoh_ice.data.text import sentence

_TRIM_TIME: Final = 0.3
"""Time constant in s with which the feet follow."""


class Trim:
    """Report the shift of the center of mass by arms and head, in the torso's frame."""

    def __init__(self, mj: mujoco.MjModel, data: mujoco.MjData | RobotData, body: Body) -> None:
        self._data = data
        self._torso = mj.body(body.root.name).id
        upper = [
            link.name
            for link in body.links
            if link is not body.root and body.moved_by[link.name].name not in body.groups.legs
        ]
        bodies = [mj.body(name).id for name in upper]
        self._shares = np.zeros(mj.nbody)  # of the links in the mass, 0 for those of the legs
        self._shares[bodies] = mj.body_mass[bodies] / float(mj.body_subtreemass[self._torso])
        self._share = float(self._shares.sum())
        self._mj, self._posture = mj, body.resting_angles
        self._x, self._y = 0.0, 0.0

    @property
    def shift(self) -> tuple[float, float]:
        """Displacement forwards and to the left of its usual place in m, smoothed."""
        return self._x, self._y

    def begin(self) -> None:
        """Begin with the present positions of arms and head."""
        self.tick(_TRIM_TIME)

    def tick(self, seconds: float) -> None:
        """Advance by some seconds to the present positions of arms and head."""
        x, y = self._measure(self._data)
        part = min(seconds / _TRIM_TIME, 1.0)
        self._x += (x - self._usual[0] - self._x) * part
        self._y += (y - self._usual[1] - self._y) * part

    def _measure(self, data: mujoco.MjData | RobotData) -> tuple[float, float]:
        """Return the contribution of arms and head to the center of mass along the torso's x and y axes."""
        center = self._shares @ data.xipos - self._share * data.xpos[self._torso]
        x, y, _ = (center @ data.xmat[self._torso].reshape(3, 3)).tolist()
        return x, y

    @cached_property
    def _usual(self) -> tuple[float, float]:
        data = mujoco.MjData(self._mj)
        for name, angle in self._posture.items():
            data.joint(name).qpos[0] = angle
        mujoco.mj_kinematics(self._mj, data)
        return self._measure(data)


# The stance of the body in the walk, and the feedback that keeps it upright.
_HIP_HEIGHT: Final = 0.230
"""Height in m of the hips above the soles."""
_HIP_DEPTH: Final = 0.085
"""Height in m of the torso's frame above the hips."""
_HIP_WIDTH: Final = 0.05
"""Distance in m of a hip from the middle."""
_FORWARD_OF_HIP: Final = 0.012
"""Distance of the feet in front of the torso's frame in m."""
_LEAN: Final = 0.05
"""Pitch of the torso in rad; so small that its sine is the angle, and its cosine 1 but for 0.1 percent."""
_PITCH_GAIN: Final = 0.03
"""Radians of the carrying ankle's pitch for a rad/s of the torso's."""
_ROLL_GAIN: Final = 0.05
"""Radians of the carrying ankle's roll for a rad/s of the torso's."""
_HIP_GAIN: Final = 0.01
"""Radians of the carrying hip's pitch for a rad/s of the torso's."""
_SMOOTHING: Final = 0.6
"""Part of the last turning rate that is kept at each tick."""


class WalkController:
    """Compute the angles of the legs at each control tick; without physics, without threads."""

    def __init__(self, body: Body) -> None:
        self.gait: Final = Gait()
        self._body = body
        self._legs = Legs(body)
        self.reset()

    def reset(self) -> None:
        """Stand on both feet at once, as before the first step."""
        self.gait.stop()
        self._rate = (0.0, 0.0)
        self._part = [0.0, 0.0]  # of the feedback for each foot: for the support foot, without a jump

    def stance(self, shift: tuple[float, float]) -> list[float]:
        """Return the angles of `leg_motors` with which a step begins and ends; `shift` is that of `tick`."""
        return Legs(self._body).solve(self._foot(LEFT, AT_REST, shift), self._foot(RIGHT, AT_REST, shift))

    def tick(
        self,
        seconds: float,
        velocity: WalkVelocity,
        turning: tuple[float, float, float],
        loads: tuple[float, float],
        shift: tuple[float, float],
    ) -> list[float]:
        """Return the angles of `leg_motors`.

        `turning` is the torso's turning rate in rad/s, `loads` are those of the soles in N, left and right;
        `shift` is the displacement in m of the center of mass forwards and to the left of its usual place.
        """
        gait, keep = self.gait, _SMOOTHING
        roll = keep * self._rate[0] + (1.0 - keep) * turning[0]
        pitch = keep * self._rate[1] + (1.0 - keep) * turning[1]
        self._rate = (roll, pitch)
        gait.tick(seconds, velocity, loads)
        angles = self._legs.solve(
            self._foot(LEFT, gait.feet[LEFT], shift), self._foot(RIGHT, gait.feet[RIGHT], shift)
        )
        for foot in (LEFT, RIGHT):
            carries = gait.walking and foot == gait.support
            part = self._part[foot] = 0.5 * (self._part[foot] + carries)
            first = 1 + 5 * foot
            angles[first + 1] += part * _HIP_GAIN * pitch
            angles[first + 3] += part * _PITCH_GAIN * pitch
            angles[first + 4] += part * _ROLL_GAIN * roll
        return angles

    def _foot(self, foot: int, offset: FootOffset, shift: tuple[float, float]) -> FootPose:
        """Return the target of a foot in the frame of a torso that leans forwards."""
        x = offset.x + _FORWARD_OF_HIP + shift[0]
        y = offset.y + (_HIP_WIDTH if foot == LEFT else -_HIP_WIDTH) + shift[1]
        z = offset.lift - _HIP_HEIGHT - _HIP_DEPTH
        return FootPose(x - _LEAN * z, y, z + _LEAN * x, offset.yaw, pitch=-_LEAN)


_HANGING: Final = 1.4
"""Tilt in rad of the shoulder of an arm that hangs down."""
_ABOUT: Final = 0.5
"""Distance in rad from it up to which an arm counts as hanging."""
_ARM_SWING: Final = 3.0
"""Radians of a shoulder per metre of the foot on the same side."""
_PARTS: Final = ("Shoulder", "Elbow", "Wrist")
"""The hinges of an arm that hangs, without its hand."""

LIMITS: Final = WalkVelocity(forward=0.3, left=0.12, turn=0.9)
"""The highest velocity of each kind."""

# Factors of commanded velocities: the feet lag and slip, so the robot walks a little slower than commanded.
# Measured by benchmarks/bench_walk.py.
_EXACT_GAINS: Final = WalkVelocity(forward=1.16, left=1.17, turn=1.14)
_BACKLASH_GAINS: Final = WalkVelocity(forward=1.27, left=1.42, turn=1.36)
"""The gains of a robot whose gears have backlash, which takes away a part of each step."""
_BACKLASH_TURN: Final = 0.7
"""Turn in rad for each m to the left that makes up for the one by which that robot turns to the right."""

_PACE: Final = 1.0
"""Speed in rad/s at which the legs move into the stance of the walk."""
_STANCE_TOLERANCE: Final = 0.01
"""Distance in rad from the stance within which the legs need not move there first."""
_AWHILE: Final = 10
"""Ticks of rest after which the soles are hardly moved."""
_IDLE_TICKS: Final = 5
"""Ticks after which they are looked at again then."""
_SETTLING_TIME: Final = 0.3
"""Seconds for which it stands before the walk counts as ended."""
WEIGHT: Final = 25.0
"""Least load on the soles in N with which it stands on its feet: half its weight."""
_BRIEF: Final = 0.2
"""Time constant in s of the way that it has just made."""
_LEANT: Final = 0.05
"""Angle in rad back from its lean at which a torso that walks forwards is held back if it makes no way."""
_TURNED: Final = 0.12
"""The same angle in any case: pushes of 1 N s that it stands turn it back by 0.1."""
_STRAIGHT: Final = 0.2
"""Largest part of the way forwards that goes sideways: steps in both directions lean more."""


class _Stage(Enum):
    RESTING = auto()
    RISING = auto()
    STEPPING = auto()
    SETTLING = auto()


class SimulatedWalker(Locomotion):
    """Walk by setting the setpoints of the legs, and of arms that hang, at each control tick.

    With `noise`, the steps make up for the backlash of the gears.
    """

    def __init__(self, model: Model, simulator: Simulator, sensors: SensorRecord, *, noise: bool) -> None:
        super().__init__(simulator, model.body.groups.legs, LIMITS)
        self._setpoints = simulator.setpoints
        self._sensors = sensors
        self._noise = noise
        body = model.body
        joints = [body.joint_names.index(name) for name in self.joints]
        motors = [body.joint_names.index(name) for name in leg_motors(body)]
        self._places = model.robot.qpos[joints]
        self._motors: NDArray[np.intp] = model.robot.motors[motors]
        self._trim = Trim(model.mj, simulator.data, body)
        of, robot = body.joint_names.index, model.robot
        hinges = ([body.hinge(f"{side}{part}") for part in _PARTS] for side in ("Left", "Right"))
        # The shoulder's tilt comes first.
        arms = [[of(joint) for hinge in arm if hinge for joint in hinge.joints] for arm in hinges]
        self._arms = ArmSwing(self._setpoints, [robot.motors[arm] for arm in arms])
        self._controller = WalkController(body)
        self._odometer = Odometer(Legs(body))
        self._stage = _Stage.RESTING
        self._idle = 0  # ticks of rest without a command
        self._time = 0.0  # since the stage began
        self._start = np.zeros(len(self._motors))
        self._rising = 0.0
        self._inertial = sensors.newest.inertial
        self._loads = sensors.loads()
        self._briefly = Headway(_BRIEF, slack=0.003)

    @property
    def walking(self) -> bool:
        return self._commanded != STILL or self._stage is not _Stage.RESTING

    def odometry(self) -> Odometry:
        return Odometry(self._simulator.newest().time, *self._odometer.pose)

    def tick(self, seconds: float) -> None:
        """Set the setpoints of legs and arms while it walks, and update the odometry."""
        sensors = self._sensors
        self._inertial = sensors.newest.inertial
        resting = self._stage is _Stage.RESTING
        idle = resting and self._velocity == STILL
        self._idle = self._idle + 1 if idle else 0
        if self._idle > _AWHILE and self._idle % _IDLE_TICKS:
            self._odometer.turn(seconds, self._inertial, resting=True)
            return
        self._loads = sensors.loads()
        joints = sensors.encoded(self._simulator.newest().measured[self._places])
        self._odometer.tick(seconds, joints.tolist(), self._inertial, self._loads, resting=resting)
        if idle:
            return
        if hindrance := self._hindrance(self._simulator.motors.stiffnesses):
            self.abandon(hindrance)
            return
        stepping = self._stage is _Stage.STEPPING
        now = self.odometry()
        self._check_headway(seconds, self._commanded if stepping else STILL, now, self._inertial.tilt)
        if self._is_turned_back(seconds, now):
            self._end(STUCK)
            self._controller.gait.come_down()
        self._trim.tick(seconds)
        if resting:
            self._rise()
        self._time += seconds
        if self._stage is _Stage.RISING:
            self._come_into_stance()
        else:
            self._step(seconds)

    def abandon(self, why: str = MOVED) -> None:
        """End the walk at once, the legs where they are: the robot fell, or was placed elsewhere."""
        self._end(why)
        self._controller.reset()
        self._odometer.lose_footing()
        self._idle = 0
        self._enter(_Stage.RESTING)

    def _followed(self, velocity: WalkVelocity) -> WalkVelocity:
        gains = _BACKLASH_GAINS if self._noise else _EXACT_GAINS
        turn = velocity.turn + (_BACKLASH_TURN * velocity.left if self._noise else 0.0)
        return WalkVelocity(velocity.forward * gains.forward, velocity.left * gains.left, turn * gains.turn)

    def _hindrance(self, stiffnesses: NDArray[np.float64]) -> str:
        """Return why it cannot walk; empty when it can."""
        if max(abs(self._inertial.roll), abs(self._inertial.pitch)) > TILT:
            return LYING
        if self._stage is _Stage.RESTING and sum(self._loads) < WEIGHT:
            return OFF_ITS_FEET
        return limp(stiffnesses[self._motors], sentence("its legs are limp"))

    def _is_turned_back(self, seconds: float, now: Odometry) -> bool:
        """Return whether something before it is about to make it fall on its back."""
        velocity = self._commanded
        if self._stage is not _Stage.STEPPING or not abs(velocity.left) < _STRAIGHT * velocity.forward:
            self._briefly.begin()
            return False
        gets_on = self._briefly.tick(seconds, velocity, now)
        back = _LEAN - self._inertial.pitch
        return back > _TURNED or (back > _LEANT and not gets_on)

    def _enter(self, stage: _Stage) -> None:
        self._stage = stage
        self._time = 0.0

    def _rise(self) -> None:
        self._start = self._setpoints.setpoints[self._motors]
        self._trim.begin()
        distance = float(np.abs(self._stance() - self._start).max())
        self._rising = distance / _PACE if distance > _STANCE_TOLERANCE else 0.0
        self._controller.reset()
        self._arms.begin(np.abs(self._arms.shoulders() - _HANGING) <= _ABOUT)
        self._enter(_Stage.RISING)

    def _come_into_stance(self) -> None:
        done = min(self._time / self._rising, 1.0) if self._rising else 1.0
        eased = done * done * (3.0 - 2.0 * done)
        self._place(self._start + (self._stance() - self._start) * eased)
        if done == 1.0:
            self._enter(_Stage.STEPPING)

    def _stance(self) -> NDArray[np.float64]:
        return np.array(self._controller.stance(self._trim.shift))

    def _step(self, seconds: float) -> None:
        controller = self._controller
        turning, shift = self._inertial.angular_velocity, self._trim.shift
        angles = controller.tick(seconds, self._velocity, turning, self._loads, shift)
        self._place(np.array(angles))
        # An arm that swings forwards pitches up, which is negative: back when its foot is ahead.
        swings = [_ARM_SWING * foot.x for foot in controller.gait.feet]
        self._arms.tick(swings, self._simulator.commands)
        if controller.gait.walking:
            self._stage = _Stage.STEPPING
        elif self._stage is _Stage.STEPPING:
            self._enter(_Stage.SETTLING)
        elif self._time >= _SETTLING_TIME:
            self._enter(_Stage.RESTING)

    def _place(self, angles: NDArray[np.float64]) -> None:
        self._setpoints.place(self._motors, angles, self._simulator.commands)
