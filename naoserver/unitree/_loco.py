"""The operations of the maker's service of the walk, over the guards of a robot; no DDS."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Final

import msgspec

from naoserver._programs import Codes, Operation, Programs, Refusal
from naoserver.capabilities import STILL, WalkVelocity

NOT_IMPLEMENTED: Final = 3203
WRONG_PARAMETER: Final = 3204
NOT_AVAILABLE: Final = 7301
NO_STATE: Final = 7302
NO_TASK: Final = 7303
CODES: Final = Codes(NOT_IMPLEMENTED, WRONG_PARAMETER, unavailable=NOT_AVAILABLE, failed=3202)

LIMP, DAMP, SQUAT, STAND, WALK, LIE_TO_STAND, SQUAT_OR_STAND = 0, 1, 2, 4, 200, 702, 706
"""The maker's numbers of the states that this robot has."""
_HIGH: Final = 2**32 - 1
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
        elif state == SQUAT or (state == SQUAT_OR_STAND and programs.goal() != "Crouch"):
            programs.go("Crouch", client)
        elif state in {STAND, WALK, LIE_TO_STAND, SQUAT_OR_STAND}:
            programs.stand(client)
        else:
            raise Refusal(NO_STATE, f"the simulation has no state {state:g}")
        self._state = int(state)

    def _set_balance(self, parameter: str, _client: str) -> None:
        if number(self._programs, parameter) != 0:
            raise Refusal(NOT_IMPLEMENTED, "the simulation stands still on both feet: balance mode 0 alone")

    def _set_height(self, parameter: str, client: str) -> None:
        height = number(self._programs, parameter)
        if height not in {0, _HIGH}:
            raise Refusal(NOT_IMPLEMENTED, "the simulation has the highest and the lowest stand alone")
        self._programs.go("Stand" if height else "Crouch", client)

    def _set_velocity(self, parameter: str, client: str) -> None:
        drive = self._programs.read(parameter, _Drive)
        velocity = WalkVelocity(*drive.velocity)
        if not drive.duration <= _DURATION:
            raise Refusal(WRONG_PARAMETER, f"a velocity lasts up to {_DURATION:g} s")
        if velocity != STILL:
            self._programs.assembly.gate.require(client)
        if velocity != STILL and self._state != WALK:
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
