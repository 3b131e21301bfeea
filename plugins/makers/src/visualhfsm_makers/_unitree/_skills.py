"""The operations of the maker's services of the arms, of sound and light, and of who has the joints."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Annotated, Final

import msgspec

from naoserver.errors import InvalidCommand
from naoserver.protocol.expression import LONGEST_TEXT
from naoserver.serving.moves import MOTION
from visualhfsm_makers._programs import Operation, Programs, Refusal
from visualhfsm_makers._unitree._loco import NOT_IMPLEMENTED, WRONG_PARAMETER, number
from zenoh_ice.data.text import printable

NO_ACTION: Final = 7402
_RELEASE: Final = 99
_MOTIONS: Final = {26: "wave"}
"""The maker's actions for which there is a motion."""
_MODE: Final = "ai"
"""The maker's name of the walk, while it has the joints."""

Byte = Annotated[int, msgspec.Meta(ge=0, le=255)]


class _Color(msgspec.Struct):
    R: Byte
    G: Byte
    B: Byte


class _Speech(msgspec.Struct):
    text: str


class _Stream(msgspec.Struct):
    app_name: Annotated[str, msgspec.Meta(min_length=1, max_length=100)]


class _Name(msgspec.Struct):
    name: str


def arm(programs: Programs) -> Mapping[int, Operation]:
    """Return the service of the arms."""

    def execute(parameter: str, client: str) -> None:
        action = number(programs, parameter)
        if action == _RELEASE:
            programs.assembly.player.stop(MOTION)
        elif (motion := _MOTIONS.get(int(action), "")) in programs.assembly.player.motions:
            programs.play(motion, client)
        else:
            raise Refusal(NO_ACTION, f"the simulation has no action {action:g} of the arms")

    return {1: lambda _parameter, _client: "1.0.0.14", 7106: execute}


def voice(programs: Programs) -> Mapping[int, Operation]:
    """Return the service of sound and light."""
    speaker, lights = programs.robot.voice, programs.robot.lights

    def say(parameter: str, _client: str) -> None:
        text = programs.read(parameter, _Speech).text
        if not text.strip() or len(text) > LONGEST_TEXT:
            raise Refusal(WRONG_PARAMETER, f"a text has 1 to {LONGEST_TEXT} characters")
        if speaker is None:
            raise Refusal(NOT_IMPLEMENTED, "this robot has no voice")
        speaker.say(text)

    def shine(parameter: str, _client: str) -> None:
        color = programs.read(parameter, _Color)
        if lights is None:
            raise Refusal(NOT_IMPLEMENTED, "this robot has no lights")
        for name in lights.names:
            lights.set(name, (color.R / 255, color.G / 255, color.B / 255), 0.0)

    return {1: lambda _parameter, _client: "1.0.0.0", 1001: say, 1010: shine}


class Streams:
    """Play the sound of programs, one stream at a time."""

    def __init__(self, programs: Programs) -> None:
        self._programs = programs
        self._speaker = programs.robot.loudspeaker
        self._own = 0
        """The count of the newest stream among the sounds."""
        self.samples = b""
        """Those of the present call, which come beside its parameter."""
        self.operations: Final[Mapping[int, Operation]] = {1003: self._play, 1004: self._stop}
        programs.assembly.gate.on_stop(self._silence)

    def _play(self, parameter: str, client: str) -> None:
        """Append the samples to the stream of a program, in place of that of another one."""
        app, gate = self._app(parameter), self._programs.assembly.gate
        stops = gate.stops
        gate.require(client)
        if self._speaker is None:
            raise Refusal(NOT_IMPLEMENTED, "this robot has no loudspeaker")
        try:
            self._own = self._speaker.play_samples(app, self.samples)
        except InvalidCommand as error:
            raise Refusal(WRONG_PARAMETER, str(error)) from None
        if gate.stops != stops:  # an emergency stop came in between
            self._silence()

    def _stop(self, parameter: str, _client: str) -> None:
        self._silence(self._app(parameter))

    def _app(self, parameter: str) -> str:
        return printable(self._programs.read(parameter, _Stream).app_name)

    def _silence(self, app: str | None = None) -> None:
        """End the stream, if it is that of a program."""
        if self._speaker is not None:
            now = self._speaker.playback()
            if now.count == self._own and app in (None, now.name):
                self._speaker.stop()


class ModeSwitch:
    """The service by which a low-level program takes the joints, before it commands them, from the walk."""

    def __init__(self, programs: Programs) -> None:
        self._programs = programs
        self._mode = _MODE
        self.operations: Final[Mapping[int, Operation]] = {
            1: lambda _parameter, _client: "1.0.0.1",
            1001: lambda _parameter, _client: json.dumps({"form": "0", "name": self._mode}),
            1002: self._select,
            1003: self._release,
        }

    @property
    def walks(self) -> bool:
        """Whether the walk has the joints."""
        return self._mode == _MODE

    def _select(self, parameter: str, _client: str) -> None:
        name = self._programs.read(parameter, _Name).name
        if name != _MODE:
            raise Refusal(WRONG_PARAMETER, f"the simulation has the mode {_MODE} alone")
        self._mode = _MODE

    def _release(self, _parameter: str, client: str) -> None:
        self._programs.assembly.gate.require(client)
        self._programs.end_motion()
        self._mode = ""
