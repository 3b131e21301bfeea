"""What programs of a robot's maker command, whichever wire brings it: the walk, postures, motions.

Such programs have no lease. Each is a client of the guards like any other, and its commands end with it.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import astuple, dataclass
from itertools import chain
from typing import Final, TypeVar

import msgspec
import numpy as np

from interfaces.nao import JointCommand, Severity
from naoserver._effector_paths import POSITION, Waypoints, curves_along
from naoserver._joint_paths import Path
from naoserver._lasting_walk import LastingWalk
from naoserver._motions.routes import MotionRoute
from naoserver._servants.moves import MOTION
from naoserver.assembly import Assembly
from naoserver.capabilities import STILL, Vector, WalkVelocity
from naoserver.errors import CommandRefused, HardwareFailure, InvalidCommand, RobotError
from naoserver.kinematics import kinematics_of, matrix_of
from naoserver.robot import Robot
from zenoh_ice import typed

_LONGEST: Final = 4096
"""Most characters of a parameter."""
_LONGEST_WAY: Final = 60.0
"""The longest way of an effector in s."""
_MOST_MOMENTS: Final = 20
"""Moments of a way for which angles are computed: other programs wait meanwhile."""
_LIMP_TIME: Final = 1.0
"""Robot seconds in which the motors go limp, or stiff."""

P = TypeVar("P")
Operation = Callable[[str, str], object]
"""What a call does, given its parameter and its client; its result is answered as text."""


class Refusal(Exception):
    """A call is answered with the maker's code of an error."""

    def __init__(self, code: int, message: str) -> None:
        super().__init__(message)
        self.code: Final = code


@dataclass(frozen=True, slots=True)
class Codes:
    """A maker's codes of the errors that every call may have; success is 0."""

    unknown: int
    """There is no such operation."""
    wrong: int
    """The parameter is not as it should be."""
    unavailable: int
    """The robot cannot now: it is stopped, held by another program, or not in the state for it."""
    failed: int
    """The robot failed."""


class Programs:
    """Command a robot through its guards, for programs of `maker`. `renew` is due every 0.2 s.

    `answer` and the two others that a thread calls, `renew` and `drop`, are thread-safe; the rest is for
    operations.
    """

    def __init__(self, robot: Robot, assembly: Assembly, maker: str, codes: Codes) -> None:
        self.robot: Final = robot
        self.assembly: Final = assembly
        self.codes: Final = codes
        self._maker = maker
        self._body = assembly.body
        self._walk = LastingWalk(assembly)
        assert assembly.postures is not None
        self._postures = assembly.postures
        self._kinematics = kinematics_of(robot.body)
        self._lock = threading.Lock()
        # Where to go after the walk, its client, and how often the robot had been stopped before.
        self._posture: tuple[str, str, int] | None = None

    # -- calls -------------------------------------------------------------------------------------------

    def answer(
        self, operations: Mapping[int, Operation], number: int, parameter: str, client: str
    ) -> tuple[int, str]:
        """Perform a call; return 0 or the maker's code of an error, and the result. Raises no RobotError."""
        try:
            perform = operations.get(number)
            if perform is None:
                raise Refusal(self.codes.unknown, f"the simulation has no operation {number}")
            if len(parameter) > _LONGEST:
                raise Refusal(self.codes.wrong, f"operation {number}: more than {_LONGEST} characters")
            with self._lock:
                result = perform(parameter, client)
                return 0, "" if result is None else str(result)
        except Refusal as refusal:
            return self.refused(refusal.code, str(refusal)), ""
        except (CommandRefused, InvalidCommand) as error:
            return self.refused(self.codes.unavailable, str(error)), ""
        except RobotError as error:
            return self.refused(self.codes.failed, str(error)), ""

    def refused(self, code: int, message: str) -> int:
        """Report a refusal as an event; return its code."""
        shown = f"answered a program with error {code}: {message}"
        self.assembly.events.add(Severity.Warning, self._maker, shown, str(code))
        return code

    def read(self, parameter: str, kind: type[P]) -> P:
        """Read a parameter in JSON. Raises Refusal."""
        try:
            return typed.from_json(parameter, kind)
        except (msgspec.DecodeError, RecursionError) as error:
            raise Refusal(self.codes.wrong, f"a parameter is not what it should be: {error}"[:200]) from None

    # -- the walk ----------------------------------------------------------------------------------------

    def drive(self, velocity: WalkVelocity, seconds: float, client: str) -> None:
        """Walk at a velocity for some robot seconds, or until something ends it; STILL is a stop.

        Raises Refusal, InvalidCommand or CommandRefused, and then commands nothing.
        """
        if not all(map(math.isfinite, astuple(velocity))) or not seconds > 0.0:
            raise Refusal(self.codes.wrong, "a velocity is finite, and lasts for more than 0 s")
        self._posture = None
        if velocity == STILL:  # everybody may stop it
            self._walk.stop()
        else:
            self._walk.go(velocity, client, seconds=seconds)

    def renew(self) -> None:
        """Renew the velocity, or end it after its time; begin what waits for the end of a walk."""
        with self._lock:
            if self._posture is not None and not self._walk.moving:
                (posture, client, stops), self._posture = self._posture, None
                try:
                    if self.assembly.gate.stops == stops:
                        self.end_motion()  # joints that a program took meanwhile
                        self._postures.go(posture, 1.0, client)
                except RobotError as error:
                    self.refused(self.codes.unavailable, str(error))
            self._walk.renew()

    def drop(self, client: str) -> None:
        """End what a lost client commanded."""
        with self._lock:
            self._walk.drop(client)
            if self._posture is not None and self._posture[1] == client:
                self._posture = None
            self.assembly.drop_client(client)

    # -- the body ----------------------------------------------------------------------------------------

    def posture(self) -> str:
        """Return the posture that the body is next to."""
        return self._postures.posture()

    def height(self) -> float:
        """Return the height of the root above the floor in m."""
        return float(self._kinematics.torso_place(self._body.angles(measured=True))[2, 3])

    def end_motion(self) -> None:
        """End whatever moves, of any client: a stop is never refused."""
        self._posture = None
        self._walk.stop()
        self.assembly.paths.stop()
        self._body.claims.stop([joint.name for joint in self._body.joints])

    def go(self, posture: str, client: str) -> None:
        """Go to a posture in place of what moves, which a program that may not command does not end.

        A walk takes its last step first.
        """
        stops = self.assembly.gate.stops
        self.assembly.gate.require(client)
        self.end_motion()
        if self._walk.moving:
            self._posture = posture, client, stops
        else:
            self._postures.go(posture, 1.0, client)

    def damp(self, client: str) -> None:
        """End what moves, for everybody, and crouch: limp it would fall, and it does not get up."""
        self.end_motion()
        self.go("Crouch", client)

    def stand(self, client: str) -> None:
        """Stand up; one that stands already begins nothing, so that it can walk at once."""
        if not self.posture().startswith("Stand") and not self._walk.active:
            self._body.stiffen({joint.name: 1.0 for joint in self._body.joints}, _LIMP_TIME, client=client)
            self._postures.go("Stand", 1.0, client)

    def go_limp(self, client: str) -> None:
        """End what moves, and let every motor go limp: the robot falls."""
        self.assembly.gate.require(client)
        self.end_motion()
        self._body.stiffen({joint.name: 0.0 for joint in self._body.joints}, _LIMP_TIME, client=client)

    def follow(self, commands: Mapping[str, JointCommand], client: str) -> dict[str, JointCommand]:
        """Let joints follow commands with gains; return those that were limited. Raises RobotError."""
        if (gains := self.assembly.gains) is None:
            raise HardwareFailure("the motors of this robot take no gains by command")
        return gains.command(commands, client)

    def reach(self, effector: str, places: Sequence[Vector], seconds: float, client: str) -> None:
        """Lead an effector through places in m in the root's frame, at even times, as near as its joints can.

        Raises Refusal, InvalidCommand or CommandRefused, and then commands nothing.
        """
        if not all(map(math.isfinite, (*chain(*places), seconds))) or not 0.0 < seconds <= _LONGEST_WAY:
            raise Refusal(self.codes.wrong, f"a place is finite, and reached within {_LONGEST_WAY:g} s")
        self.assembly.gate.require(client)
        start, step = self._body.angles(measured=False), seconds / len(places)
        way = Waypoints(
            [step * (i + 1) for i in range(len(places))],
            [matrix_of((*place, 0.0, 0.0, 0.0)) for place in places],
            POSITION,
        )
        joints = self._kinematics.joints_of(effector)
        curves = curves_along(self._kinematics, {effector: way}, np.eye(4), start, joints, most=_MOST_MOMENTS)
        self.assembly.paths.start(Path(f"the way of {effector}", frozenset(joints), client), curves)

    def play(self, motion: str, client: str) -> None:
        """Begin a motion of the body. Raises KeyError when it has none of that name."""
        player = self.assembly.player
        route = MotionRoute(player.body, player.motions[motion], player.motions.values())
        player.begin(MOTION, motion, route, client=client)
