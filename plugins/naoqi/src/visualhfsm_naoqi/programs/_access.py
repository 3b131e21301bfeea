"""The services' access to a robot: readings, guarded commands, the walk, and the other services."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack
from functools import wraps
from pathlib import Path
from typing import Any, Final, TypeVar

import qi

from interfaces.nao import ActionStatus
from naoserver.bodies.capabilities import Odometry, Support, WalkVelocity
from naoserver.bodies.kinematics import Matrix, kinematics_of, rotation
from naoserver.errors import HardwareFailure, InvalidCommand
from naoserver.moves.joint_paths import PERIOD
from naoserver.moves.walk import way_to
from naoserver.protocol.robot import Robot
from naoserver.serving.assembly import Assembly
from naoserver.serving.lasting_walk import LastingWalk
from visualhfsm_naoqi.programs._arguments import JointNames, Operation, text
from visualhfsm_naoqi.programs._calls import failed
from visualhfsm_naoqi.programs._clients import MOTION, Belongings, Call, CallTable, Client, begins_any

_TORSO = 0
_WORLD = 1
ROBOT = 2
"""NAOqi's numbers of frames."""
_END_LIMIT: Final = 5.0
"""Robot seconds within which a walk or a motion has to end."""

A = TypeVar("A")


def needed(ability: A | None, what: str) -> A:
    """Return an ability of the robot. Raises HardwareFailure, naming `what` it lacks, when it is None."""
    if ability is None:
        raise HardwareFailure(f"this robot {what}")
    return ability


class Access:
    """A robot, the guards in front of its joints and its walk, and the services that use it."""

    def __init__(self, robot: Robot, assembly: Assembly, disk: Path) -> None:
        self.robot: Final = robot
        self.disk = disk.resolve()
        """The folder that represents its disk."""
        self.calls: Final = CallTable(robot.clock)
        """The calls of all clients."""
        self.body: Final = assembly.body
        """Its joints."""
        self.kinematics: Final = kinematics_of(robot.body)
        """The places of its parts."""
        self.joints: Final = JointNames(robot.body)
        """Their names, and those of the chains."""
        self.angles: Final = assembly.body.angles
        """Return the measured angle or the setpoint of every joint in rad."""
        self.walk: Final = assembly.walk
        """Its walk; None when it has none."""
        self.player: Final = assembly.player
        self.paths: Final = assembly.paths
        """What moves its joints along curves."""
        self.servants: Final = assembly.servants
        """What it serves, by identity."""
        self.hearing: Final = assembly.hearing
        """Passes on what is said to it, as text."""
        self.postures: Final = needed(assembly.postures, "knows no postures")
        self.support = Support.LEGS
        """The feet over which it balances while paths of its legs are followed."""
        self.planted: dict[str, Sequence[float]] = {}
        """How the feet stay that a program keeps on the floor, as of `curves_on_feet`."""
        self.walking: Final = Walking(self, assembly)
        """Its walk, renewed."""
        self.lend: Callable[[object], object] = lambda lent: lent
        """Return an object as one that libqi lends to clients, and releases."""
        self.find: Callable[[str], qi.Future] = lambda name: failed(f"there is no service {name}")
        """Begin to look up the service of a program by its name."""
        self._services: dict[type[Service], Service] = {}
        self._drop_client: Final = assembly.drop_client
        self._gate: Final = assembly.gate
        self._gate.on_stop(self._stop)
        self._gate.on_reset(self._stop)

    def service(self, kind: type[S]) -> S:
        """Return the only service of a kind."""
        service = self._services.get(kind) or self._services.setdefault(kind, kind(self))
        assert isinstance(service, kind)
        return service

    def lose(self, client: Client) -> None:
        """End everything that a lost client commanded, and remove what it kept in the services."""
        with ExitStack() as steps:  # each whatever the others raise
            steps.callback(client.close)
            for service in self._services.copy().values():
                steps.callback(service._forget, client)
            steps.callback(self._drop_client, client.name)
            with self.calls.stopping(lambda call: call.client is client):
                client.gone = True
                self.walking.drop(client.name)

    def _stop(self) -> None:
        """End all calls that move the robot, at an emergency stop and its reset, lest one begins after it."""
        with self.calls.stopping(begins_any(*MOTION), "the robot was stopped before it began"):
            pass

    def free(self, call: Call) -> None:
        """End the walk and other motion; return when no joint is claimed, or after some seconds.

        Raises CommandRefused for a program that may not command.
        """
        self._gate.require(call.client.name)
        joints = [joint.name for joint in self.body.joints]
        for _ in range(round(_END_LIMIT / PERIOD)):
            if call.stopped.is_set() or not self.body.claims.stop(joints):
                return
            call.wait(PERIOD)

    def balance(self, joints: Iterable[str]) -> None:
        """Let the robot balance over `support`, if it can, once any of some joints is in a leg."""
        balancer = self.robot.balancer
        if balancer is None or balancer.support() is self.support:
            return
        if not set(self.joints.chains["Legs"]).isdisjoint(joints):
            balancer.command(self.support)

    def place(self, name: object, frame: object, *, measured: bool) -> Matrix:
        """Return where a joint, effector or camera is, by measured angles or by setpoints.

        `frame` is 0 for the torso's, 1 for the world's, which is that of odometry, and 2 for the robot's,
        which is upright on the floor below the torso and has its heading. Raises InvalidCommand for other
        values.
        """
        if frame not in (_TORSO, _WORLD, ROBOT):
            raise InvalidCommand("frame", f"there is no frame {str(frame)[:60]!r}; 0 torso, 1 world, 2 robot")
        angles = self.angles(measured=measured)
        place = self.kinematics.place_of(text(name, "name"), angles)
        if frame == _TORSO:
            return place
        inertial = self.robot.senses.inertial() if self.robot.senses else None
        place = (
            self.kinematics.torso_place(angles, *((inertial.roll, inertial.pitch) if inertial else ()))
            @ place
        )
        if frame == _WORLD and self.walk is not None:
            at = self.walk.read()
            floor = rotation((0.0, 0.0, 1.0), at.heading)
            floor[:2, 3] = at.x, at.y
            place = floor @ place
        return place


class Service:
    """A service of NAOqi, or a part of one."""

    def __init__(self, access: Access) -> None:
        self._access = access
        self._robot = access.robot
        self._lock = threading.Lock()
        self._belongings: list[Belongings[Any, Any]] = []
        self.kept: Final[dict[tuple[Any, ...], Any]] = {}
        """Values that clients set, and that have no effect."""

    def _bounded(self, what: str, most: int) -> Belongings[Any, Any]:
        """Return a place for at most `most` values of each client, which are removed when it is lost."""
        place: Belongings[Any, Any] = Belongings(self._access.calls, what, most)
        self._belongings.append(place)
        return place

    def _forget(self, client: Client) -> None:
        """Remove what a lost client kept."""
        with self._lock:
            for place in self._belongings:
                place.take(client)


S = TypeVar("S", bound=Service)


def delegated(kind: type[Service], operation: Operation) -> Operation:
    """Return the operation by which a service performs that of another one, with the same description."""

    @wraps(operation)
    def perform(self: Service, *arguments: object) -> object:
        return operation(self._access.service(kind), *arguments)

    return perform


class Walking(LastingWalk):
    """Walk for calls, until something ends it: unlike on the real robot, also the loss of the client."""

    def __init__(self, access: Access, assembly: Assembly) -> None:
        super().__init__(assembly)
        self._walk_to = assembly.walk_to
        self._calls = access.calls

    def begin(self, velocity: WalkVelocity, limits: WalkVelocity | None = None) -> None:
        """Walk at a velocity within limits until further notice. Raises as `WalkGuard.drive` does."""
        with self._calls.beginning() as may:
            if may:
                self.go(velocity, self._calls.current.client.name, limits)

    def go_to(
        self, call: Call, place: tuple[float, float, float], start: Odometry, highest: WalkVelocity
    ) -> bool:
        """Walk to a place in m and rad relative to `start`; return whether the robot arrived."""
        walk_to = needed(self._walk_to, "does not walk")
        with self._calls.beginning(call) as may:
            if not may:
                return False
            self.drop()
            walk_to.begin(way_to(place, start, highest), call.client.name)
            count = walk_to.state().count
        while walk_to.busy and walk_to.state().count == count:
            if call.wait(PERIOD):
                with self._calls.beginning(call):
                    if walk_to.busy and walk_to.state().count == count:  # no later walk has replaced it
                        self.guard.stop()
                return False
        now = walk_to.state()
        return now.count == count and now.status is ActionStatus.Done
