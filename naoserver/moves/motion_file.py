"""Motions made of key frames, targets of joints at times, and their files: TOML with a table for each frame.

    description = "Wave with the right hand"
    start = "Stand"           # the posture in which it begins; by default any
    end = "Stand"             # the posture in which it ends; by default the one in which it began

    [[frame]]
    time = 0.8                # seconds after the beginning; or `after`: seconds after the previous frame
    posture = "StandInit"     # every joint that is not given is as in this posture
    interpolation = "linear"  # how the joints get here; by default "smooth" (from rest to rest)
    hold = ["HeadPitch"]      # joints that do not move until this time
    RShoulderPitch = -1.2     # angles in rad; of a hand from 0, closed, to 1, open
    ElbowRoll = -0.5          # a name without its side means both: the left angle and its mirror image

Postures and joints are those of a body, whose description says which joints are on either side and which have
one motor, such as the Nao's `LHipYawPitch` and `RHipYawPitch`: `HipYawPitch` commands both. A joint that a
frame does not give is on its way to the next frame that gives it.

A name without its side means two joints of a body's groups whose names differ only in the side: that is
`ShoulderRoll` for `LShoulderRoll` and `RShoulderRoll`, `knee_joint` for `left_knee_joint` and its like.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property, lru_cache
from importlib import resources
from itertools import pairwise
from types import MappingProxyType
from typing import Annotated, Any, Final, cast

import msgspec
import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from naoserver.bodies import family_of
from naoserver.bodies.body import Body
from naoserver.bodies.kinematics import kinematics_of
from naoserver.bodies.parts import Joint
from naoserver.errors import RobotError
from zenoh_ice.data.toml_file import parse_toml, place, read_text


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


Sides = Mapping[str, float]
"""The joints of a name: each with 1, or with -1 if its angle is that of the left side with the other sign."""

_SIDES: Final = (("left", "right"), ("Left", "Right"), ("LEFT", "RIGHT"), ("l", "r"), ("L", "R"))


def names_of(body: Body) -> dict[str, Sides]:
    """Return each name that a motion of a body may give, with its joints.

    Joints that one motor drives have one name, and only the leading one is commanded.
    """
    pairs = list(_pairs(body))
    one_motor = {name for pair in body.couplings for name in (pair.leader, pair.follower)}
    paired = {joint.name for _, left, right in pairs for joint in (left, right)}
    names: dict[str, Sides] = {
        joint.name: {joint.name: 1.0}
        for joint in body.joints
        if joint.name in body.motors and not (joint.name in one_motor and joint.name in paired)
    }
    for name, left, right in pairs:
        sides = {left.name: 1.0, right.name: mirrored(body, left, right)}
        names.setdefault(name, {joint: sign for joint, sign in sides.items() if joint in body.motors})
    return names


def mirrored(body: Body, left: Joint, right: Joint) -> float:
    """Return 1 if equal angles of two joints are mirror images in the x-z plane, or -1 if opposite ones are.

    That is so when the right axis is the left one reflected, as a pseudovector: (-x, y, -z). If the ranges do
    not meet then, it is the other way round: a hand is open at 1 on either side, whatever its axis.
    """
    x, y, z = _axis(body, left)
    sign = 1.0 if np.dot((-x, y, -z), _axis(body, right)) > 0.0 else -1.0
    ends = sorted((sign * left.lower, sign * left.upper))
    return sign if ends[0] < right.upper and right.lower < ends[1] else -sign


def _axis(body: Body, joint: Joint) -> NDArray[np.float64]:
    """Return the axis of a joint in the root's frame while all joints are at 0."""
    axis: NDArray[np.float64] = kinematics_of(body).link_place(joint.child, {})[:3, :3] @ np.array(joint.axis)
    return axis


def _pairs(body: Body) -> Iterator[tuple[str, Joint, Joint]]:
    """Yield the pairs of joints of arms and legs, each with its name."""
    groups = body.groups
    for lefts, rights in ((groups.left_arm, groups.right_arm), (groups.left_leg, groups.right_leg)):
        for left in lefts:
            named = ((_without_side(left, right), right) for right in rights)
            name, right = next(((name, right) for name, right in named if name), ("", ""))
            if name:
                yield name, body.joint[left], body.joint[right]


def _without_side(left: str, right: str) -> str:
    """Return what two names are without the side, the only word that differs; empty if more does."""
    for side, other in _SIDES:
        for found in re.finditer(side, left):
            before, after = left[: found.start()], left[found.end() :]
            if before + other + after == right:
                return before.rstrip("_") + after if before else after.lstrip("_")
    words, others = left.split("_"), right.split("_")
    shared = [word for word, other in zip(words, others, strict=False) if word == other]
    return "_".join(shared) if len(words) == len(others) == len(shared) + 1 else ""


_LONGEST_MOTION: Final = 600.0  # s

Seconds = Annotated[
    float, Meta(gt=0.0, le=_LONGEST_MOTION, description=f"write s above 0, at most {_LONGEST_MOTION:g}")
]


class MotionError(RobotError):
    """A motion's file cannot be used; the message names file, line and joint."""


class _Frame(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A frame of any body; that of a certain one has a field for each name of joints."""

    time: Seconds | None = None
    after: Seconds | None = None
    posture: str | None = None
    interpolation: Interpolation = Interpolation.SMOOTH
    hold: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if (self.time is None) == (self.after is None):
            raise ValueError("a frame has either `time` or `after`")


class _File(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The file of a motion of any body."""

    description: str = ""
    start: str = ""
    end: str = ""
    frame: tuple[_Frame, ...]


class _Format:
    """What a file may say for a body."""

    def __init__(self, body: Body) -> None:
        self.body: Final = body
        self.names: Final = names_of(body)
        posture = _one_of(body.postures)
        joint: Any = _one_of(self.names)
        frame: Any = _struct(
            _Frame,
            posture=(posture | None, None),
            hold=(tuple[joint, ...], ()),
            **{name: (self._angle(sides) | None, None) for name, sides in self.names.items()},
        )
        frames = Meta(min_length=1, max_length=2000, description="write 1 to 2000 [[frame]]")
        file = _struct(
            _File, start=(posture, ""), end=(posture, ""), frame=(Annotated[tuple[frame, ...], frames],)
        )
        self.file: Final = cast("type[_File]", file)

    def given(self, frame: _Frame) -> Iterator[tuple[str, float]]:
        """Yield the angles that a frame gives by name, as in the file."""
        for name in self.names:
            angle = getattr(frame, name)
            if angle is not None:
                yield name, angle

    def _angle(self, sides: Sides) -> Any:  # noqa: ANN401 - a type made at run time
        """Return the type of an angle that is in the range of all joints that it commands."""
        joints = self.body.joint
        ends = [(sign * joints[name].lower, sign * joints[name].upper) for name, sign in sides.items()]
        lower, upper = max(map(min, ends)), min(map(max, ends))
        return Annotated[
            float, Meta(ge=lower, le=upper, description=f"write a number from {lower:g} to {upper:g}")
        ]


def _one_of(names: Iterable[str]) -> Any:  # noqa: ANN401
    """Return the type of a text that is one of some names."""
    pattern = "|".join(map(re.escape, names))
    return Annotated[str, Meta(pattern=rf"^({pattern})\Z", description=f"write one of {', '.join(names)}")]


def _struct(base: type[Struct], **fields: tuple[Any, ...]) -> type[Struct]:
    """Return a kind of struct with further fields, or with narrower types of known ones: types, defaults."""
    described = [(name, *of) for name, of in fields.items()]
    return msgspec.defstruct(
        base.__name__, described, bases=(base,), frozen=True, forbid_unknown_fields=True, kw_only=True
    )


_format: Final = lru_cache(16)(_Format)


def parse_motion(text: str, name: str, file: str, body: Body) -> Motion:
    """Return the motion of a body that a text describes; `file` is named in errors. Raises MotionError."""
    form = _format(body)
    document = parse_toml(text, form.file, file, MotionError)

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
        held = [joint for each in frame.hold for joint in form.names[each]]
        for joint in held:
            of = keys.setdefault(joint, [])
            of.append(Key(time, of[-1].angle if of else None))
        posture = body.postures[frame.posture].angles if frame.posture else {}
        angles = {joint: angle for joint, angle in posture.items() if joint in body.motors}
        given: dict[str, str] = {}
        for key, angle in form.given(frame):
            for joint, sign in form.names[key].items():
                if joint in given:
                    raise error(number, key, f"{joint} is given by {given[joint]}, too")
                given[joint], angles[joint] = key, sign * angle
        for joint in angles.keys() - set(held):
            keys.setdefault(joint, []).append(Key(time, angles[joint], frame.interpolation))
    if not keys:
        raise MotionError(f"{file}: no frame names a joint")
    start = body.postures[document.start].angles if document.start else {}
    for joint, of in keys.items():
        fault = _too_fast(body, joint, [Key(0.0, start[joint]), *of] if joint in start else of)
        if fault is not None:
            number = numbers[fault[0]]
            names = (key for key, _ in form.given(document.frame[number]) if joint in form.names[key])
            raise error(number, next(names, "posture"), fault[1])
    joints = MappingProxyType({joint: tuple(of) for joint, of in keys.items()})
    return Motion(name, joints, document.description, document.start, document.end)


def _too_fast(body: Body, joint: str, keys: Sequence[Key]) -> tuple[float, str] | None:
    """Return the time of the first key that no motor can follow, and the problem."""
    fastest = body.joint[joint].max_velocity
    for before, after in pairwise(keys):
        if before.angle is None or after.angle is None:
            continue
        mean = abs(after.angle - before.angle) / (after.time - before.time)
        if (speed := mean * after.interpolation.peak) > fastest:
            message = f"{joint} would have to move at {speed:.3g} rad/s to be here at {after.time:g} s"
            return after.time, f"{message}; its motor does {fastest:.3g}"
    return None


@lru_cache(16)
def load_motions(body: Body) -> Mapping[str, Motion]:
    """Return the motions in the folder of a body by name: read when they are first used. Raises MotionError.

    They may move joints that the body lacks and others of its folder have. A body without a folder has none.
    """
    family = family_of(body)
    if family is None:
        return MappingProxyType({})
    own, whole = family
    with resources.as_file(own / "motions") as folder:
        motions = [
            parse_motion(read_text(path, MotionError), path.stem, str(path), whole)
            for path in sorted(folder.glob("*.toml"))
        ]
    return MappingProxyType({motion.name: motion for motion in motions})
