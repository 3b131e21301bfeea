"""Check the arguments that a client of libqi sent; and operations that do nothing else.

Arguments are numbers, texts, lists, and names of joints and chains.
"""

from __future__ import annotations

import inspect
import logging
import math
import reprlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any, Final

from naoserver.bodies.body import Body
from naoserver.errors import InvalidCommand

_logger = logging.getLogger(__name__)

MOST_ENTRIES: Final = 1000
"""Maximum entries of a list, and maximum values without effect that a service keeps: the newest ones."""
LONGEST_TEXT: Final = 10_000
"""Maximum characters of a text."""
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
    """Return the entries of a list, exactly `count` if that is given. Raises InvalidCommand."""
    if not isinstance(value, (list, tuple)):
        raise InvalidCommand(what, f"{what} is {reprlib.repr(value)}, not a list")
    if len(value) > MOST_ENTRIES:
        raise InvalidCommand(what, f"{what} has {len(value)} entries, more than {MOST_ENTRIES}")
    if count is not None and len(value) != count:
        raise InvalidCommand(what, f"{what} has {len(value)} entries, not {count}")
    return list(value)


def vector(value: object, what: str, count: int | None = None) -> list[float]:
    """Return the numbers of a list, exactly `count` if that is given. Raises InvalidCommand."""
    return [number(entry, what) for entry in listed(value, what, count)]


def numbers(value: object, what: str, count: int) -> list[float]:
    """Return `count` numbers: those of a list, or one for all. Raises InvalidCommand."""
    return vector(value if isinstance(value, (list, tuple)) else [value] * count, what, count)


def number_lists(value: object, what: str, count: int) -> list[list[float]]:
    """Return a list of numbers for each of `count` joints. Raises InvalidCommand.

    Like NAOqi, it accepts one number for all; a number or a list for each; for one joint also just its list.
    """
    if not isinstance(value, (list, tuple)):
        return [[number(value, what)] for _ in range(count)]
    if count == 1 and not any(isinstance(entry, (list, tuple)) for entry in value):
        value = [value]
    entries = listed(value, what, count)
    return [vector(entry if isinstance(entry, (list, tuple)) else [entry], what) for entry in entries]


def text(value: object, what: str) -> str:
    """Return a text. Raises InvalidCommand."""
    if not isinstance(value, str):
        raise InvalidCommand(what, f"{what} is {reprlib.repr(value)}, not a text")
    if len(value) > LONGEST_TEXT:
        raise InvalidCommand(what, f"{what} has {len(value)} characters, more than {LONGEST_TEXT}")
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
    """Return a value that may be kept: None, numbers, texts, lists, not too large. Raises InvalidCommand."""
    size, rest = 0, [value]
    while rest:
        part = rest.pop()
        if isinstance(part, dict):
            part = [*part, *part.values()]
        if isinstance(part, (str, bytes, bytearray, list, tuple)):
            size += len(part)
        elif part is not None and not isinstance(part, (int, float)):
            raise InvalidCommand(what, f"{what} holds a {type(part).__name__}: only plain values are kept")
        if size > LONGEST_TEXT:
            raise InvalidCommand(what, f"{what} is too large: {LONGEST_TEXT} characters and entries are kept")
        if isinstance(part, (list, tuple)):
            rest.extend(part)
    return value


class JointNames:
    """The names by which clients call the joints of a body: their own, and those of chains."""

    def __init__(self, body: Body) -> None:
        groups = body.groups
        chains: dict[str, tuple[str, ...]] = {joint: (joint,) for joint in body.joint_names}
        driven = tuple(joint.name for joint in body.joints if not joint.passive)
        chains |= dict.fromkeys(("Body", "Joints", "Actuators", "JointActuators"), driven)
        chains |= {"Head": groups.head, "Arms": groups.arms, "Legs": groups.legs}
        chains |= {"LArm": groups.left_arm, "RArm": groups.right_arm}
        chains |= {"LLeg": groups.left_leg, "RLeg": groups.right_leg}
        self.chains: Final[Mapping[str, Sequence[str]]] = chains
        """The joints of each name, those of a chain in NAOqi's order."""
        hands = (body.hinge(name) for name in ("LeftHand", "RightHand"))
        self.hands: Final = frozenset(joint for hand in hands if hand for joint in hand.joints)
        """The joints that open and close the hands."""

    def of(self, names: object) -> tuple[str, ...]:
        """Return the joints of one or more names of joints and chains. Raises InvalidCommand."""
        joints: list[str] = []
        for name in texts(names, "names"):
            if name not in self.chains:
                raise InvalidCommand(name[:_QUOTED], f"there is no joint or chain {name[:_QUOTED]!r}")
            joints += self.chains[name]
        return tuple(joints)

    def spread(self, names: object, values: object) -> object:
        """Return values for the joints of some names; a value for a chain applies to each of its joints."""
        chains = texts(names, "names")
        if not isinstance(values, (list, tuple)) or len(values) != len(chains):
            return values
        return [value for name, value in zip(chains, values, strict=True) for _ in self.of(name)]


Check = Callable[[Any, str], Any]
"""Makes a value from an argument and its name. Raises InvalidCommand."""
Operation = Callable[..., Any]


def switch(value: object, _what: str) -> bool:
    """Return whether something is to be on: the truth of any value."""
    return bool(value)


def within(lower: float, upper: float) -> Check:
    """Return the check of a number from `lower` to `upper`."""
    return partial(number_within, lower=lower, upper=upper)


def one_of(what: str, known: Iterable[str]) -> Check:
    """Return the check of a text that is one of some known."""
    return lambda value, _what: chosen(value, what, known)


def constant(does: str, value: object = None, **checks: Check) -> Operation:
    """Return the operation that checks its arguments and returns a value; `does` describes it."""

    def operation(_self: object, *arguments: object) -> object:
        _checked(checks, arguments)
        return value

    return _described(operation, does, checks)


def refused(why: str) -> Operation:
    """Return the operation that raises InvalidCommand, whatever its arguments."""

    def operation(_self: object, *_arguments: object) -> None:
        raise InvalidCommand("operation", why)

    operation.__doc__ = f"Refused: {why}."
    return operation


def kept(
    what: str, initial: object, *, result: object = None, **checks: Check
) -> tuple[Operation, Operation]:
    """Return the operations that set and get a value without effect, such as a volume.

    The last check is that of the value. Those before it are for further arguments of both operations, such
    as the part of the body that the value belongs to. `result` is the result of the first operation.
    """
    own = dict(list(checks.items())[:-1])

    def remember(self: Any, *arguments: object) -> object:  # noqa: ANN401 - any service
        *key, new = _checked(checks, arguments)
        if len(self.kept) >= MOST_ENTRIES and (what, *key) not in self.kept:
            self.kept.pop(next(iter(self.kept)), None)  # the oldest
        self.kept[what, *key] = new
        _logger.info("%s is %s, which has no effect", what, reprlib.repr(new))
        return result

    def recall(self: Any, *arguments: object) -> object:  # noqa: ANN401 - any service
        return self.kept.get((what, *_checked(own, arguments)), initial)

    setter = _described(remember, f"Remember {what}, without effect.", checks)
    return setter, _described(recall, f"Return {what}.", own)


def _checked(checks: Mapping[str, Check], arguments: tuple[object, ...]) -> list[Any]:
    return [check(value, name) for (name, check), value in zip(checks.items(), arguments, strict=True)]


def _described(operation: Operation, does: str, names: Iterable[str]) -> Operation:
    """Return an operation with a description, and the names of its parameters."""
    kind = inspect.Parameter.POSITIONAL_OR_KEYWORD
    signature = inspect.Signature([inspect.Parameter(name, kind) for name in ("self", *names)])
    operation.__doc__, operation.__signature__ = does, signature  # type: ignore[attr-defined]
    return operation
