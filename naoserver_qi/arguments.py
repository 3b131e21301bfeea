"""Check the arguments that a client of libqi sent: numbers, texts, lists, and names of joints and chains."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Iterable, Mapping
from typing import Final

from naoserver.body import H25
from naoserver.errors import InvalidCommand

MOST: Final = 1000
"""Entries that a list may have."""
LONGEST: Final = 10_000
"""Characters that a text may have."""
_QUOTED: Final = 60  # characters of a foreign value in an error


def number(value: object, what: str) -> float:
    """Return a finite number. Raises InvalidCommand."""
    if not isinstance(value, (int, float)) or not math.isfinite(value):
        raise InvalidCommand(what, f"{what} is {reprlib.repr(value)}, not a finite number")
    return float(value)


def number_within(value: object, what: str, lower: float, upper: float) -> float:
    """Return a number from `lower` to `upper`. Raises InvalidCommand."""
    result = number(value, what)
    if not lower <= result <= upper:
        raise InvalidCommand(what, f"{what} is {result:g}: it must be from {lower:g} to {upper:g}")
    return result


def fraction(value: object, what: str) -> float:
    """Return a number above 0 and at most 1. Raises InvalidCommand."""
    result = number(value, what)
    if not 0.0 < result <= 1.0:
        raise InvalidCommand(what, f"{what} is {result:g}: it must be above 0 and at most 1")
    return result


def listed(value: object, what: str, count: int | None = None) -> list[object]:
    """Return the entries of a list, which has `count` of them if that is given. Raises InvalidCommand."""
    if not isinstance(value, (list, tuple)):
        raise InvalidCommand(what, f"{what} is {reprlib.repr(value)}, not a list")
    if len(value) > MOST:
        raise InvalidCommand(what, f"{what} has {len(value)} entries, more than {MOST}")
    if count is not None and len(value) != count:
        raise InvalidCommand(what, f"{what} has {len(value)} entries, not {count}")
    return list(value)


def numbers(value: object, what: str, count: int) -> list[float]:
    """Return `count` numbers: those of a list, or one for all. Raises InvalidCommand."""
    entries = listed(value, what, count) if isinstance(value, (list, tuple)) else [value] * count
    return [number(entry, what) for entry in entries]


def number_lists(value: object, what: str, count: int) -> list[list[float]]:
    """Return a list of numbers for each of `count` joints. Raises InvalidCommand.

    As NAOqi does, it takes one number for all; a number or a list for each; of one joint also its list alone.
    """
    if not isinstance(value, (list, tuple)):
        return [[number(value, what)] for _ in range(count)]
    if count == 1 and not any(isinstance(entry, (list, tuple)) for entry in value):
        value = [value]
    return [
        [number(one, what) for one in (listed(entry, what) if isinstance(entry, (list, tuple)) else [entry])]
        for entry in listed(value, what, count)
    ]


def text(value: object, what: str) -> str:
    """Return a text. Raises InvalidCommand."""
    if not isinstance(value, str):
        raise InvalidCommand(what, f"{what} is {reprlib.repr(value)}, not a text")
    if len(value) > LONGEST:
        raise InvalidCommand(what, f"{what} has {len(value)} characters, more than {LONGEST}")
    return value


def chosen(value: object, what: str, known: Iterable[str]) -> str:
    """Return a text that is one of some known. Raises InvalidCommand, which lists them."""
    name, names = text(value, what), tuple(known)
    if name not in names:
        raise InvalidCommand(what, f"there is no {what} {name[:_QUOTED]!r}; there are {', '.join(names)}")
    return name


def texts(value: object, what: str) -> list[str]:
    """Return one text or the texts of a list. Raises InvalidCommand."""
    if isinstance(value, str):
        return [text(value, what)]
    return [text(entry, what) for entry in listed(value, what)]


def keepable(value: object, what: str) -> object:
    """Return a value that may be kept: nothing, a number, a text, or lists of these that are not too large.

    Raises InvalidCommand.
    """
    size, rest = 0, [value]
    while rest:
        part = rest.pop()
        if isinstance(part, dict):
            part = [*part, *part.values()]
        if isinstance(part, (str, bytes, bytearray, list, tuple)):
            size += len(part)
        elif part is not None and not isinstance(part, (int, float)):
            raise InvalidCommand(what, f"{what} holds a {type(part).__name__}: only plain values are kept")
        if size > LONGEST:
            raise InvalidCommand(what, f"{what} is too large: {LONGEST} characters and entries are kept")
        if isinstance(part, (list, tuple)):
            rest.extend(part)
    return value


_JOINTS: Final = H25.joint_names


def _limbs(*parts: str) -> list[tuple[str, ...]]:
    """Return the joints of the left limb, and of the right one, by the part of their names after the side."""
    return [
        tuple(name for name in _JOINTS if name[0] == side and name[1:].startswith(parts)) for side in "LR"
    ]


_ARMS: Final = _limbs("Shoulder", "Elbow", "Wrist", "Hand")
_LEGS: Final = _limbs("Hip", "Knee", "Ankle")
CHAINS: Final[Mapping[str, tuple[str, ...]]] = {
    **dict.fromkeys(("Body", "Joints", "Actuators", "JointActuators"), _JOINTS),
    "Head": ("HeadYaw", "HeadPitch"),
    **dict(zip(("LArm", "RArm"), _ARMS, strict=True)),
    "Arms": _ARMS[0] + _ARMS[1],
    **dict(zip(("LLeg", "RLeg"), _LEGS, strict=True)),
    "Legs": _LEGS[0] + _LEGS[1],
}
"""The joints of each chain, in NAOqi's order."""


def joints_of(names: object) -> tuple[str, ...]:
    """Return the joints that one name or a list of names of joints and chains stand for.

    Raises InvalidCommand for other names.
    """
    joints: list[str] = []
    for name in texts(names, "names"):
        if name in CHAINS:
            joints += CHAINS[name]
        elif name in _JOINTS:
            joints.append(name)
        else:
            raise InvalidCommand(name[:_QUOTED], f"there is no joint or chain {name[:_QUOTED]!r}")
    return tuple(joints)


def for_joints(names: object, values: object) -> object:
    """Return values for the joints of some names; of a list of one for each name a chain has the same."""
    chains = texts(names, "names")
    if not isinstance(values, (list, tuple)) or len(values) != len(chains):
        return values
    return [value for name, value in zip(chains, values, strict=True) for _ in joints_of(name)]
