"""What programs of a robot's maker command, whichever wire brings it: the walk, postures, motions.

Such programs have no lease. Each is a client of the guards like any other, and its commands end with it.

Such programs do not wait either: the robot of a maker takes the newest command. So a command waits for the
end of what the same program began before and needs the same joints; the robot would fall half way.
"""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import astuple, dataclass
from itertools import chain
from typing import Final, TypeVar

import msgspec
import numpy as np

from interfaces.nao import ActionStatus, JointCommand, Severity
from naoserver.bodies.capabilities import STILL, Vector, WalkVelocity
from naoserver.bodies.kinematics import kinematics_of, matrix_of
from naoserver.errors import CommandRefused, HardwareFailure, InvalidCommand, JointTaken, RobotError
from naoserver.moves.effector_paths import POSITION, Waypoints, curves_along
from naoserver.moves.joint_paths import Path
from naoserver.moves.routes import MotionRoute
from naoserver.moves.walk import WALK
from naoserver.protocol.robot import Robot
from naoserver.safety.gain_guard import GainGuard
from naoserver.serving.assembly import Assembly
from naoserver.serving.lasting_walk import LastingWalk
from naoserver.serving.moves import MOTION, POSTURE
from zenoh_ice.data import typed
from zenoh_ice.data.text import few, sentence, text_of

_logger = logging.getLogger(__name__)

_LONGEST: Final = 4096
"""Most characters of a parameter."""
_LONGEST_WAY: Final = 60.0
"""The longest way of an effector in s."""
_MOST_MOMENTS: Final = 20
"""Moments of a way for which angles are computed: other programs wait meanwhile."""
_LIMP_TIME: Final = 1.0
"""Robot seconds in which the motors go limp, or stiff."""
_LONGEST_PAUSE: Final = 0.5
_LEAST_TIME: Final = 2.0
"""A program sends regularly once it sent messages for so long without such a pause; wall seconds."""
_SILENCE: Final = 1.0
"""Wall seconds of silence after which a program that sent regularly is taken to hang."""

P = TypeVar("P")
Operation = Callable[[str, str], object]
"""What a call does, given its parameter and its client; its result is answered as text."""
Command = Callable[[bytes, str], Mapping[str, JointCommand]]
"""What a message commands, given its bytes and its client; what was limited."""


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


@dataclass(frozen=True, slots=True)
class _Waiting:
    """A call that waits for the end of an activity: the walk, or what else its program began."""

    activity: str
    parameter: str
    client: str
    stops: int
    """How often the robot, its walk and its motions had been stopped before."""


class Programs:
    """Command a robot through its guards, for programs of `maker`. `renew` is due every 0.2 s.

    `answer` and the three others that a thread calls, `heard`, `renew` and `drop`, are thread-safe; the rest
    is for operations.
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
        self._waiting: dict[Operation, _Waiting] = {}
        # Since when each program sends without a pause, and when it sent its newest message, in wall time.
        self._sending: dict[str, tuple[float, float]] = {}

    # -- calls -------------------------------------------------------------------------------------------

    def answer(
        self, operations: Mapping[int, Operation], number: int, parameter: str, client: str
    ) -> tuple[int, str]:
        """Perform a call; return 0 or the maker's code of an error, and the result. Raises no RobotError."""
        if (perform := operations.get(number)) is None:
            return self.refused(self.codes.unknown, f"the simulation has no operation {number}"), ""
        if len(parameter) > _LONGEST:
            return self.refused(self.codes.wrong, f"operation {number}: more than {_LONGEST} characters"), ""
        with self._lock:
            return self._perform(perform, parameter, client)

    def _perform(self, perform: Operation, parameter: str, client: str) -> tuple[int, str]:
        """Perform a call in place of one of its operation that waits, or let it wait; return its answer."""
        stops = self.assembly.gate.stops
        try:
            result = perform(parameter, client)
        except Refusal as refusal:
            return self.refused(refusal.code, str(refusal)), ""
        except (CommandRefused, InvalidCommand) as error:
            if not isinstance(error, JointTaken) or not self._moves_by(error.activity, client):
                return self.refused(self.codes.unavailable, str(error)), ""
            if error.activity == WALK:
                self._walk.stop()
            self._waiting[perform] = _Waiting(error.activity, parameter, client, stops + self._stops)
            return 0, ""
        except RobotError as error:
            return self.refused(self.codes.failed, str(error)), ""
        except BaseException as error:  # of a driver, by `sys.exit`, too: the program hears of it
            _logger.exception("a call of a program failed")
            return self.refused(self.codes.failed, f"{type(error).__name__}: {text_of(error)}"), ""
        self._waiting.pop(perform, None)
        return 0, "" if result is None else str(result)

    @property
    def _stops(self) -> int:
        """How often the walk and motions were stopped, by whomever; the gate counts its stops itself."""
        return self._walk.guard.stops + self.assembly.player.stops

    def _moves_by(self, activity: str, client: str) -> bool:
        """Return whether an activity goes on that a client began here: its walk, or its posture or motion."""
        return (self._walk if activity == WALK else self.assembly.player).moves_for(client)

    def refused(self, code: int, message: str) -> int:
        """Report a refusal as an event; return its code."""
        self.warn(str(code), sentence(f"answered a program with error {code}: {message}"))
        return code

    def warn(self, kind: str, text: str) -> None:
        """Report an event to the operator; those of one kind count as the same."""
        self.assembly.events.add(Severity.Warning, self._maker, text, kind)

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
        if velocity == STILL:  # everybody may stop it
            self._walk.stop()
        else:
            self._walk.go(velocity, client, seconds=seconds)

    def renew(self) -> None:
        """Renew the velocity, or end it after its time, or of a program that hangs; begin what waits."""
        with self._lock:
            self._stop_silent()
            for perform, each in list(self._waiting.items()):
                walks = each.activity == WALK
                stopped = each.stops != self.assembly.gate.stops + self._stops
                stopped |= walks and self._walk.active  # another command of the walk
                goes_on = self._walk.moving if walks else self._moves_by(each.activity, each.client)
                if stopped or not goes_on:
                    self._waiting.pop(perform, None)
                if not (stopped or goes_on):
                    self._perform(perform, each.parameter, each.client)
            self._walk.renew()

    def heard(self, client: str) -> None:
        """Note that a program sent a message, on whatever topic."""
        now = self.assembly.events.wall_time()
        with self._lock:
            since, newest = self._sending.get(client, (now, now))
            self._sending[client] = since if now - newest < _LONGEST_PAUSE else now, now

    def _stop_silent(self) -> None:
        """End the walk of a program that sent messages regularly, and sends none any more."""
        now = self.assembly.events.wall_time()
        for client, (since, newest) in self._sending.items():
            if newest - since >= _LEAST_TIME and now - newest >= _SILENCE:
                self._forget(client)
                if self._walk.active and self._walk.moves_for(client):
                    self._walk.stop()
                    what = f"its program sent regularly, and nothing for {_SILENCE:g} s"
                    self.warn("silent", f"ended the walk: {what}")

    def drop(self, client: str) -> None:
        """End what a lost client commanded."""
        with self._lock:
            self._walk.drop(client)
            self._forget(client)
            self._sending.pop(client, None)
            self.assembly.drop_client(client)

    def _forget(self, client: str) -> None:
        """Begin nothing that waits for a client."""
        self._waiting = {of: each for of, each in self._waiting.items() if each.client != client}

    # -- the body ----------------------------------------------------------------------------------------

    def posture(self) -> str:
        """Return the posture that the body is next to."""
        return self._postures.posture()

    def goal(self) -> str:
        """Return the posture that the body is on the way to, or else next to."""
        if waiting := self._waiting.get(self._go):
            return waiting.parameter
        way = self.assembly.player.progress(POSTURE)
        return way.name if way.status is ActionStatus.Moving else self.posture()

    def height(self) -> float:
        """Return the height of the root above the floor in m."""
        return float(self._kinematics.torso_place(self._body.angles(measured=True))[2, 3])

    def end_motion(self) -> None:
        """End whatever moves, of any client: a stop is never refused."""
        self._waiting.clear()
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
            self._waiting[self._go] = _Waiting(WALK, posture, client, stops + self._stops)
        else:
            self._postures.go(posture, 1.0, client)

    def _go(self, posture: str, client: str) -> None:
        self.end_motion()  # joints that a program took meanwhile
        self._postures.go(posture, 1.0, client)

    def damp(self, client: str) -> None:
        """End what moves, for everybody, and crouch: limp it would fall, and it does not get up."""
        self.end_motion()
        self.go("Crouch", client)

    def stand(self, client: str) -> None:
        """Stand up; one that stands already, or stands up, begins nothing, so that it can walk at once."""
        self.assembly.gate.require(client)
        self._waiting.pop(self._go, None)
        if not self.goal().startswith("Stand") and not self._walk.active:
            self._body.stiffen({joint.name: 1.0 for joint in self._body.joints}, _LIMP_TIME, client=client)
            self.go("Stand", client)

    def go_limp(self, client: str) -> None:
        """End what moves, and let every motor go limp: the robot falls."""
        self.assembly.gate.require(client)
        self.end_motion()
        self._body.stiffen({joint.name: 0.0 for joint in self._body.joints}, _LIMP_TIME, client=client)

    @property
    def gains(self) -> GainGuard:
        """What lets joints follow commands with gains. Raises HardwareFailure when there is none."""
        if self.assembly.gains is None:
            raise HardwareFailure("the motors of this robot take no gains by command")
        return self.assembly.gains

    def obey(self, what: str, command: Command, data: bytes, client: str) -> None:
        """Obey a message by `command`; events say what is ignored, and what it returns as limited."""
        try:
            limited = command(data, client)
        except RobotError as error:
            self.warn(f"ignored {what}", sentence(f"ignored {what}: {error}"))
        else:
            if limited:
                joints = few([*limited])
                self.warn(f"limited {what}", sentence(f"limited {what} to {joints}"))

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
        self.assembly.paths.start(Path(sentence(f"the way of {effector}"), frozenset(joints), client), curves)

    def play(self, motion: str, client: str) -> None:
        """Begin a motion of the body, in place of no other one. Raises KeyError for one that it has not."""
        player = self.assembly.player
        if player.busy:
            raise JointTaken("", MOTION, "the robot is in another motion or posture now: stop that first")
        route = MotionRoute(player.body, player.motions[motion], player.motions.values())
        player.begin(MOTION, motion, route, client=client)
