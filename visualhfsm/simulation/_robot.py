"""The robot of a test: the fake or the simulated one, served within the process in virtual time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np

from hfsm_runtime.virtual.clock import TaskClock
from hfsm_runtime.virtual.errors import UnknownName
from hfsm_runtime.virtual.network import VirtualNetwork
from naoserver.bodies import DEFAULT_BODY
from naoserver.bodies.parts import Axis
from naoserver.body import Body
from naoserver.errors import HardwareFailure
from naoserver.fake import FakeRobot
from naoserver.fake.robot import Point, paint
from naoserver.options import ServerOptions
from naoserver.protocol.jobs import Job, is_due
from naoserver.robot import BodyState, Frame, JointDevice, Robot
from naoserver.serving.assembly import Assembly
from naoserver.serving.medium import Membership
from naoserver.soccer_field import Field
from naoserver_sim.named_body import named_body
from visualhfsm._base.errors import MissingPackageError
from zenoh_ice import Object, WallClock

from ._kinds import CameraKind, EyesKind, RobotKind

if TYPE_CHECKING:
    from naoserver_sim.robot import ArenaRobot

_COLORS: Final = {"BallRed": (220, 30, 30), "BallGreen": (30, 200, 40)}


class Ball:
    """A ball, for a test to place: its bearing in rad, positive to the left, distance and height in m."""

    def __init__(self, device: JointDevice) -> None:
        self._device: Final = device

    @property
    def position(self) -> tuple[float, float, float]:
        """Its position: bearing in rad, distance and height in m."""
        pan, distance, height = self._device.read().positions
        return pan, distance, height

    def place(
        self, pan: float | None = None, distance: float | None = None, height: float | None = None
    ) -> None:
        """Place it immediately; omitted coordinates keep their values."""
        cast("Any", self._device).place(self._targets(pan, distance, height))

    def move(
        self,
        pan: float | None = None,
        distance: float | None = None,
        height: float | None = None,
        *,
        speed: float = 0.5,
    ) -> None:
        """Move it as time passes, each axis at `speed` in rad/s or m/s."""
        targets = self._targets(pan, distance, height)
        self._device.command_positions(targets, dict.fromkeys(targets, speed))

    def hide(self) -> None:
        """Put it behind the robot, where no camera sees it."""
        self.place(pan=math.pi)

    def _targets(self, pan: float | None, distance: float | None, height: float | None) -> dict[str, float]:
        given = zip(self._device.joints, (pan, distance, height), strict=True)
        return {joint.name: value for joint, value in given if value is not None}


class RobotUnderTest:
    """A robot with its real servants and its safety layer, driven by the clock of a test.

    `camera` is the source of images: `drawn` paints the balls as discs, `rendered` lets the simulation render
    them, `auto` is `rendered` for the simulation where there is GL and `drawn` otherwise. Drawn images are
    the same on every machine. `eyes` say what serves `Sight`: `pictures` need OpenCV. `body` is its body: the
    name of one that is known, the TOML file of one's own, or a `Body`. `kind` may also be a robot that is
    there already. `member` says who it is in its team. Raises RobotError when the body cannot be read, and
    MissingPackageError without OpenCV.
    """

    def __init__(
        self,
        kind: RobotKind | Robot,
        clock: TaskClock,
        network: VirtualNetwork,
        *,
        camera: CameraKind = "auto",
        eyes: EyesKind = "truth",
        body: str | Path | Body = DEFAULT_BODY,
        options: ServerOptions | None = None,
        member: Membership | None = None,
        **settings: Any,  # noqa: ANN401 - those of the robot's constructor
    ) -> None:
        self.device: Final[Robot] = _device(kind, clock, camera, body, settings)
        """The robot itself, below its safety layer."""
        options = options or ServerOptions()
        self._assembly: Final = Assembly(self.device, options, clock, hears=True, member=member)
        for identity, servant in self._assembly.servants.items():
            network.serve(identity, servant)
        if self._assembly.link is not None:
            self._assembly.link.impair = network.impair
        if eyes == "pictures":
            self._serve_pictures(network)
        jobs = _VirtualJobs(clock, self._assembly.jobs)
        self._assembly.on_wake = network.on_listening = jobs.wake
        jobs.wake()
        self.device.start()

    def _serve_pictures(self, network: VirtualNetwork) -> None:
        try:
            from naoserver.eyes.local import local_sight
        except ModuleNotFoundError as error:
            raise MissingPackageError("OpenCV", "vision") from error
        servants, eyes = self._assembly.servants, self.device.eyes
        cameras = {camera.name: servants[camera.name] for camera in self.device.body.cameras}
        sight = local_sight(cameras, eyes.field if eyes else Field())
        network.serve("Sight", sight, {"getSight": sight.stream.now})

    @property
    def joints(self) -> dict[str, float]:
        """Joint angles in rad, by name."""
        names = (joint.name for joint in self.device.joints)
        return dict(zip(names, self.device.read().positions, strict=True))

    @property
    def head(self) -> tuple[float, float]:
        """Pan, positive to the left, and tilt, positive downwards, of the head in rad.

        Raises UnknownName for a body without a neck.
        """
        neck, joints = self.device.body.neck, self.joints
        if neck is None:
            raise UnknownName(f"a {self.device.body.name} has no neck that pans and tilts")
        pan, tilt = neck.axes[Axis.PAN], neck.axes[Axis.TILT]
        return pan.of(joints[pan.joint]), tilt.of(joints[tilt.joint])

    @property
    def description(self) -> Object:
        """The servant that describes its body and its looks."""
        return self._assembly.servants["Description"]

    @property
    def state(self) -> BodyState:
        """State of the robot as a whole, and whether it has fallen."""
        return self.device.state()

    @property
    def health(self) -> list[str]:
        """Reports of the safety layer and the servants, oldest first: limited commands, timeouts."""
        events, _, _ = self._assembly.events.snapshot()
        return [f"{event.time:.2f} s {event.source}: {event.message}" for event in events]

    def joint(self, name: str) -> float:
        """Return the angle of a joint in rad."""
        try:
            return self.joints[name]
        except KeyError:
            raise UnknownName(f"there is no joint {name!r}; there are {', '.join(self.joints)}") from None

    def ball(self, name: str) -> Ball:
        """Return a ball by its color or its full name: `green` or `BallGreen`."""
        for device in self.device.mechanisms:
            if name in (device.name, device.name.removeprefix("Ball").lower()):
                return Ball(device)
        known = ", ".join(device.name for device in self.device.mechanisms) or "none"
        raise UnknownName(f"there is no ball {name!r}; there are {known}")

    def place(self, **joints: float) -> None:
        """Set the angles of some joints in rad immediately, bypassing the safety layer."""
        cast("Any", self.device).place(joints)

    def put(self, x: float, y: float, heading: float) -> None:
        """Put it on its feet somewhere, in m and rad, as `Scene.placeRobot` does. Raises InvalidCommand."""
        assert self.device.stage is not None  # there is none without a simulation
        self.device.stage.place_robot(x, y, heading, self._assembly.end_motion)

    def fail(
        self, part: str, kind: str, amount: float | None = None, *, seconds: float | None = None
    ) -> None:
        """Let a part fail from now on, such as `fail("Camera", "frozen")`, as `Faults.inject` does.

        Raises InvalidCommand for what cannot fail so, with what can.
        """
        assert self.device.faults is not None  # only a real robot has none
        self.device.faults.inject(part, kind, amount, seconds)

    def heal(self, part: str | None = None) -> None:
        """End the failures of a part, or all of them. Raises InvalidCommand for a part that there is not."""
        assert self.device.faults is not None  # only a real robot has none
        self.device.faults.heal(part)

    def hear(self, sentence: str) -> None:
        """Say a sentence to the robot, as `Scene.sayToRobot` does."""
        self._assembly.hearing.hear(sentence)

    def look(self, camera: str = "Camera", width: int = 320, height: int = 240) -> Frame:
        """Return the present image of a camera."""
        return self.device.capture(camera, width, height)

    def close(self) -> None:
        """Stop all motion and release the robot's resources."""
        self._assembly.close()
        self.device.close()


class _VirtualJobs:
    """Run the jobs of a server in virtual time, in the thread that advances the clock."""

    def __init__(self, clock: TaskClock, jobs: Sequence[Job]) -> None:
        self._clock = clock
        self._jobs = jobs
        self._scheduled: dict[Job, float] = {}

    def wake(self) -> None:
        """Check when each job is due: a client listens now, or something was commanded."""
        for job in self._jobs:
            self._schedule(job)

    def _schedule(self, job: Job) -> None:
        due = job.due(self._clock.now())
        if due < self._scheduled.get(job, math.inf):
            self._scheduled[job] = due
            self._clock.call_at(due, lambda: self._run(job, due))

    def _run(self, job: Job, due: float) -> None:
        if self._scheduled.get(job) != due:
            return  # it became due earlier, and has run already
        del self._scheduled[job]
        if is_due(job, self._clock.now()):
            job.run()
        self._schedule(job)


def served_interfaces(body: str | Path = DEFAULT_BODY) -> dict[str, list[str]]:
    """Return what a robot with a body serves: identities, each with the type id of its interface.

    Raises RobotError when the body cannot be read.
    """
    clock = WallClock()
    assembly = Assembly(FakeRobot(clock, body=named_body(body)), ServerOptions(), clock, hears=True)
    return {name: [servant.ice_interface.type_id] for name, servant in assembly.servants.items()}


def _device(
    kind: RobotKind | Robot,
    clock: TaskClock,
    camera: CameraKind,
    body: str | Path | Body,
    settings: Any,  # noqa: ANN401
) -> Robot:
    if not isinstance(kind, str):
        return kind
    if kind not in ("fake", "sim"):
        raise ValueError(f"robot is {kind!r}: it is 'fake', 'sim' or None")
    settings = {**settings, "body": body if isinstance(body, Body) else named_body(body)}
    return FakeRobot(clock, **settings) if kind == "fake" else _simulated(clock, camera, settings)


def _simulated(clock: TaskClock, camera: CameraKind, settings: Mapping[str, Any]) -> Robot:
    from naoserver_sim.robot import SimulatedRobot  # load MuJoCo only when it is used
    from naoserver_sim.world import load_world

    if isinstance(world := settings.get("world"), str):
        settings = {**settings, "world": load_world(world)}
    return as_camera(SimulatedRobot(clock=clock, **{"skin": camera != "drawn", **settings}), camera)


def as_camera(robot: ArenaRobot, camera: CameraKind) -> Robot:
    """Return a simulated robot whose images come from a source."""
    if camera == "drawn" or (camera == "auto" and not _has_gl()):
        return cast("Robot", _DrawnCameras(robot))
    return robot


def _has_gl() -> bool:
    from naoserver_sim.cameras import create_context

    try:
        create_context(16, 16).free()
    except HardwareFailure:
        return False
    return True


class _DrawnCameras:
    """A simulated robot whose cameras draw the balls instead of rendering them."""

    def __init__(self, robot: ArenaRobot) -> None:
        self._robot = robot

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - whatever the robot has
        return getattr(self._robot, name)

    def capture(self, camera: str, width: int, height: int) -> Frame:
        """Draw what a camera sees, as far as it does not fail."""
        draw = partial(self._draw, camera, width, height)
        return self._robot.failing_senses.frame(camera, (width, height), draw)

    def _draw(self, camera: str, width: int, height: int) -> Frame:
        """Draw each ball as a disc of its color on a grey ground."""
        from naoserver_sim.world import BALL_RADIUS

        facts = {facts.name: facts for facts in self._robot.cameras}.get(camera)
        if facts is None:
            raise HardwareFailure(f"there is no camera {camera!r}")
        place, axes = self._robot.camera_pose(camera)
        balls: list[tuple[Point, tuple[int, int, int]]] = []
        for device in self._robot.mechanisms:
            pan, distance, up = device.read().positions
            ball = np.array([distance * math.cos(pan), distance * math.sin(pan), up])
            x, y, z = ((ball - place) @ axes).tolist()  # right, up, backwards
            balls.append(((-z, -x, y), _COLORS.get(device.name, (200, 200, 40))))
        time = self._robot.read().time
        return Frame(camera, time, width, height, paint(facts, (width, height), balls, BALL_RADIUS))
