"""The operations of the maker's service of the walk, and its commands of joints, over the guards; no DDS."""

from __future__ import annotations

import cmath
import json
import math
from collections.abc import Iterable, Mapping
from typing import Annotated, Final

import msgspec
from msgspec.structs import astuple

from interfaces.nao import ActionStatus, JointCommand
from naoserver.bodies.capabilities import STILL, WalkVelocity
from naoserver.bodies.parts import Axis
from naoserver.errors import InvalidCommand
from naoserver.serving.moves import MOTION
from visualhfsm_makers._programs import Codes, Operation, Programs, Refusal

BAD_REQUEST: Final = 400
CONFLICT: Final = 409
REFUSED: Final = 501
CODES: Final = Codes(REFUSED, BAD_REQUEST, unavailable=CONFLICT, failed=500)

DAMPING, PREPARE, WALKING, CUSTOM, SOCCER = range(5)
"""The maker's numbers of the modes."""
_CONTROLS: Final = {DAMPING: 1, PREPARE: 2, WALKING: 3, CUSTOM: 6, SOCCER: 5}
"""Its numbers of what controls the body in each."""
_SHOOTS: Final = 9
"""The same while it shoots."""
_WAVES: Final = 2
"""Its number of an action."""
_RIGHT_HAND: Final = 1
_HANDS: Final = {0: "LArm", _RIGHT_HAND: "RArm"}
"""The effectors of the maker's hands."""
_STOP_DANCE: Final = 1000
_HEAD_SPEED: Final = 1.5
"""How fast the head turns in rad/s; on its own in a direction, a third of it."""


_Int = Annotated[int, msgspec.Meta(ge=-(2**31), lt=2**31)]


class _Mode(msgspec.Struct):
    mode: _Int


class _GetUp(msgspec.Struct):
    mode: _Int = WALKING


class _Velocity(msgspec.Struct):
    vx: float
    vy: float
    vyaw: float


class _Head(msgspec.Struct):
    pitch: float
    yaw: float
    time_millis: _Int = 0


class _Direction(msgspec.Struct):
    pitch_direction: _Int
    yaw_direction: _Int


class _Hand(msgspec.Struct):
    hand_action: _Int
    hand_index: _Int = _RIGHT_HAND


class _Position(msgspec.Struct):
    x: float
    y: float
    z: float


class _Posture(msgspec.Struct):
    position: _Position


class _Reach(msgspec.Struct):
    target_posture: _Posture
    time_millis: _Int
    hand_index: _Int
    aux_posture: _Posture | None = None


class _Dance(msgspec.Struct):
    dance_id: _Int


class _Switch(msgspec.Struct):
    start: bool


class _Place(msgspec.Struct):
    x: float = 0.0
    y: float = 0.0
    theta: float = 0.0


class Loco:
    """The service of the walk, for `Programs.answer`, and what else programs command or read."""

    def __init__(self, programs: Programs) -> None:
        self._programs = programs
        self._body = programs.assembly.body
        neck = programs.robot.body.neck
        assert neck is not None  # a T1
        self._head = neck.axes[Axis.TILT].joint, neck.axes[Axis.PAN].joint
        self._mode = WALKING
        self._upper_body = False
        self._start = 0j, 0.0  # where odometry began, in the plane, and its heading
        self.operations: Final[Mapping[int, Operation]] = {
            2000: self._change_mode,
            2001: self._move,
            2004: self._rotate_head,
            2005: self._wave,
            2006: self._rotate_head_on,
            2008: self._get_up,
            2009: self._move_hand,
            2016: self._dance,
            2017: lambda _body, _client: json.dumps({"mode": self._mode}),
            2018: self._status,
            2022: self._info,
            2024: self._shoot,
            2025: self._get_up,
            2030: self._control_upper_body,
            2031: self._reset_odometry,
            2043: self._rotate_head,
        }

    # -- modes -------------------------------------------------------------------------------------------

    def _change_mode(self, body: str, client: str) -> None:
        programs, mode = self._programs, self._programs.read(body, _Mode).mode
        if mode not in _CONTROLS:
            raise Refusal(BAD_REQUEST, f"there is no mode {mode}")
        if mode == DAMPING:
            programs.damp(client)
        else:
            programs.assembly.gate.require(client)
            if CUSTOM in {mode, self._mode}:
                programs.end_motion()
            if mode == PREPARE:
                programs.drive(STILL, math.inf, client)
            if mode != CUSTOM:
                programs.stand(client)
        self._mode = mode

    def _get_up(self, body: str, client: str) -> None:
        mode = self._programs.read(body or "{}", _GetUp).mode
        self._change_mode(json.dumps({"mode": mode}), client)

    def _status(self, _body: str, _client: str) -> str:
        playing = self._playing()
        control = _SHOOTS if playing == "kick" else _CONTROLS[self._mode]
        actions = [_WAVES] if playing == "wave" else []
        return json.dumps(
            {"current_mode": self._mode, "current_body_control": control, "current_actions": actions}
        )

    def _info(self, _body: str, _client: str) -> str:
        robot = self._programs.robot
        of = dict.fromkeys(("serial_number", "edition", "region"), "")
        return json.dumps(
            {"name": robot.name, "nickname": robot.name, "version": "simulation", "model": "T1", **of}
        )

    # -- moves -------------------------------------------------------------------------------------------

    def _move(self, body: str, client: str) -> None:
        """Walk until the next call, as the real robot does, or until the program is gone."""
        given = self._programs.read(body, _Velocity)
        # 0.1 arrives as 0.10000000149011612, which may be beyond a limit.
        velocity = WalkVelocity(*(round(each, 6) for each in (given.vx, given.vy, given.vyaw)))
        if velocity != STILL:
            self._programs.assembly.gate.require(client)
        if velocity != STILL and self._mode not in {WALKING, SOCCER}:
            raise Refusal(CONFLICT, f"it walks in the modes {WALKING} and {SOCCER}; this is {self._mode}")
        self._programs.drive(velocity, math.inf, client)

    def _rotate_head(self, body: str, client: str) -> None:
        head = self._programs.read(body, _Head)
        tilt, pan = self._head
        targets = {tilt: head.pitch, pan: head.yaw}
        speeds = dict.fromkeys(targets, _HEAD_SPEED)
        if head.time_millis > 0:
            reading = self._body.read()
            for joint, target in targets.items():
                way = abs(target - reading.positions[self._body.index(joint)])
                speeds[joint] = min(_HEAD_SPEED, 1000.0 * way / head.time_millis)
        self._body.move(targets, speeds, client=client)

    def _rotate_head_on(self, body: str, client: str) -> None:
        given = self._programs.read(body, _Direction)
        tilt, pan = self._head
        ways = {tilt: given.pitch_direction, pan: given.yaw_direction}
        if any(ways.values()) and self._programs.assembly.player.busy:
            self._body.claims.check(self._head)  # turning the head ends no posture half way
        self._body.hold(self._head)
        ranges = {joint: self._body.facts(joint) for joint, way in ways.items() if way}
        targets = {joint: of.upper if ways[joint] > 0 else of.lower for joint, of in ranges.items()}
        self._body.move(targets, dict.fromkeys(targets, _HEAD_SPEED / 3), client=client)

    def _wave(self, body: str, client: str) -> None:
        hand = self._programs.read(body, _Hand)
        if hand.hand_action:  # the hand closes: it is at rest again
            if self._playing() == "wave":
                self._programs.assembly.player.stop(MOTION)
                self._programs.stand(client)
        elif hand.hand_index == _RIGHT_HAND:
            self._programs.play("wave", client)
        else:
            raise Refusal(REFUSED, "the simulation waves with the right hand")

    def _move_hand(self, body: str, client: str) -> None:
        """Lead a hand, perhaps past another place, to one in the trunk's frame, turned as it comes."""
        wanted = self._programs.read(body, _Reach)
        if wanted.hand_index not in _HANDS:
            raise Refusal(BAD_REQUEST, f"there is no hand {wanted.hand_index}")
        postures = (wanted.aux_posture, wanted.target_posture)
        places = [astuple(each.position) for each in postures if each is not None]
        self._programs.reach(_HANDS[wanted.hand_index], places, wanted.time_millis / 1000.0, client)

    def _dance(self, body: str, _client: str) -> None:
        if (dance := self._programs.read(body, _Dance).dance_id) != _STOP_DANCE:
            raise Refusal(REFUSED, f"the simulation has no dance {dance}")

    def _shoot(self, _body: str, client: str) -> None:
        self._programs.assembly.gate.require(client)
        if self._mode not in {WALKING, SOCCER}:
            raise Refusal(CONFLICT, f"it shoots in the modes {WALKING} and {SOCCER}; this is {self._mode}")
        self._programs.play("kick", client)

    def _playing(self) -> str:
        """Return the motion that it plays now; empty if none."""
        motion = self._programs.assembly.player.progress(MOTION)
        return motion.name if motion.status is ActionStatus.Moving else ""

    # -- joints ------------------------------------------------------------------------------------------

    def _control_upper_body(self, body: str, client: str) -> None:
        self._programs.assembly.gate.require(client)
        self._upper_body = self._programs.read(body, _Switch).start

    def follow(self, motors: Iterable[tuple[float, ...]], client: str) -> Mapping[str, JointCommand]:
        """Let joints, in their order, follow q, dq, tau, kp, kd; those of weight 0 keep what they do.

        Return what was limited. Raises RobotError when they may not.
        """
        commands = {
            joint.name: JointCommand(*values)
            for joint, (*values, weight) in zip(self._body.joints, motors, strict=False)
            if weight > 0.0
        }
        if not commands:
            return {}
        self._programs.assembly.gate.require(client)
        legs = commands.keys() & set(self._programs.robot.body.groups.legs)
        if self._mode != CUSTOM and (legs or not self._upper_body):
            raise InvalidCommand("mode", f"joints are commanded in mode {CUSTOM}; this is {self._mode}")
        return self._programs.gains.command(commands, client)

    # -- where it is -------------------------------------------------------------------------------------

    def _reset_odometry(self, body: str, _client: str) -> None:
        place = self._programs.read(body or "{}", _Place)
        at, heading = self._believed()
        turn = heading - place.theta
        self._start = at - complex(place.x, place.y) * cmath.rect(1.0, turn), turn

    def place(self) -> tuple[float, float, float]:
        """Return where the robot believes it is since odometry was reset: x and y in m, heading in rad."""
        (at, heading), (start, turn) = self._believed(), self._start
        moved = (at - start) * cmath.rect(1.0, -turn)
        return moved.real, moved.imag, math.remainder(heading - turn, math.tau)

    def _believed(self) -> tuple[complex, float]:
        walker = self._programs.robot.walker
        assert walker is not None  # a T1
        odometry = walker.odometry()
        return complex(odometry.x, odometry.y), odometry.heading
