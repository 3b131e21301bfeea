"""The simulated robot behind the `Robot` protocol, running at any pace or stepped by its caller."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cached_property, partial
from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.bodies import DEFAULT_BODY, find_body
from naoserver.bodies.capabilities import Color, JointCommand, OwnPostures
from naoserver.bodies.description import write_looks
from naoserver.bodies.faults import LEDS, SOUNDS, SPEECH
from naoserver.bodies.footsteps import Footsteps
from naoserver.bodies.parts import Steps, Wheels
from naoserver.body import Body
from naoserver.errors import RobotError
from naoserver.protocol.expression import FadingLights, TimedSounds, TimedVoice
from naoserver.protocol.failing_senses import FailingEyes, FailingSenses
from naoserver.protocol.faults import Faults
from naoserver.protocol.jobs import ControlLoop
from naoserver.robot import BodyState, Frame, JointReading
from naoserver_sim._balance import SimulatedBalancer
from naoserver_sim._faults import FailingBody
from naoserver_sim._footsteps.estimator import BodySensors
from naoserver_sim._footsteps.limbs import limbs_of
from naoserver_sim._footsteps.walker import FootstepWalker
from naoserver_sim._image_sensor import ImageSensor, PictureNoise
from naoserver_sim._locomotion import Locomotion
from naoserver_sim._motors import AMBIENT, PLAY, Gears, SetpointController
from naoserver_sim._senses.record import SenseNoise, SensorRecord
from naoserver_sim._senses.sight import SimulatedEyes
from naoserver_sim._senses.simulated import SimulatedSenses
from naoserver_sim._simulator import Physics, RunningPhysics, Simulator, Snapshot
from naoserver_sim._stage import SimulatedStage
from naoserver_sim._walk.walker import SimulatedWalker
from naoserver_sim._wheels import DifferentialDrive
from naoserver_sim.appearance import Lamps
from naoserver_sim.cameras import CameraLimits, CameraRenderer, put_cameras
from naoserver_sim.model import DeviceIndex, Model
from naoserver_sim.standing import build_standing
from naoserver_sim.world import DEFAULT_WORLD, World, load_world, scattered
from zenoh_ice import VirtualClock

_SEED: Final = 0
"""The seed of the noise in virtual time, the same each time unless another one is given."""
_SCATTER: Final = 86
"""What distinguishes the random numbers of failures from others of a seed."""
_CAMERA_LIMITS: Final = CameraLimits()


class SimulatedDevice:
    """Some joints of a simulation: the robot's, or those of a mechanism that carries a ball.

    Implements JointDevice. Commands raise KeyError when a joint is unknown, passive or has no speed.
    """

    def __init__(self, name: str, simulator: Simulator, index: DeviceIndex) -> None:
        self.name: Final = name
        self.joints: Final = index.joints
        self._simulator: Final = simulator
        self._index = index
        self._places = {joint.name: place for place, joint in enumerate(index.joints)}
        self._movable = {joint.name: self._places[joint.name] for joint in index.joints if not joint.passive}
        self._leading = frozenset(index.leading.tolist())
        self._newest: tuple[Snapshot, JointReading] | None = None
        # The arrays that stay the same for many ticks, and what was read from them.
        self._last: dict[str, tuple[NDArray[np.float64], tuple[float, ...]]] = {}

    def read(self) -> JointReading:
        snapshot, newest = self._simulator.newest(), self._newest
        if newest is not None and newest[0] is snapshot:
            return newest[1]
        reading = self._reading(snapshot)
        self._newest = snapshot, reading
        return reading

    def _reading(self, snapshot: Snapshot) -> JointReading:
        index = self._index
        return JointReading(
            time=snapshot.time,
            positions=tuple(self._angles(snapshot).tolist()),
            velocities=tuple(snapshot.qvel[index.dofs].tolist()),
            commands=tuple(index.commanded(snapshot.setpoints, snapshot.qpos).tolist()),
            torques=tuple(index.of_motors(snapshot.forces, 0.0).tolist()),
            stiffnesses=self._kept("stiffnesses", snapshot.stiffnesses, 0.0),
            temperatures=self._kept("temperatures", snapshot.temperatures, AMBIENT),
        )

    def _kept(self, what: str, values: NDArray[np.float64], passive: float) -> tuple[float, ...]:
        """Return the values of all joints, of an array that is replaced when they change."""
        last = self._last.get(what)
        if last is None or last[0] is not values:
            last = self._last[what] = values, tuple(self._index.of_motors(values, passive).tolist())
        return last[1]

    def _angles(self, snapshot: Snapshot) -> NDArray[np.float64]:
        """Return the angles of the joints as they are measured, in rad or m."""
        return snapshot.measured[self._index.qpos]

    def command_positions(self, targets: Mapping[str, float], max_speeds: Mapping[str, float]) -> None:
        index = self._index
        places, values = self._given(targets)
        speeds = np.array([max_speeds[self.joints[place].name] for place in places])
        values = (values - index.offsets[places]) / index.ratios[places]
        speeds = np.abs(speeds / index.ratios[places])
        self._order(self._simulator.move, places, values, speeds)

    def command_velocities(self, velocities: Mapping[str, float]) -> None:
        places, values = self._given(velocities)
        values /= self._index.ratios[places]
        self._order(self._simulator.move, places, np.copysign(np.inf, values), np.abs(values))

    def command_stiffnesses(self, stiffnesses: Mapping[str, float], seconds: float) -> None:
        self._order(self._simulator.motors.stiffen, *self._given(stiffnesses), seconds)

    def command_gains(self, commands: Mapping[str, JointCommand]) -> None:
        places = [self._places[name] for name in commands]
        self._order(self._simulator.follow, places, np.array([*commands.values()]))

    def place(self, positions: Mapping[str, float]) -> None:
        """Put some joints at positions at once, where they rest: for tests, to set a scene.

        Raises KeyError when a joint is unknown, RobotError unless the robot follows a virtual clock.
        """
        simulator, index = self._simulator, self._index
        if not simulator.virtual:
            raise RobotError("only a simulation that follows a virtual clock can be set to a place")
        at = [self._places[name] for name in positions]
        places, values = self._given({name: positions[name] for name in positions if name in self._movable})
        values = (values - index.offsets[places]) / index.ratios[places]

        def put() -> None:
            simulator.put(index.qpos[at], index.dofs[at], np.array([*positions.values()]))
            simulator.hold(index.motors[places], values)

        simulator.at_once(put)

    def _given(self, values: Mapping[str, float]) -> tuple[list[int], NDArray[np.float64]]:
        """Return indices and values of the named joints, the leader of those with one motor last."""
        places = [self._movable[name] for name in values]
        places.sort(key=self._leading.__contains__)
        return places, np.array([values[self.joints[place].name] for place in places])

    def _order(self, action: Callable[..., None], places: list[int], *values: object) -> None:
        self._simulator.order(partial(action, self._index.motors[places], *values))


def _locomotion_of(
    model: Model, simulator: Simulator, sensors: SensorRecord, *, noise: bool
) -> Locomotion | None:
    """Return the part that moves a robot over the floor; None for one that stays where it is."""
    match model.body.walk:
        case Steps():
            groups, shoulders = model.body.groups, {"LeftShoulder", "RightShoulder"}
            legs = len(groups.left_leg), len(groups.right_leg)
            if legs != (6, 6) or not shoulders <= model.body.hinges.keys():
                why = "steps are for the legs and arms of a Nao; use footsteps for other bodies"
                raise RobotError(f"walk: {why}")
            return SimulatedWalker(model, simulator, sensors, noise=noise)
        case Footsteps() as footsteps:
            limbs = limbs_of(simulator.mj, model.body)
            delay = SenseNoise().delay if noise else 0
            return FootstepWalker(
                footsteps,
                limbs,
                simulator,
                BodySensors(simulator, limbs, lambda: sensors.newest.inertial, noise=noise, delay=delay),
                joints=model.body.groups.legs,
                latency=(model.body.play or PLAY).delay * simulator.tick_period if noise else 0.0,
            )
        case Wheels() as wheels:
            return DifferentialDrive(model, simulator, sensors, wheels)
        case None:
            return None


class ArenaRobot(SimulatedDevice):
    """A robot that others may stand beside, in physics whose time runs without it; implements `Robot`.

    `name` is what it is called, `team` whom it plays for, `shirt` the color of its trunk. `start` and `close`
    are for its cameras only.
    """

    postures: OwnPostures | None = None

    def __init__(
        self,
        name: str,
        model: Model,
        running: RunningPhysics,
        *,
        team: str = "",
        shirt: Color | None = None,
        seed: int | None = None,
        noise: bool = False,
        camera_limits: CameraLimits = _CAMERA_LIMITS,
    ) -> None:
        body, physics = model.body, running.physics
        commanded = physics.data.ctrl[model.share.motors]
        setpoints = _setpoints(model, commanded)
        random = np.random.default_rng(seed)
        gears = None
        if noise:
            gears = Gears(body.play or PLAY, commanded, len(model.robot.leading), random.spawn(1)[0])
        simulator = Simulator(physics, setpoints, gears, heat=body.motor_heat, mj=model.mj, share=model.share)
        self._running: Final = running
        self.clock: Final = running.clock
        self.team: Final = team
        self._shirt: Final = shirt
        super().__init__(name, simulator, model.robot)
        self.body: Final = body
        self.cameras: Final = model.cameras
        self.gains: Final = self if body.gains else None
        self.faults: Final = Faults(body, self.clock, physics=True, seed=seed or 0)
        self.failing_senses: Final = FailingSenses(self.faults, body)
        """What its senses report while parts of it fail."""
        scatter = np.random.default_rng((0 if seed is None else abs(seed), _SCATTER))
        self._failing_body = simulator.failing = FailingBody(model, simulator, self.faults, scatter)
        self.senses: Final = SimulatedSenses(
            model, simulator, SenseNoise() if noise else None, random, self.failing_senses
        )
        self.walker: Final[Locomotion | None] = _locomotion_of(
            model, simulator, self.senses.record, noise=noise
        )
        walker = self.walker
        self.balancer: SimulatedBalancer | None = None
        if walker is not None and isinstance(body.walk, Steps):
            self.balancer = SimulatedBalancer(model, simulator, self.senses.record, lambda: walker.walking)
        self.stage: Final = SimulatedStage(
            model, simulator, press=self.senses.press, moved=self._lose_footing
        )
        self.control_loop: Final = ControlLoop()
        simulator.on_tick = self.control_loop.tick
        simulator.watchers.append(self.senses.sample)
        for part in (self.walker, self.balancer, self.stage):
            if part is not None:
                simulator.parts.append(part.tick)
        self._model = model
        self.eyes: FailingEyes | None = None
        if body.cameras:
            eyes = SimulatedEyes(model, simulator, noise=noise, seed=seed)
            self.eyes = FailingEyes(eyes, self.failing_senses)
        now, fails = self.clock.now, self.faults.of
        self.lights: Final = FadingLights(now, body.lights, partial(fails, LEDS, "dark"))
        self.voice: Final = TimedVoice(now, partial(fails, SPEECH, "silent")) if body.voice else None
        self.loudspeaker: Final = TimedSounds(now, partial(fails, SOUNDS, "silent")) if body.voice else None
        lamps = Lamps(model.whole, self.lights.colors, model.share.prefix)
        sensor = None
        if noise:
            everything = physics.data.qpos
            sensor = ImageSensor(PictureNoise(), body.cameras, seed, everything)
            simulator.watchers.append(partial(sensor.expose, qpos=everything))
        self._renderer = CameraRenderer(
            model.whole,
            model.cameras,
            simulator.past,
            lamps,
            sensor,
            prefix=model.share.prefix,
            virtual=physics.virtual,
            limits=camera_limits,
        )
        self.mechanisms: Final = tuple(
            SimulatedDevice(name, simulator, index) for name, index in model.balls.items()
        )

    def _angles(self, snapshot: Snapshot) -> NDArray[np.float64]:
        angles = super()._angles(snapshot)
        return self.senses.record.encoded(angles)

    def looks(self) -> str:
        return write_looks(self.body, self._shirt)

    def state(self) -> BodyState:
        at = self._model.base.qpos
        _, x, y, _ = self._simulator.newest().qpos[at + 3 : at + 7].tolist()
        tilt = math.acos(max(-1.0, min(1.0, 1.0 - 2.0 * (x * x + y * y))))
        return BodyState(tilt, tilt > self.body.lying_tilt, self.clock.rate, self._running.lag)

    def capture(self, camera: str, width: int, height: int) -> Frame:
        return self.failing_senses.frame(
            camera, (width, height), partial(self._renderer.capture, camera, width, height)
        )

    @property
    def blind(self) -> str:
        """Why its cameras show nothing, as where there is no GL; empty as far as is known."""
        return self._renderer.failure or ""

    @cached_property
    def _scratch(self) -> mujoco.MjData:
        return mujoco.MjData(self._model.whole)

    def camera_pose(self, camera: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return a camera's position in the world in m, and its axes as columns: right, up, backwards.

        Raises KeyError when there is no such camera.
        """
        mj, data = self._model.whole, self._scratch
        put_cameras(mj, data, self._simulator.newest().whole_qpos)
        index = mj.camera(self._model.share.prefix + camera).id
        return data.cam_xpos[index].copy(), data.cam_xmat[index].reshape(3, 3).copy()

    def start(self, *, cameras: bool = False) -> None:
        """Start the thread of the cameras if `cameras`; with a virtual clock there is none."""
        if not self._simulator.virtual:
            (self._renderer.start if cameras else self._renderer.check)()

    def check(self) -> None:
        """Raise RobotError when an error has stopped the physics."""
        self._running.check()

    def _lose_footing(self) -> None:
        """End what holds only while it stands where it stood: it is placed elsewhere."""
        self._failing_body.settle()
        self._simulator.measure_again()
        self.senses.record.begin_again()
        if self.walker is not None:
            self.walker.abandon()
        if self.balancer is not None:
            self.balancer.abandon()

    def close(self) -> None:
        """End the thread of the cameras and free GL."""
        self._renderer.close()


class SimulatedRobot(ArenaRobot):
    """A robot in MuJoCo, at rest and alone in a world; without one in the default world, with two balls.

    `body` is what it is, by default a Nao H25; `posture` the one in which it begins, by default the body's
    rest.

    `speed` is in simulated seconds per wall second; `math.inf` is as fast as possible. With `clock`, a
    virtual one, there are no threads: the robot moves in the thread that advances that clock, and the same
    commands at the same times with the same seed give the same trace bit by bit.

    `seed` scatters the balls' starting places within the head's reach; without it they start in view. With
    `noise`, senses, pictures and gears are as imperfect as those of a real robot, with random numbers from
    the seed. Without a seed they are different each time, and with a virtual clock the same each time.
    `camera_limits` say how long callers wait for images.
    """

    def __init__(
        self,
        *,
        speed: float = 1.0,
        world: World | None = None,
        skin: bool = True,
        seed: int | None = None,
        noise: bool = False,
        posture: str | None = None,
        clock: VirtualClock | None = None,
        body: Body | None = None,
        camera_limits: CameraLimits = _CAMERA_LIMITS,
    ) -> None:
        body = body or find_body(DEFAULT_BODY)
        world, seed = seeded(world, seed, virtual=clock is not None)
        model, data = build_standing(world, posture, skin=skin, body=body)
        running = RunningPhysics(Physics(model.whole, data), speed, clock)
        name = body.title or body.name
        super().__init__(name, model, running, seed=seed, noise=noise, camera_limits=camera_limits)

    @property
    def robots(self) -> tuple[ArenaRobot, ...]:
        """The robots of the world, as those of an `Arena`: this one."""
        return (self,)

    def start(self, *, cameras: bool = False) -> None:
        """Start the thread of the physics, and with `cameras` theirs; with a virtual clock there are none."""
        super().start(cameras=cameras)
        self._running.start()

    def close(self) -> None:
        """End the threads of physics and cameras and free GL."""
        self._running.close()
        super().close()


def seeded(world: World | None, seed: int | None, *, virtual: bool) -> tuple[World, int | None]:
    """Return a world with its balls scattered by a seed, and the seed: virtual time always has one."""
    world = world or load_world(DEFAULT_WORLD)
    if seed is not None:
        return scattered(world, np.random.default_rng(seed)), seed
    return world, _SEED if virtual else None


def _setpoints(model: Model, commanded: NDArray[np.float64]) -> SetpointController:
    """Return the setpoints of all motors, held where they are commanded."""
    speeds = np.zeros(model.mj.nu)
    for device in (model.robot, *model.balls.values()):
        speeds[device.own_motors] = [device.joints[place].max_velocity for place in device.leading]
    lower, upper = model.mj.actuator_ctrlrange.T.copy()
    endless = model.mj.actuator_ctrllimited == 0
    lower[endless], upper[endless] = -math.inf, math.inf
    return SetpointController(commanded.copy(), lower, upper, speeds)
