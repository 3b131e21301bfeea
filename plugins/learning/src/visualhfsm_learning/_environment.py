"""Common part of all environments: a robot on a virtual clock that moves by actions from -1 to 1."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Final, TypedDict, Unpack

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from naoserver.bodies import DEFAULT_BODY, find_body
from naoserver.bodies.capabilities import FootReading, InertialReading, Truth
from naoserver.body import Body
from naoserver.robot import JointReading
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from zenoh_ice import VirtualClock

Array = NDArray[np.float32]

PERIOD: Final = 0.02
"""Simulated seconds of a step: 50 Hz, the cycle of NAOqi's motion."""
_LARGEST_NUMBER: Final = 10.0
"""Bound of the numbers of an observation, which are scaled to about 1; larger ones are clipped."""
_RENDERED: Final = ("CameraOutside", 320, 240)
_SETTLING_TIME: Final = 0.2  # s
_FRACTION: Final = 0.5
"""Largest fraction of the joints' full speeds at which the body stands firmly."""
_GRAVITY: Final = 9.81  # m/s2
_LARGEST_REQUEST: Final = 2.5  # m, m/s or rad/s that an option asks for: observations show no more
_SEEDS: Final = 2**31


class Options(TypedDict, total=False):
    """Options of every environment."""

    render_mode: str | None
    """`rgb_array`, or None not to render."""
    noise: bool
    """True, the default, for senses as imperfect and late as a real robot's."""
    body: str
    """The name of a body, by default `H25`; its joints decide how long actions and observations are."""
    world: str
    """The name or the file of a world (docs/how-to/worlds.md); by default `empty`."""


class NaoEnvironment(gymnasium.Env[Array, Array]):
    """A robot that executes each action for PERIOD of simulated time.

    Each episode has its own robot: after `reset(seed=n)` the same actions lead to the same observations and
    rewards, bit by bit, whatever happened before. Actions move the joints `moved` of the body; observations
    are `each` numbers of each, such as its angle and speed, and `more` numbers. `option` is the option of
    `reset`. Raises RobotError for an unknown body, ValueError for one that lacks what the task needs.
    """

    each: ClassVar[int] = 2
    more: ClassVar[int]
    option: ClassVar[str]
    # Gymnasium declares it as the instance's own.
    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": round(1 / PERIOD)}  # noqa: RUF012

    def __init__(self, **options: Unpack[Options]) -> None:
        render_mode = options.get("render_mode")
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            raise ValueError(f"there is no render mode {render_mode!r}; there is 'rgb_array'")
        self.render_mode = render_mode
        self._body = find_body(options.get("body", DEFAULT_BODY))
        if missing := self.lacks(self._body):
            raise ValueError(
                f"the body {self._body.name} has no {missing}, which this task needs: choose another body"
            )
        self._weight = round(_GRAVITY * self._body.mass)  # N
        moved = self.moved(self._body)
        self._places = [place for place, name in enumerate(self._body.joint_names) if name in moved]
        self._moved = [self._body.joints[place] for place in self._places]
        self.observation_space = Box(
            -_LARGEST_NUMBER, _LARGEST_NUMBER, (self.each * len(self._moved) + self.more,), np.float32
        )
        self.action_space = Box(-1.0, 1.0, (len(self._moved),), np.float32)
        self._noise = options.get("noise", True)
        self._world = load_world(options.get("world", "empty"))
        self._clock = VirtualClock()
        self._robot: SimulatedRobot | None = None
        self._joints: JointReading
        self._inertial: InertialReading
        self._feet: tuple[FootReading, FootReading]
        self._truth: Truth

    @staticmethod
    @abstractmethod
    def lacks(body: Body) -> str:
        """Return what a body lacks for the task; empty when it lacks nothing."""

    @staticmethod
    @abstractmethod
    def moved(body: Body) -> Sequence[str]:
        """Return the joints of a body that actions move."""

    @property
    def robot(self) -> SimulatedRobot:
        """The robot of this episode. Raises gymnasium.error.ResetNeeded before the first reset."""
        if self._robot is None:
            raise gymnasium.error.ResetNeeded("call reset before anything else")
        return self._robot

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Begin an episode; return its first observation, and the same kind of info as `step`.

        Raises ValueError for an unknown option, or an invalid value.
        """
        if unknown := (options or {}).keys() - {self.option}:
            raise ValueError(f"reset has no option {sorted(unknown)[0]!r}; it has {self.option!r}")
        super().reset(seed=seed, options=options)
        self.close()
        self._clock = VirtualClock()
        self._robot = SimulatedRobot(
            clock=self._clock,
            world=self._world,
            skin=self.render_mode is not None,
            noise=self._noise,
            seed=int(self.np_random.integers(_SEEDS)),
            body=self._body,
        )
        self._clock.advance(_SETTLING_TIME)
        self._begin(options or {})
        self._look()
        return self._observe(), self._info()

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Execute an action for one step.

        Returns the observation after it, the reward, whether the episode has ended, False, and further info.
        Raises ValueError for an action of another shape, or with a number that is not finite; larger ones
        are clipped.
        """
        robot, values = self.robot, np.asarray(action, np.float64)
        if values.shape != self.action_space.shape:
            raise ValueError(f"the action has the shape {values.shape}, not {self.action_space.shape}")
        if not math.isfinite(sum(values.tolist())):
            raise ValueError(f"the action {values.tolist()} has a number that is not finite")
        self._act(robot, np.minimum(np.maximum(values, -1.0), 1.0))
        self._clock.advance(PERIOD)
        self._look()
        reward, ended = self._judge()
        return self._observe(), float(reward), bool(ended), False, self._info()

    def render(self) -> NDArray[np.uint8] | None:
        """Return a spectator's view, (240, 320, 3) bytes; None without the render mode `rgb_array`."""
        if self.render_mode is None:
            return None
        return self.robot.capture(*_RENDERED).pixels

    def close(self) -> None:
        """Release the robot; `reset` makes another one."""
        if self._robot is not None:
            self._robot.close()
            self._robot = None

    # -- specific to each environment -------------------------------------------------------------------

    @abstractmethod
    def _begin(self, options: Mapping[str, Any]) -> None:
        """Prepare the standing robot for the episode."""

    def _act(self, robot: SimulatedRobot, action: NDArray[np.float64]) -> None:
        """Command the robot by an action of numbers from -1 to 1: by default the speeds of the joints."""
        speeds = zip(self._moved, action.tolist(), strict=True)
        robot.command_velocities(
            {joint.name: _FRACTION * joint.max_velocity * part for joint, part in speeds}
        )

    @abstractmethod
    def _judge(self) -> tuple[float, bool]:
        """Return the reward of the last step, and whether it has ended the episode."""

    @abstractmethod
    def _features(self) -> Sequence[float]:
        """Return the observation, in numbers of about 1."""

    def _info(self) -> dict[str, Any]:
        """Return the `info` of a step, which a robot could not measure."""
        return {"time": self._truth.time, "torso": self._truth.torso.position}

    # -- common -----------------------------------------------------------------------------------------

    @property
    def fallen(self) -> bool:
        """Whether the robot lies."""
        return self.robot.state().fallen

    def _angles(self) -> list[float]:
        return [self._joints.positions[place] for place in self._places]

    def _speeds(self, scale: float) -> list[float]:
        return [scale * self._joints.velocities[place] for place in self._places]

    def _look(self) -> None:
        robot = self.robot
        self._joints = robot.read()
        self._inertial, self._feet = robot.senses.inertial(), robot.senses.record.feet()  # not its sonar
        self._truth = robot.stage.truth()

    def _observe(self) -> Array:
        features = np.array(self._features(), np.float32)
        return np.minimum(np.maximum(features, -_LARGEST_NUMBER), _LARGEST_NUMBER)

    def _balance(self) -> list[float]:
        """Return the sensed balance of the body: up (3), turning rate (3), loads of the soles (2).

        Loads are parts of the weight, and 0 for soles without sensors.
        """
        loads = [foot.total / self._weight for foot in self._feet]
        return [*self._inertial.up, *self._inertial.angular_velocity, *loads]


def three_numbers(value: Any, what: str) -> NDArray[np.float64]:  # noqa: ANN401
    """Return the three numbers of an option in m, m/s or rad/s. Raises ValueError."""
    numbers = np.asarray(value, np.float64)
    if numbers.shape != (3,) or not (np.abs(numbers) <= _LARGEST_REQUEST).all():
        raise ValueError(
            f"the {what} {value!r} is not three numbers from -{_LARGEST_REQUEST:g} to {_LARGEST_REQUEST:g}"
        )
    return numbers
