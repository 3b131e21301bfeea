"""The environments: Nao/Walk-v0, Nao/Reach-v0 and Nao/StandUp-v0."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from naoserver.bodies.capabilities import Truth, Vector
from naoserver.bodies.kinematics import kinematics_of
from naoserver.body import Body
from naoserver_sim.robot import SimulatedRobot
from visualhfsm_learning._environment import PERIOD, NaoEnvironment, three_numbers

Array = NDArray[np.float64]

_REACH: Final = 0.6
"""Largest angle in rad by which an action moves a joint from the stance."""
_STRIDE: Final = 0.5
"""Duration of two steps in s; the observation contains the phase: a clock to step by."""
_HIGHEST_VELOCITY: Final = (0.25, 0.1, 0.6)
"""The highest random velocity forwards, to the left and of the turn, in m/s and rad/s."""
_TOLERANCE: Final = 0.1
"""Error of the velocity in m/s at which 37 % of its reward is left; of the turn 4 times that in rad/s."""
_ON_FEET: Final = 0.2
_JERK: Final = 0.02
_FALL: Final = -10.0
_ON_KNEES: Final = 0.6
"""Part of its height with straight legs below which the torso shows that a robot is on its knees."""


def without_legs(body: Body) -> str:
    """Return "legs" for a body that has no two legs with feet; empty for others."""
    groups = body.groups
    return "" if groups.left_leg and groups.right_leg and body.soles else "legs"


def part_of_height(body: Body, part: float) -> float:
    """Return a part of the height in m of the torso with straight legs, to the next 0.01."""
    height = kinematics_of(body).torso_place({})[2, 3]
    return round(part * float(height), 2)


def leg_motors(body: Body) -> tuple[str, ...]:
    """Return the joints of the legs, of those that share a motor the one that leads."""
    return tuple(name for name in body.groups.legs if name in body.motors)


class WalkEnvironment(NaoEnvironment):
    """Keep a velocity on the floor, by the angles of the legs.

    The numbers in parentheses are those of a Nao. Action (11): the motors of the legs from the hips down, the
    left leg first, up to 0.6 rad to either side of the stance in which it begins. Observation (46): the
    requested velocity (3); up, turning rate and loads of the soles (8); angles about the stance (11) and
    speeds (11) of the motors; the last action (11); sine and cosine of a clock to step by (2).

    Reward of a step: 0.2 for being on its feet, plus up to 1 the closer the torso's velocity is to the
    requested one (averaged over the last half second, because it sways), minus the jerk of the action. A fall
    ends the episode and costs 10. `reset(options={"velocity": (forward, left, turn)})` gives the velocity in
    m/s and rad/s; by default it is random.
    """

    lacks = staticmethod(without_legs)
    moved = staticmethod(leg_motors)
    each = 3
    more = 13
    option = "velocity"

    def _begin(self, options: Mapping[str, Any]) -> None:
        commands = self.robot.read().commands
        self._lowest = part_of_height(self._body, _ON_KNEES)
        self._full = {joint.name: joint.max_velocity for joint in self._moved}
        self._stance = np.array([commands[place] for place in self._places])
        self._last = np.zeros(len(self._moved))
        self._jerk = 0.0
        self._moves: deque[Vector] = deque(maxlen=round(_STRIDE / PERIOD))
        self._velocity: Vector = 0.0, 0.0, 0.0  # the mean of these
        drawn = self.np_random.uniform(-1.0, 1.0, 3) * _HIGHEST_VELOCITY
        forward, left, turn = three_numbers(options.get("velocity", drawn), "velocity").tolist()
        self._wanted: Vector = forward, left, turn

    def _act(self, robot: SimulatedRobot, action: NDArray[np.float64]) -> None:
        angles = self._stance + _REACH * action
        robot.command_positions(dict(zip(self._full, angles.tolist(), strict=True)), self._full)
        change = action - self._last
        self._jerk, self._last = float(change @ change), action

    def _judge(self) -> tuple[float, bool]:
        if self.fallen or self._truth.torso.position[2] < self._lowest:
            return _FALL, True
        self._moves.append(velocity_of(self._truth))
        count = len(self._moves)
        forward, left, turn = (sum(moves) / count for moves in zip(*self._moves, strict=True))
        self._velocity = forward, left, turn
        wanted = self._wanted
        error = math.hypot(forward - wanted[0], left - wanted[1], (turn - wanted[2]) / 4.0)
        return _ON_FEET + math.exp(-((error / _TOLERANCE) ** 2)) - _JERK * self._jerk, False

    def _features(self) -> list[float]:
        phase = math.tau * self._joints.time / _STRIDE
        forward, left, turn = self._wanted
        return [
            *(4.0 * forward, 10.0 * left, turn),
            *self._balance(),
            *(np.array(self._angles()) - self._stance).tolist(),
            *self._speeds(0.1),
            *self._last.tolist(),
            *(math.sin(phase), math.cos(phase)),
        ]

    def _info(self) -> dict[str, Any]:
        return super()._info() | {"velocity": self._velocity, "wanted": self._wanted}


def velocity_of(truth: Truth) -> Vector:
    """Return the velocity of the torso over the floor, in its own frame: forwards, to the left, turn."""
    heading = truth.torso.heading
    cosine, sine = math.cos(heading), math.sin(heading)
    vx, vy, _ = truth.velocity
    return cosine * vx + sine * vy, cosine * vy - sine * vx, truth.angular_velocity[2]


def arm_of(body: Body) -> tuple[str, ...]:
    """Return the joints of the left arm from the shoulder down, without its fingers."""
    hand = body.hinge("LeftHand")
    return tuple(name for name in body.groups.left_arm if hand is None or name not in hand.joints)


_HAND: Final = "LArm"
"""The effector that is to reach a place."""


def without_left_arm(body: Body) -> str:
    """Return "left arm" for a body that has none, or none whose place is known; empty for others."""
    return "" if arm_of(body) and _HAND in body.effectors else "left arm"


_THERE: Final = 0.02
"""Distance in m within which the hand has arrived."""
_REWARD: Final = 1.0
_SCALE: Final = 5.0
"""Factor that scales lengths in m to about 1."""


class ReachEnvironment(NaoEnvironment):
    """Bring the middle of the left hand within 2 cm of a place that it can reach, and keep it there.

    Action (5; 4 of an H21): the speeds of the joints of `arm_of`, up to half their full ones. Observation
    (24; 22): angles and speeds of these joints; the position of the hand (3), and the vector from there to
    the place (3), in the torso's frame; up, turning rate and loads of the soles (8). The position of the hand
    is computed from the angles of the joints.

    Reward of a step: minus the distance in m, plus 1 while the hand is there. A fall ends the episode and
    costs 10. `reset(options={"place": (x, y, z)})` gives the place in m; by default it is the place of the
    hand at random angles in the middle 80 % of the joints' ranges.
    """

    lacks = staticmethod(without_left_arm)
    moved = staticmethod(arm_of)
    more = 14
    option = "place"

    def _begin(self, options: Mapping[str, Any]) -> None:
        lower, upper = np.array([(joint.lower, joint.upper) for joint in self._moved]).T
        angles = lower + (upper - lower) * self.np_random.uniform(0.1, 0.9, len(lower))
        drawn = hand_at(self._body, angles.tolist())
        self._target = three_numbers(options.get("place", drawn), "place")

    def _judge(self) -> tuple[float, bool]:
        if self.fallen:
            return _FALL, True
        return (_REWARD if self._distance <= _THERE else 0.0) - self._distance, False

    def _features(self) -> list[float]:
        hand = self._hand
        return [
            *self._angles(),
            *self._speeds(0.2),
            *(_SCALE * hand).tolist(),
            *(_SCALE * (self._target - hand)).tolist(),
            *self._balance(),
        ]

    def _info(self) -> dict[str, Any]:
        return super()._info() | {"distance": self._distance, "is_success": self._distance <= _THERE}

    def _look(self) -> None:
        super()._look()
        angles = {joint.name: angle for joint, angle in zip(self._moved, self._angles(), strict=True)}
        self._hand = kinematics_of(self._body).place_of(_HAND, angles)[:3, 3]
        self._distance = math.dist(self._target.tolist(), self._hand.tolist())


def hand_at(body: Body, angles: Sequence[float]) -> Array:
    """Return the position of the left hand in m in the torso's frame at angles of `arm_of`."""
    return kinematics_of(body).place_of(_HAND, dict(zip(arm_of(body), angles, strict=True)))[:3, 3]


def motors_of(body: Body) -> tuple[str, ...]:
    """Return the moved joints: all motors but those of the hands."""
    hinges = (body.hinge(f"{side}Hand") for side in ("Left", "Right"))
    hands = [joint for hand in hinges if hand for joint in hand.joints]
    return tuple(name for name in body.motors if name not in hands)


_PUSH: Final = 1.132
"""Force, as a part of its weight, that throws a robot over, for `_PUSHED` s."""
_PUSHED: Final = 0.3
_FALLING: Final = 3.0
"""Seconds after the push until it lies still."""
_STIFFENING: Final = 0.2
_STANDING: Final = 0.9
"""Part of its height with straight legs from which the torso of a robot that stands is, knees bent."""
_UPRIGHT: Final = math.cos(math.radians(15))
_HELD: Final = 1.0
"""Seconds for which it has to stand."""
_STANDS: Final = 50.0
_DIRECTIONS: Final = {"belly": 0.0, "back": math.pi}


class StandUpEnvironment(NaoEnvironment):
    """Get up from where it fell, and stand for a second.

    Before the episode, the robot is thrown over in a random direction and falls with limp motors, as it does
    in any fall. `reset(options={"side": "belly"})`, or "back", gives the direction.

    Action (23; 21 of an H21): the speeds of `motors_of`, up to half their full ones.
    Observation (54; 50): angles and speeds of these; up, turning rate and loads of the soles (8). Reward of a
    step: for the height of the torso and for being upright, up to 1 each second; 50 after standing for a
    second, which ends the episode.
    """

    lacks = staticmethod(without_legs)
    moved = staticmethod(motors_of)
    more = 8
    option = "side"

    def _begin(self, options: Mapping[str, Any]) -> None:
        drawn = float(self.np_random.uniform(-math.pi, math.pi))
        side = options.get("side")
        if side is not None and side not in _DIRECTIONS:
            raise ValueError(f"there is no side {side!r}; there are {', '.join(_DIRECTIONS)}")
        direction = drawn if side is None else _DIRECTIONS[side]
        self._standing = part_of_height(self._body, _STANDING)
        robot, push = self.robot, round(_PUSH * self._weight)
        robot.stage.push((push * math.cos(direction), push * math.sin(direction), 0.0), _PUSHED)
        self._clock.advance(_FALLING)
        robot.command_stiffnesses(dict.fromkeys(self._body.motors, 1.0), _STIFFENING)
        self._clock.advance(_STIFFENING)
        self._stood = 0.0

    def _judge(self) -> tuple[float, bool]:
        _, x, y, _ = self._truth.torso.orientation
        upright = 1.0 - 2.0 * (x * x + y * y)
        height = self._truth.torso.position[2]
        stands = height >= self._standing and upright >= _UPRIGHT
        self._stood = self._stood + PERIOD if stands else 0.0
        if self._stood >= _HELD:
            return _STANDS, True
        part = min(max(height / self._standing, 0.0), 1.0) * (1.0 + upright) / 2.0
        return PERIOD * part, False

    def _features(self) -> list[float]:
        return [*self._angles(), *self._speeds(0.1), *self._balance()]

    def _info(self) -> dict[str, Any]:
        return super()._info() | {"up": self._inertial.up, "is_success": self._stood >= _HELD}
