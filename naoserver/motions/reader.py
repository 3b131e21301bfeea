"""Read a motion from a file: TOML with a table for each key frame.

    description = "Wave with the right hand"
    start = "Stand"           # the posture in which it begins; without it, it begins in any
    end = "Stand"             # the posture in which it ends; without it, the one in which it began

    [[frame]]
    time = 0.8                # seconds after the beginning, or `after`: seconds after the frame before
    posture = "StandInit"     # every joint that is not given is as in this posture
    interpolation = "linear"  # how the joints come here: "smooth" (from rest to rest) unless said
    hold = ["HeadPitch"]      # joints that stay where they are up to here
    RShoulderPitch = -1.2     # angles in rad; of a hand from 0, closed, to 1, open
    ElbowRoll = -0.5          # a name without L or R stands for both sides: the left angle and its mirror

A joint that a frame does not give is on its way to the next frame that gives it. `LHipYawPitch` and
`RHipYawPitch` have one motor: `HipYawPitch` commands both.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from naoserver.body import H25, Body
from naoserver.errors import RobotError
from naoserver.motions.keyframes import Interpolation, Key, Motion
from naoserver.motions.postures import POSTURES

__all__ = ["MotionError", "parse_motion", "read_motion"]

_LONGEST: Final = 600.0
_MOST_FRAMES: Final = 2000
_LARGEST_FILE: Final = 1_000_000
_SAME_MOTOR: Final = "HipYawPitch"
_FRAME: Final = re.compile(r"\s*\[\[\s*frame\s*\]\]")
_TIMES: Final = ("time", "after")
_NOT_JOINTS: Final = frozenset((*_TIMES, "posture", "interpolation", "hold"))


class MotionError(RobotError):
    """A motion's file cannot be used; the message names file, line and joint."""


def read_motion(path: Path, body: Body = H25) -> Motion:
    """Return the motion in a file, named as the file. Raises MotionError."""
    try:
        if path.stat().st_size > _LARGEST_FILE:
            raise MotionError(f"{path}: a motion's file has at most {_LARGEST_FILE} bytes")
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise MotionError(f"{path}: it cannot be read: {error}") from error
    return parse_motion(text, path.stem, str(path), body)


def parse_motion(text: str, name: str, file: str, body: Body = H25) -> Motion:
    """Return the motion that a text describes; `file` is named in errors. Raises MotionError."""
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise MotionError(f"{file}: it is not TOML: {error}") from error
    return _Reading(text, file, body).motion(name, document)


class _Reading:
    """The reading of one file."""

    def __init__(self, text: str, file: str, body: Body) -> None:
        self._lines = text.splitlines()
        self._frames = [number for number, line in enumerate(self._lines) if _FRAME.match(line)]
        self._file = file
        self._joints = {joint.name: joint for joint in body.joints}
        self._followers = {coupling.follower for coupling in body.couplings}

    def motion(self, name: str, document: Mapping[str, Any]) -> Motion:
        for key in document.keys() - {"description", "start", "end", "frame"}:
            raise self._error(f"there is no {key!r}; there are description, start, end and [[frame]]", key)
        texts = {key: self._text(document, key) for key in ("description", "start", "end")}
        for key in ("start", "end"):
            if texts[key] and texts[key] not in POSTURES:
                raise self._error(f"{key}: {_unknown_posture(texts[key])}", key)
        frames = document.get("frame")
        if not isinstance(frames, list) or not 0 < len(frames) <= _MOST_FRAMES:
            raise self._error(f"a motion has from 1 to {_MOST_FRAMES} tables [[frame]]")
        keys: dict[str, list[Key]] = {}
        last = 0.0
        for number, frame in enumerate(frames):
            last = self._read_frame(number, frame, last, keys)
        self._check_speeds(keys, frames, POSTURES.get(texts["start"], {}))
        if not keys:
            raise self._error("no frame names a joint")
        return Motion(name, MappingProxyType({joint: tuple(of) for joint, of in keys.items()}), **texts)

    def _read_frame(
        self, number: int, frame: Mapping[str, Any], last: float, keys: dict[str, list[Key]]
    ) -> float:
        given = [key for key in _TIMES if key in frame]
        if len(given) != 1:
            raise self._error("a frame has either `time` or `after`", number=number)
        seconds = self._number(frame, given[0], number)
        time = round(seconds if given[0] == "time" else last + seconds, 6)
        if not last < time <= _LONGEST:
            message = f"its time {time:g} s must be above {last:g} s, and at most {_LONGEST:g} s"
            raise self._error(message, given[0], number)
        interpolation = frame.get("interpolation", Interpolation.SMOOTH)
        if interpolation not in set(Interpolation):
            message = f"interpolation is one of {', '.join(Interpolation)}, not {interpolation!r}"
            raise self._error(message, "interpolation", number)
        angles, held = self._angles(frame, number), self._held(frame, number)
        for joint in held:
            of = keys.setdefault(joint, [])
            of.append(Key(time, of[-1].angle if of else None))
        for joint in angles.keys() - set(held):
            keys.setdefault(joint, []).append(Key(time, angles[joint], Interpolation(interpolation)))
        return time

    def _held(self, frame: Mapping[str, Any], number: int) -> list[str]:
        names = frame.get("hold", [])
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            raise self._error("hold is a list of the names of joints", "hold", number)
        return [joint for name in names for joint, _ in self._sides(name, 0.0, number, "hold")]

    def _angles(self, frame: Mapping[str, Any], number: int) -> dict[str, float]:
        angles: dict[str, float] = {}
        if "posture" in frame:
            posture = frame["posture"]
            if not isinstance(posture, str) or posture not in POSTURES:
                raise self._error(_unknown_posture(posture), "posture", number)
            angles = {joint: of for joint, of in POSTURES[posture].items() if joint not in self._followers}
        given: dict[str, str] = {}
        for name in frame.keys() - _NOT_JOINTS:
            for joint, angle in self._sides(name, self._number(frame, name, number), number):
                if joint in given:
                    raise self._error(f"{joint} is given by {given[joint]}, too", name, number)
                given[joint] = name
                facts = self._joints[joint]
                if not facts.lower <= angle <= facts.upper:
                    message = f"{joint}: {angle:g} is out of its range {facts.lower:g} to {facts.upper:g}"
                    raise self._error(message, name, number)
                angles[joint] = angle
        return angles

    def _sides(self, name: str, angle: float, number: int, key: str = "") -> Iterator[tuple[str, float]]:
        """Return the joints that a name stands for: one, or its pair."""
        if name[1:] == _SAME_MOTOR:
            raise self._error(
                f"{name} has one motor with the other side: give {_SAME_MOTOR}", key or name, number
            )
        if name in self._joints:
            yield name, angle
        elif f"L{name}" in self._joints:
            same = "Pitch" in name or name == "Hand"
            yield f"L{name}", angle
            if f"R{name}" not in self._followers:
                yield f"R{name}", angle if same else -angle
        else:
            raise self._error(f"there is no joint {name!r}", key or name, number)

    def _check_speeds(
        self, keys: Mapping[str, list[Key]], frames: list[Mapping[str, Any]], start: Mapping[str, float]
    ) -> None:
        """Refuse what no motor can follow; before the first key only of a motion that knows its start."""
        for joint, of in keys.items():
            begin = [Key(0.0, start[joint])] if joint in start else []
            for before, after in pairwise(begin + of):
                if before.angle is None or after.angle is None:
                    continue
                mean = abs(after.angle - before.angle) / (after.time - before.time)
                speed, fastest = mean * after.interpolation.peak, self._joints[joint].max_velocity
                if speed > fastest:
                    message = (
                        f"{joint} would have to move at {speed:.3g} rad/s to be here at {after.time:g} s"
                    )
                    number = self._frame_at(frames, after.time)
                    raise self._error(f"{message}; its motor does {fastest:.3g}", joint, number)

    def _frame_at(self, frames: list[Mapping[str, Any]], time: float) -> int:
        last = 0.0
        for number, frame in enumerate(frames):
            last = round(frame["time"] if "time" in frame else last + frame["after"], 6)
            if last == time:
                return number
        return len(frames) - 1

    def _number(self, frame: Mapping[str, Any], key: str, number: int) -> float:
        value = frame[key]
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise self._error(f"{key} is {value!r}: it must be a finite number", key, number)
        return float(value)

    def _text(self, document: Mapping[str, Any], key: str) -> str:
        value = document.get(key, "")
        if not isinstance(value, str):
            raise self._error(f"{key} must be a text", key)
        return value

    def _error(self, message: str, key: str = "", number: int | None = None) -> MotionError:
        """Return the error that names the line of a key, of a frame when it has a number."""
        at = self._frames[number] if number is not None and number < len(self._frames) else 0
        names = {key, key[1:]} if key[:1] in ("L", "R") else {key}
        for line in range(at, len(self._lines)):
            if line > at and number is not None and _FRAME.match(self._lines[line]):
                break
            if self._lines[line].partition("=")[0].strip().strip("\"'") in names - {""}:
                at = line
                break
        return MotionError(f"{self._file}:{at + 1}: {message}")


def _unknown_posture(name: object) -> str:
    return f"there is no posture {name!r}; there are {', '.join(POSTURES)}"
