"""A motion as key frames, the targets of joints at times, and its file: TOML with a table for each frame.

    description = "Wave with the right hand"
    start = "Stand"           # the posture in which it begins; by default any
    end = "Stand"             # the posture in which it ends; by default the one in which it began

    [[frame]]
    time = 0.8                # seconds after the beginning; or `after`: seconds after the previous frame
    posture = "StandInit"     # every joint that is not given is as in this posture
    interpolation = "linear"  # how the joints get here; by default "smooth" (from rest to rest)
    hold = ["HeadPitch"]      # joints that do not move until this time
    RShoulderPitch = -1.2     # angles in rad; of a hand from 0, closed, to 1, open
    ElbowRoll = -0.5          # a name without L or R means both sides: the left angle and its mirror image

A joint that a frame does not give is on its way to the next frame that gives it. `LHipYawPitch` and
`RHipYawPitch` have one motor: `HipYawPitch` commands both.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cache, cached_property
from importlib import resources
from itertools import pairwise
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Final

import msgspec
from msgspec import Meta, Struct

from naoserver._motions.postures import POSTURES
from naoserver.body import H25
from naoserver.errors import RobotError
from zenoh_ice.toml_file import parse_toml, place, read_text


class Interpolation(StrEnum):
    """Interpolation of a joint from one key to the next."""

    SMOOTH = "smooth"
    """From rest to rest with the least jerk: the quintic polynomial of Flash and Hogan (1985)."""
    LINEAR = "linear"

    def ease(self, part: float) -> float:
        """Return the completed fraction of the way when a fraction of the time has passed."""
        if self is Interpolation.LINEAR:
            return part
        return part**3 * (10.0 - 15.0 * part + 6.0 * part**2)

    @property
    def peak(self) -> float:
        """The highest speed on the way as a multiple of the mean one."""
        return 1.0 if self is Interpolation.LINEAR else 1.875


@dataclass(frozen=True, slots=True)
class Key:
    """Target of a joint at a time after the beginning of the motion."""

    time: float
    """In s, above 0."""
    angle: float | None
    """In rad; of a hand from 0 to 1; None: where it was when the motion began."""
    interpolation: Interpolation = Interpolation.SMOOTH


@dataclass(frozen=True)
class Motion:
    """A motion of some joints. Each joint goes from where it is to its first key, then from key to key."""

    name: str
    keys: Mapping[str, tuple[Key, ...]]
    """The keys of each joint that moves, in the order of their times."""
    description: str = ""
    start: str = ""
    """The posture in which it begins; empty when it begins in any."""
    end: str = ""
    """The posture in which it ends; empty when it ends in the one in which it began."""

    def of(self, joints: Collection[str]) -> Motion:
        """Return the motion without joints that a body lacks. Raises RobotError when it moves no others."""
        keys = {joint: keys for joint, keys in self.keys.items() if joint in joints}
        if not keys:
            raise RobotError(f"{self.name} moves only joints that the robot lacks: {', '.join(self.keys)}")
        return self if len(keys) == len(self.keys) else replace(self, keys=keys)

    @cached_property
    def duration(self) -> float:
        """Seconds from the beginning to the last key."""
        return max(keys[-1].time for keys in self.keys.values())

    def at(self, time: float, begin: Mapping[str, float]) -> dict[str, float]:
        """Return the angles at a time after the beginning; `begin` are the angles at the beginning."""
        return {joint: self._angle(joint, time, begin[joint]) for joint in self.keys}

    def _angle(self, joint: str, time: float, begin: float) -> float:
        keys = self.keys[joint]
        place = bisect_left(keys, time, key=lambda key: key.time)
        since, before = (keys[place - 1].time, _known(keys[place - 1], begin)) if place else (0.0, begin)
        if place == len(keys):
            return before
        after = keys[place]
        part = max(0.0, time - since) / (after.time - since)
        return before + (_known(after, begin) - before) * after.interpolation.ease(part)


def _known(key: Key, begin: float) -> float:
    return begin if key.angle is None else key.angle


_LONGEST_MOTION: Final = 600.0  # s
_SAME_MOTOR: Final = "HipYawPitch"
_JOINTS: Final = {joint.name: joint for joint in H25.joints}
_FOLLOWERS: Final = frozenset(coupling.follower for coupling in H25.couplings)

Seconds = Annotated[
    float, Meta(gt=0.0, le=_LONGEST_MOTION, description=f"write s above 0, at most {_LONGEST_MOTION:g}")
]
Posture = Annotated[
    str, Meta(pattern=rf"^({'|'.join(POSTURES)})\Z", description=f"write one of {', '.join(POSTURES)}")
]


class MotionError(RobotError):
    """A motion's file cannot be used; the message names file, line and joint."""


def _names() -> Iterator[tuple[str, dict[str, float]]]:
    """Yield each name that a frame may give, with its joints: 1, or -1 for a mirrored joint."""
    for joint in _JOINTS:
        if joint[1:] != _SAME_MOTOR:
            yield joint, {joint: 1.0}
    for joint in _JOINTS:
        if joint.startswith("L"):
            name = joint[1:]
            mirrored = 1.0 if "Pitch" in name or name == "Hand" else -1.0
            pair = {joint: 1.0, f"R{name}": mirrored}
            yield name, {each: sign for each, sign in pair.items() if each not in _FOLLOWERS}


_NAMES: Final = dict(_names())
JointName = Annotated[
    str, Meta(pattern=rf"^({'|'.join(_NAMES)})\Z", description=f"write one of {', '.join(_NAMES)}")
]


class _Frame(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    time: Seconds | None = None
    after: Seconds | None = None
    posture: Posture | None = None
    interpolation: Interpolation = Interpolation.SMOOTH
    hold: tuple[JointName, ...] = ()

    def __post_init__(self) -> None:
        if (self.time is None) == (self.after is None):
            raise ValueError("a frame has either `time` or `after`")

    @property
    def given(self) -> Iterator[tuple[str, float]]:
        """The angles by name, as in the file."""
        for name in _NAMES:
            angle = getattr(self, name)
            if angle is not None:
                yield name, angle


def _angle(joints: Mapping[str, float]) -> object:
    """Return the type of an angle that is in the range of all joints that it commands."""
    ends = [(sign * _JOINTS[name].lower, sign * _JOINTS[name].upper) for name, sign in joints.items()]
    lower, upper = max(map(min, ends)), min(map(max, ends))
    meta = Meta(ge=lower, le=upper, description=f"write a number from {lower:g} to {upper:g}")
    return Annotated[float, meta] | None


if TYPE_CHECKING:
    _JointFrame = _Frame
else:
    _JointFrame = msgspec.defstruct(
        "_JointFrame",
        [(name, _angle(joints), None) for name, joints in _NAMES.items()],
        bases=(_Frame,),
        frozen=True,
        forbid_unknown_fields=True,
        kw_only=True,
    )


class _File(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    description: str = ""
    start: Posture = ""
    end: Posture = ""
    frame: Annotated[
        tuple[_JointFrame, ...], Meta(min_length=1, max_length=2000, description="write 1 to 2000 [[frame]]")
    ]


def parse_motion(text: str, name: str, file: str) -> Motion:
    """Return the motion that a text describes; `file` is named in errors. Raises MotionError."""
    document = parse_toml(text, _File, file, MotionError)

    def error(number: int, key: str, message: str) -> MotionError:
        return MotionError(f"{place(file, text, 'frame', number, key)}: {message}")

    keys: dict[str, list[Key]] = {}
    numbers: dict[float, int] = {}  # of the frames, by their times
    last = 0.0
    for number, frame in enumerate(document.frame):
        time = round(last + frame.after if frame.after else frame.time or 0.0, 6)
        if not last < time <= _LONGEST_MOTION:
            message = f"its time {time:g} s must be above {last:g} s, and at most {_LONGEST_MOTION:g} s"
            raise error(number, "after" if frame.after else "time", message)
        last = time
        numbers[time] = number
        held = [joint for name in frame.hold for joint in _NAMES[name]]
        for joint in held:
            of = keys.setdefault(joint, [])
            of.append(Key(time, of[-1].angle if of else None))
        posture = POSTURES[frame.posture] if frame.posture else {}
        angles = {joint: angle for joint, angle in posture.items() if joint not in _FOLLOWERS}
        given: dict[str, str] = {}
        for key, angle in frame.given:
            for joint, sign in _NAMES[key].items():
                if joint in given:
                    raise error(number, key, f"{joint} is given by {given[joint]}, too")
                given[joint], angles[joint] = key, sign * angle
        for joint in angles.keys() - set(held):
            keys.setdefault(joint, []).append(Key(time, angles[joint], frame.interpolation))
    if not keys:
        raise MotionError(f"{file}: no frame names a joint")
    start = POSTURES[document.start] if document.start else {}
    for joint, of in keys.items():
        if fault := _too_fast(joint, [Key(0.0, start[joint]), *of] if joint in start else of):
            number = numbers[fault[0]]
            names = (key for key, _ in document.frame[number].given if joint in _NAMES[key])
            raise error(number, next(names, "posture"), fault[1])
    joints = MappingProxyType({joint: tuple(of) for joint, of in keys.items()})
    return Motion(name, joints, document.description, document.start, document.end)


def _too_fast(joint: str, keys: Sequence[Key]) -> tuple[float, str] | None:
    """Return the time of the first key that no motor can follow, and the problem."""
    fastest = _JOINTS[joint].max_velocity
    for before, after in pairwise(keys):
        if before.angle is None or after.angle is None:
            continue
        mean = abs(after.angle - before.angle) / (after.time - before.time)
        if (speed := mean * after.interpolation.peak) > fastest:
            message = f"{joint} would have to move at {speed:.3g} rad/s to be here at {after.time:g} s"
            return after.time, f"{message}; its motor does {fastest:.3g}"
    return None


@cache
def load_motions() -> Mapping[str, Motion]:
    """Return the motions in our files by name: read when they are first used. Raises MotionError."""
    with resources.as_file(resources.files("naoserver._motions") / "files") as folder:
        motions = [
            parse_motion(read_text(path, MotionError), path.stem, str(path))
            for path in sorted(folder.glob("*.toml"))
        ]
    return MappingProxyType({motion.name: motion for motion in motions})
