"""What several servants need to turn the interface's values into the robot's, and back."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager

from interfaces.jderobot import CommandRefusedException, InvalidValueException, Time
from naoserver.errors import CommandRefused, InvalidCommand


def to_time(seconds: float) -> Time:
    """Return a point in robot time as the interface has it."""
    whole, micro = divmod(round(seconds * 1_000_000), 1_000_000)
    return Time(seconds=whole, useconds=micro)


def require_finite(**values: float) -> None:
    """Raise InvalidValueException, naming the field, unless every value is a finite number."""
    for field, value in values.items():
        if not math.isfinite(value):
            raise InvalidValueException(f"{field} is {value}: it must be a finite number", field)


def require_fraction(fraction: float) -> None:
    """Raise InvalidValueException unless `fraction` is above 0 and at most 1."""
    if not 0.0 < fraction <= 1.0:
        raise InvalidValueException(f"fraction is {fraction}: it must be above 0 and at most 1", "fraction")


@contextmanager
def refusals_told() -> Iterator[None]:
    """Tell a refused command by the interface's exceptions.

    InvalidCommand becomes InvalidValueException, CommandRefused becomes CommandRefusedException.
    """
    try:
        yield
    except InvalidCommand as refusal:
        raise InvalidValueException(str(refusal), refusal.field) from refusal
    except CommandRefused as refusal:
        raise CommandRefusedException(str(refusal), refusal.holder) from refusal
