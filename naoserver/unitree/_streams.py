"""The maker's streams of sound: how long they last, without the sound itself; no DDS."""

from __future__ import annotations

import math
from collections.abc import Sized
from typing import Annotated, Final

import msgspec

from interfaces.nao import Severity
from naoserver._programs import Programs, Refusal
from naoserver.capabilities import Sound, Tone
from naoserver.unitree._joints import SOURCE
from naoserver.unitree._loco import NOT_IMPLEMENTED, WRONG_PARAMETER
from zenoh_ice.text import printable

PLAY, STOP = 1003, 1004
"""The maker's numbers of the operations."""
_RATE: Final = 2 * 16_000
"""Bytes a second: 16-bit samples of one channel."""
_LONGEST_WAIT: Final = 600.0
"""Seconds of sound that may wait to be played."""


class _Stream(msgspec.Struct):
    app_name: Annotated[str, msgspec.Meta(min_length=1, max_length=100)]


class Streams:
    """Play the streams of programs, one at a time, on a loudspeaker that knows tones alone: as a rest."""

    def __init__(self, programs: Programs) -> None:
        self._programs = programs
        self._events = programs.assembly.events
        self._app, self._begin, self._end = "", 0.0, -math.inf
        programs.assembly.gate.on_stop(self._silence)

    def play(self, samples: Sized, parameter: str, client: str) -> None:
        """Append samples to the stream of a program, in place of that of another one."""
        name = printable(self._programs.read(parameter, _Stream).app_name)
        gate = self._programs.assembly.gate
        stops = gate.stops
        gate.require(client)
        if (speaker := self._programs.robot.loudspeaker) is None:
            raise Refusal(NOT_IMPLEMENTED, "this robot has no loudspeaker")
        now = self._events.robot_time()
        if name != self._app or now >= self._end:
            self._silence()
            self._app, self._begin, self._end = name, now, now
        end = self._end + len(samples) / _RATE
        if end - now > _LONGEST_WAIT or len(samples) % 2:
            what = f"16-bit samples, and at most {_LONGEST_WAIT:g} s of it wait"
            raise Refusal(WRONG_PARAMETER, f"a stream is of {what}")
        self._end = end
        speaker.play(Sound(name, (Tone(0.0, end - now),)), 1.0)
        if gate.stops != stops:  # an emergency stop came in between
            speaker.stop()

    def stop(self, parameter: str, _client: str) -> None:
        """End the stream of a program."""
        if printable(self._programs.read(parameter, _Stream).app_name) == self._app:
            self._silence()

    def _silence(self) -> None:
        """End the stream, and say how long it was."""
        speaker, app, self._app = self._programs.robot.loudspeaker, self._app, ""
        if speaker is not None and app:
            speaker.stop()
            seconds = min(self._events.robot_time(), self._end) - self._begin
            text = f"the stream of {app} ended after {seconds:.1f} s, which the page shows and nobody hears"
            self._events.add(Severity.Info, SOURCE, text, "stream")
