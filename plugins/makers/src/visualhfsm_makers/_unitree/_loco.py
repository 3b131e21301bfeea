"""The operations of the maker's service of the walk, over the guards of a robot; no DDS."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Final

import msgspec

from naoserver.bodies.capabilities import STILL, WalkVelocity
from visualhfsm_makers._programs import Codes, Operation, Programs, Refusal
from visualhfsm_makers._unitree._joints import fsm_mode

NOT_IMPLEMENTED: Final = 3203
WRONG_PARAMETER: Final = 3204
NOT_AVAILABLE: Final = 7301
NO_STATE: Final = 7302
NO_TASK: Final = 7303
CODES: Final = Codes(NOT_IMPLEMENTED, WRONG_PARAMETER, unavailable=NOT_AVAILABLE, failed=3202)

LIMP, DAMP, SQUAT, STAND, WALK, LIE_TO_STAND, SQUAT_OR_STAND = 0, 1, 2, 4, 200, 702, 706
"""The maker's numbers of the states that this robot has."""
WALKS: Final = frozenset({WALK, 500, 501, 801})
"""Those in which it walks: `Start` of the maker's newer packages is 500."""
_STANDS: Final = frozenset({STAND, LIE_TO_STAND, SQUAT_OR_STAND})
_UP, _DOWN = "Stand", "Crouch"
_MIDDLE: Final = 0.66
"""The height in m of the root above the floor between these two, in which it is 0.78 m and 0.53 m."""
_HIGHEST: Final = 2**32 - 1
"""The maker's number of the highest stand, whatever that is."""
_DURATION: Final = 864_000.0
"""The longest velocity in robot seconds: the maker's `Move` says it for "continuous"."""


class _Data(msgspec.Struct):
    data: float


class _Drive(msgspec.Struct):
    velocity: tuple[float, float, float]
    duration: float = 1.0


class Loco:
    """The service of the walk, for `Programs.answer`."""

    def __init__(self, programs: Programs) -> None:
        self._programs = programs
        self._state = WALK
        self.operations: Final[Mapping[int, Operation]] = {
            1: lambda _parameter, _client: "1.0.0.0",
            7001: lambda _parameter, _client: _data(self._state),
            7002: lambda _parameter, _client: _data(fsm_mode(programs.robot)),
            7003: lambda _parameter, _client: _data(0),
            7005: lambda _parameter, _client: _data(programs.height()),
            7101: self._set_state,
            7102: self._set_balance,
            7104: self._set_height,
            7105: self._set_velocity,
            7106: self._begin_task,
        }

    def _set_state(self, parameter: str, client: str) -> None:
        programs, state = self._programs, number(self._programs, parameter)
        if state == LIMP:
            programs.go_limp(client)
        elif state == DAMP:
            programs.damp(client)
        elif state == SQUAT or (state == SQUAT_OR_STAND and programs.goal() != _DOWN):
            programs.go(_DOWN, client)
        elif state in _STANDS | WALKS:
            programs.stand(client)
        else:
            raise Refusal(NO_STATE, f"the simulation has no state {state:g}")
        self._state = int(state)

    def _set_balance(self, parameter: str, _client: str) -> None:
        if number(self._programs, parameter) != 0:
            raise Refusal(NOT_IMPLEMENTED, "the simulation stands still on both feet: balance mode 0 alone")

    def _set_height(self, parameter: str, client: str) -> None:
        """Go to the stand that is nearer to a height."""
        height = number(self._programs, parameter)
        if not 0.0 <= height <= _HIGHEST:
            raise Refusal(WRONG_PARAMETER, f"a height is from 0 to {_HIGHEST}")
        self._programs.go(_UP if height > _MIDDLE else _DOWN, client)

    def _set_velocity(self, parameter: str, client: str) -> None:
        drive = self._programs.read(parameter, _Drive)
        velocity = WalkVelocity(*drive.velocity)
        if not drive.duration <= _DURATION:
            raise Refusal(WRONG_PARAMETER, f"a velocity lasts up to {_DURATION:g} s")
        if velocity != STILL:
            self._programs.assembly.gate.require(client)
        if velocity != STILL and self._state not in WALKS:
            raise Refusal(NOT_AVAILABLE, f"it walks in state {WALK}, after Start; this is {self._state}")
        self._programs.drive(velocity, drive.duration, client)

    def _begin_task(self, parameter: str, client: str) -> None:
        task = number(self._programs, parameter)
        if task != 0 or "wave" not in self._programs.assembly.player.motions:
            raise Refusal(NO_TASK, f"the simulation has no task {task:g} of the arms")
        self._programs.play("wave", client)


def number(programs: Programs, parameter: str) -> float:
    """Read a parameter that is a finite number, {"data": number}. Raises Refusal."""
    return programs.read(parameter, _Data).data


def _data(value: float) -> str:
    return json.dumps({"data": value})
