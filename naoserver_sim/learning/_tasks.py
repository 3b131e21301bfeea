"""The environments: Nao/Walk-v0, Nao/Reach-v0 and Nao/StandUp-v0."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from naoserver.body import H25
from naoserver.capabilities import Truth
from naoserver.kinematics import place_of
from naoserver_sim._walk.kinematics import LEG_MOTORS
from naoserver_sim.learning._environment import PERIOD, NaoEnvironment, three_numbers
from naoserver_sim.robot import SimulatedRobot

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
_FALLEN_HEIGHT: Final = 0.2
"""Height of the torso in m below which it has fallen on its knees or worse."""


class WalkEnvironment(NaoEnvironment):
    """Keep a velocity on the floor, by the angles of the legs.

    Action (11): the motors of the legs in the order of `LEG_MOTORS`, up to 0.6 rad to either side of the
    stance in which it begins. Observation (46): the requested velocity (3); up, turning rate and loads
    of the soles (8); angles about the stance (11) and speeds (11) of the motors; the last action (11); sine
    and cosine of a clock to step by (2).

    Reward of a step: 0.2 for being on its feet, plus up to 1 the closer the torso's velocity is to the
    requested one (averaged over the last half second, because it sways), minus the jerk of the action. A fall
    ends the episode and costs 10. `reset(options={"velocity": (forward, left, turn)})` gives the velocity in
    m/s and rad/s; by default it is random.
    """

    moved = LEG_MOTORS
    more = 24
    option = "velocity"

    def _begin(self, options: Mapping[str, Any]) -> None:
        commands = self.robot.read().commands
        self._full = {joint.name: joint.max_velocity for joint in self._moved}
        self._stance = np.array([commands[place] for place in self._places])
        self._last = np.zeros(len(LEG_MOTORS))
        self._jerk = 0.0
        self._moves: deque[Array] = deque(maxlen=round(_STRIDE / PERIOD))
        drawn = self.np_random.uniform(-1.0, 1.0, 3) * _HIGHEST_VELOCITY
        self._wanted = three_numbers(options.get("velocity", drawn), "velocity")

    def _act(self, robot: SimulatedRobot, action: NDArray[np.float64]) -> None:
        angles = self._stance + _REACH * action
        robot.command_positions(dict(zip(LEG_MOTORS, angles.tolist(), strict=True)), self._full)
        change = action - self._last
        self._jerk, self._last = float(change @ change), action

    def _judge(self) -> tuple[float, bool]:
        if self.fallen or self._truth.torso.position[2] < _FALLEN_HEIGHT:
            return _FALL, True
        self._moves.append(velocity_of(self._truth))
        forward, left, turn = self._velocity() - self._wanted
        error = math.hypot(forward, left, turn / 4.0)
        return _ON_FEET + math.exp(-((error / _TOLERANCE) ** 2)) - _JERK * self._jerk, False

    def _features(self) -> list[float]:
        phase = math.tau * self._joints.time / _STRIDE
        return [
            *(self._wanted * (4.0, 10.0, 1.0)).tolist(),
            *self._balance(),
            *(np.array(self._angles()) - self._stance).tolist(),
            *self._speeds(0.1),
            *self._last.tolist(),
            *(math.sin(phase), math.cos(phase)),
        ]

    def _velocity(self) -> Array:
        """Return the mean of the velocities in the last half second."""
        return np.mean(self._moves, axis=0) if self._moves else np.zeros(3)

    def _info(self) -> dict[str, Any]:
        moved, wanted = tuple(self._velocity().tolist()), tuple(self._wanted.tolist())
        return super()._info() | {"velocity": moved, "wanted": wanted}


def velocity_of(truth: Truth) -> Array:
    """Return the velocity of the torso over the floor, in its own frame: forwards, to the left, turn."""
    heading = truth.torso.heading
    cosine, sine = math.cos(heading), math.sin(heading)
    vx, vy, _ = truth.velocity
    return np.array([cosine * vx + sine * vy, cosine * vy - sine * vx, truth.angular_velocity[2]])


ARM: Final = ("LShoulderPitch", "LShoulderRoll", "LElbowYaw", "LElbowRoll", "LWristYaw")
"""The joints of the arm from the shoulder down."""
_THERE: Final = 0.02
"""Distance in m within which the hand has arrived."""
_REWARD: Final = 1.0
_SCALE: Final = 5.0
"""Factor that scales lengths in m to about 1."""


class ReachEnvironment(NaoEnvironment):
    """Bring the middle of the left hand within 2 cm of a place that it can reach, and keep it there.

    Action (5; 4 of an H21): the speeds of the joints in `ARM`, up to half their full ones. Observation (24;
    22): angles and speeds of these joints; the position of the hand (3), and the vector from there to the
    place (3), in the torso's frame; up, turning rate and loads of the soles (8). The position of the hand is
    computed from the angles of the joints.

    Reward of a step: minus the distance in m, plus 1 while the hand is there. A fall ends the episode and
    costs 10. `reset(options={"place": (x, y, z)})` gives the place in m; by default it is the place of the
    hand at random angles in the middle 80 % of the joints' ranges.
    """

    moved = ARM
    more = 14
    option = "place"

    def _begin(self, options: Mapping[str, Any]) -> None:
        lower, upper = np.array([(joint.lower, joint.upper) for joint in self._moved]).T
        angles = lower + (upper - lower) * self.np_random.uniform(0.1, 0.9, len(lower))
        drawn = hand_at(angles.tolist())
        self._target = three_numbers(options.get("place", drawn), "place")

    def _judge(self) -> tuple[float, bool]:
        if self.fallen:
            return _FALL, True
        distance = self._distance()
        return (_REWARD if distance <= _THERE else 0.0) - distance, False

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
        return super()._info() | {"distance": self._distance(), "is_success": self._distance() <= _THERE}

    def _look(self) -> None:
        super()._look()
        self._hand = hand_at(self._angles())

    def _distance(self) -> float:
        return float(np.linalg.norm(self._target - self._hand))


def hand_at(angles: Sequence[float]) -> Array:
    """Return the position of the left hand in m in the torso's frame at angles of `ARM` (4 of an H21)."""
    return place_of("LArm", dict(zip(ARM, angles, strict=False)))[:3, 3]


MOTORS: Final = tuple(
    joint.name
    for joint in H25.joints
    if joint.name not in {pair.follower for pair in H25.couplings} and "Hand" not in joint.name
)
"""The moved joints: all motors but those of the hands."""
_PUSH: Final = 60.0
"""Force in N that throws the robot over, for `_PUSHED` s."""
_PUSHED: Final = 0.3
_FALLING: Final = 3.0
"""Seconds after the push until it lies still."""
_STIFFENING: Final = 0.2
_STANDING: Final = 0.30
"""Height of the torso in m from which the robot stands, knees bent; it is 0.33 m with straight legs."""
_UPRIGHT: Final = math.cos(math.radians(15))
_HELD: Final = 1.0
"""Seconds for which it has to stand."""
_STANDS: Final = 50.0
_DIRECTIONS: Final = {"belly": 0.0, "back": math.pi}


class StandUpEnvironment(NaoEnvironment):
    """Get up from where it fell, and stand for a second.

    Before the episode, the robot is thrown over in a random direction and falls with limp motors, as it does
    in any fall. `reset(options={"side": "belly"})`, or "back", gives the direction.

    Action (23; 21 of an H21): the speeds of those of `MOTORS` that it has, up to half their full ones.
    Observation (54; 50): angles and speeds of these; up, turning rate and loads of the soles (8). Reward of a
    step: for the height of the torso and for being upright, up to 1 each second; 50 after standing for a
    second, which ends the episode.
    """

    moved = MOTORS
    more = 8
    option = "side"

    def _begin(self, options: Mapping[str, Any]) -> None:
        drawn = float(self.np_random.uniform(-math.pi, math.pi))
        side = options.get("side")
        if side is not None and side not in _DIRECTIONS:
            raise ValueError(f"there is no side {side!r}; there are {', '.join(_DIRECTIONS)}")
        direction = drawn if side is None else _DIRECTIONS[side]
        robot = self.robot
        robot.stage.push((_PUSH * math.cos(direction), _PUSH * math.sin(direction), 0.0), _PUSHED)
        self._clock.advance(_FALLING)
        robot.command_stiffnesses(dict.fromkeys(self._body.joint_names, 1.0), _STIFFENING)
        self._clock.advance(_STIFFENING)
        self._stood = 0.0

    def _judge(self) -> tuple[float, bool]:
        _, x, y, _ = self._truth.torso.orientation
        upright = 1.0 - 2.0 * (x * x + y * y)
        height = self._truth.torso.position[2]
        stands = height >= _STANDING and upright >= _UPRIGHT
        self._stood = self._stood + PERIOD if stands else 0.0
        if self._stood >= _HELD:
            return _STANDS, True
        part = min(max(height / _STANDING, 0.0), 1.0) * (1.0 + upright) / 2.0
        return PERIOD * part, False

    def _features(self) -> list[float]:
        return [*self._angles(), *self._speeds(0.1), *self._balance()]

    def _info(self) -> dict[str, Any]:
        return super()._info() | {"up": self._senses.inertial.up, "is_success": self._stood >= _HELD}
