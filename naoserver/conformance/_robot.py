"""The robot under test: served on loopback, called over a separate session, and waited for.

A test needs parts of a robot, by the words with which it is skipped, and joints that it may move.
"""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from typing import Any, Final, TypeVar
from uuid import uuid4

import pytest

from naoserver.bodies.body import Body
from naoserver.bodies.parts import Axis, Joint
from naoserver.errors import InvalidCommand
from naoserver.moves.motion_file import load_motions
from naoserver.options import ServerOptions
from naoserver.protocol.robot import JointReading, Robot
from naoserver.serving.assembly import Assembly
from naoserver.serving.server import serve
from zenoh_ice import Communicator, ObjectPrx, initialize

LIMIT: Final = 20.0
"""Seconds within which what the contract promises must come true, unless a caller gives another limit."""
_LEASE: Final = 20.0
"""In s: server and client share one interpreter, and a busy machine must not cost them their link."""
_LOOK: Final = 0.002
"""Seconds between two looks at a robot that moves."""

P = TypeVar("P", bound=ObjectPrx)


@dataclass(frozen=True)
class ServedRobot:
    """A served robot and its endpoint."""

    robot: Robot
    assembly: Assembly
    serving: ExitStack
    """Closing it ends the server before the robot and its session."""
    served_by: Communicator
    realm: str
    endpoint: str
    limit: float
    """Seconds within which what is waited for must come true."""

    @contextmanager
    def client(self, **settings: Any) -> Iterator[RobotClient]:  # noqa: ANN401
        """Open a client's session, with further settings; it knows all that is served by now."""
        common = {"listen": ["tcp/127.0.0.1:0"], "connect": [self.endpoint], "clock": "wall", "lease": _LEASE}
        with initialize(realm=self.realm, **{**common, **settings}) as communicator:
            client = RobotClient(**{**vars(self), "communicator": communicator})
            known, served = communicator.presence.interfaces, self.served_by.served.copy()
            client.until(
                lambda: all(each.fingerprints.keys() <= known(at).keys() for at, each in served.items()),
                "a client knows what is served",
            )
            yield client

    def until(self, condition: Callable[[], object], promise: str) -> None:
        """Wait until a condition holds. Raises AssertionError with the promise that is broken otherwise."""
        deadline = time.monotonic() + self.limit
        while not condition():
            assert time.monotonic() < deadline, f"not within {self.limit:g} s: {promise}"
            time.sleep(_LOOK)

    def readings(self, done: Callable[[JointReading], object], promise: str) -> list[JointReading]:
        """Return the robot's readings from now to the first that is `done`, each once.

        Raises AssertionError with the promise that is broken if there is none within the limit.
        """
        seen = [self.robot.read()]

        def sample() -> object:
            if (reading := self.robot.read()) is not seen[-1]:
                seen.append(reading)
            return done(seen[-1])

        self.until(sample, promise)
        return seen

    def watched(self, seconds: float) -> list[JointReading]:
        """Return the robot's readings from now to some seconds of its time later."""
        end = self.robot.clock.now() + seconds
        return self.readings(lambda reading: reading.time >= end, "the time of readings goes on")

    def is_free(self, joint: str) -> bool:
        """Return whether anybody may command a joint: no activity, such as the walk, has claimed it."""
        try:
            self.assembly.body.claims.check([joint])
        except InvalidCommand:
            return False
        return True


@dataclass(frozen=True)
class RobotClient(ServedRobot):
    """A served robot, and a session that calls it."""

    communicator: Communicator

    def proxy(self, interface: type[P], identity: str) -> P:
        """Return a checked proxy over the wire."""
        return interface.checkedCast(self.communicator.stringToProxy(identity))


@contextmanager
def served(
    robot: Robot,
    options: ServerOptions | None = None,
    *,
    realm: str = "",
    endpoint: str = "",
    limit: float = LIMIT,
) -> Iterator[ServedRobot]:
    """Start and serve a robot on loopback, by default in a separate realm; close both at the end."""
    realm, endpoint = realm or f"test-{uuid4().hex[:8]}", endpoint or f"tcp/127.0.0.1:{_free_port()}"
    with (
        closing(robot),
        initialize(realm=realm, listen=[endpoint], connect=[], clock="wall", lease=_LEASE) as communicator,
    ):
        robot.start()
        adapter = communicator.createObjectAdapter("Robot")
        with ExitStack() as serving:
            assembly = serving.enter_context(serve(robot, adapter, options))
            adapter.activate()
            yield ServedRobot(robot, assembly, serving, communicator, realm, endpoint, limit)


def _free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port: int = free.getsockname()[1]
    return port


STEP: Final = 0.15
"""How far a test moves a joint, at most: in rad, or in m."""


@dataclass(frozen=True)
class Need:
    """A part of a robot without which a test means nothing."""

    lacking: str
    """How a robot without it is described, such as `no walk`."""
    has: Callable[[Robot], object]


needs: Final = pytest.mark.needs
"""Skips a test, by the name of what is missing, for a robot that lacks one of the parts, each a `Need`."""


def free_joints(body: Body) -> list[Joint]:
    """Return the joints that may move alone, those first that carry least: no legs, wheels, couplings."""
    bound = {name for pair in body.couplings for name in (pair.leader, pair.follower)}
    bound |= {*body.groups.wheels}
    if not body.mounted:
        bound |= {*body.groups.legs}
    free = (joint for joint in body.joints if joint.name not in bound)
    able = (joint for joint in free if joint.max_torque > 0.0 and step_of(joint) > 0.01)
    return sorted(able, key=lambda joint: _mass_on(body, joint))


def _mass_on(body: Body, joint: Joint) -> float:
    """Return the mass in kg that a joint moves."""
    carried = {joint.child}
    for link in body.links:  # each after the one that carries it
        if (by := body.moved_by.get(link.name)) is not None and by.parent in carried:
            carried.add(link.name)
    return sum(link.mass for link in body.links if link.name in carried)


def step_of(joint: Joint) -> float:
    """Return how far a test moves a joint: in rad, or in m."""
    return min(STEP, 0.2 * (joint.upper - joint.lower))


def tolerance_of(joint: Joint) -> float:
    """Return how far a joint may be from its setpoint: one that carries a load, or has some play."""
    return step_of(joint) / 3.0


def speed_of(joint: Joint) -> float:
    """Return how fast a test moves a joint, in half a second or more: in rad/s, or in m/s."""
    return min(2.0 * step_of(joint), 0.25 * joint.max_velocity)


def free_hinge(body: Body) -> tuple[str, Axis] | None:
    """Return a hinge whose joints may all move alone, and its first axis, if there is one."""
    free = {joint.name for joint in free_joints(body)}
    for name, axes in body.hinges.items():
        if free.issuperset(of.joint for of in axes.values()):
            return name, next(iter(axes))
    return None


def slowly(robot: Robot, joint: Joint) -> float:
    """Return the fraction of full speed at which a step takes 4 s of the wall: time to stop it."""
    return step_of(joint) / joint.max_velocity / (4.0 * max(1.0, robot.clock.rate))


def target_of(joint: Joint, position: float) -> float:
    """Return the place a step away from a position, to where there is more room."""
    return position + (
        step_of(joint) if joint.upper - position >= position - joint.lower else -step_of(joint)
    )


def _stands(robot: Robot) -> bool:
    """Return whether a robot is upright, with its weight on the pressure sensors of its soles."""
    if robot.senses is None or robot.state().torso_tilt > 0.2:
        return False
    reading = robot.senses.read()
    return reading.left_foot.total + reading.right_foot.total > 2.0 * robot.body.mass


JOINT: Final = Need("no joint that may move alone", lambda robot: free_joints(robot.body))
HINGE: Final = Need("no hinge that may move alone", lambda robot: free_hinge(robot.body))
NECK: Final = Need("no neck", lambda robot: robot.body.neck)
GAINS: Final = Need("no commands with gains", lambda robot: robot.gains and robot.body.gains)
COUPLING: Final = Need("no couplings", lambda robot: robot.body.couplings)
CAMERA: Final = Need("no camera", lambda robot: robot.cameras)
INERTIAL_UNIT: Final = Need("no inertial unit", lambda robot: robot.body.inertial_unit)
PRESSURE: Final = Need("no pressure sensors", lambda robot: any(sole.pressure for sole in robot.body.soles))
STANDING: Final = Need("it does not stand on its feet", _stands)
SONAR: Final = Need("no sonar", lambda robot: robot.body.sonar)
TOUCH: Final = Need("no touch sensors", lambda robot: robot.body.touch)
BATTERY: Final = Need("no battery", lambda robot: robot.body.battery)
LIGHTS: Final = Need("no lights", lambda robot: robot.body.lights)
VOICE: Final = Need("no voice", lambda robot: robot.voice)
LOUDSPEAKER: Final = Need("no loudspeaker", lambda robot: robot.loudspeaker)
CROUCH: Final = Need("no posture Crouch", lambda robot: "Crouch" in robot.body.postures)
WAVE: Final = Need("no motion wave", lambda robot: "wave" in load_motions(robot.body))
WALK: Final = Need("no walk", lambda robot: robot.walker)
ROOM: Final = Need("no --room", lambda _: True)
"""The word of who runs the suite that there is free floor around the robot."""
