"""What varies from trial to trial: numbers within a range or of a distribution, and choices."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Mapping
from typing import Annotated, Any, Final

import msgspec
from msgspec import Meta, Struct

from zenoh_ice.data.toml_file import convert, place

Value = bool | int | float | str
"""The value of a quantity in one trial."""
Values = Mapping[str, Value]
"""The quantities of one trial by name."""

_Number = Annotated[float, Meta(ge=-1e9, le=1e9)]
"""A number in a plan, so that what is drawn from it stays finite."""


Choice = Annotated[tuple[_Number, ...], Meta(min_length=1)]
"""The numbers of which one is chosen."""


class Spread(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, omit_defaults=True):
    """A distribution of numbers: even from `from` to `to`, or normal with `mean` and `deviation`.

    A normal one may have `from` and `to`, too: what lies beyond is set to them. `log` is even in the
    logarithm, `whole` gives whole numbers, both ends included.
    """

    lowest: _Number | None = msgspec.field(name="from", default=None)
    highest: _Number | None = msgspec.field(name="to", default=None)
    mean: _Number | None = None
    deviation: Annotated[float, Meta(gt=0, le=1e9)] | None = None
    log: bool = False
    whole: bool = False

    def __post_init__(self) -> None:
        if (self.mean is None) != (self.deviation is None):
            raise ValueError("a normal distribution has both a mean and a deviation")
        if self.mean is None and (self.lowest is None or self.highest is None):
            raise ValueError("write both from and to, or mean and deviation")
        if self.lowest is not None and self.highest is not None and self.lowest > self.highest:
            raise ValueError(f"from {self.lowest:g} is above to {self.highest:g}")
        if self.log and (self.mean is not None or (self.lowest or 0.0) <= 0.0):
            raise ValueError("log is for a range whose numbers are above 0")

    @property
    def bounds(self) -> tuple[float, float]:
        """The lowest and the highest number."""
        lowest = -math.inf if self.lowest is None else self.lowest
        return lowest, math.inf if self.highest is None else self.highest

    def draw(self, source: random.Random) -> int | float:
        """Return a number of the distribution."""
        lowest, highest = self.bounds
        if self.mean is not None and self.deviation is not None:
            number = min(highest, max(lowest, source.gauss(self.mean, self.deviation)))
        elif self.log:
            number = math.exp(source.uniform(math.log(lowest), math.log(highest)))
        elif self.whole:
            return source.randint(math.ceil(lowest), math.floor(highest))
        else:
            number = source.uniform(lowest, highest)
        return round(number) if self.whole else number


class Same(Struct, frozen=True, forbid_unknown_fields=True):
    """The value of another quantity, by its name; with a normally distributed error if it has a deviation."""

    same: str
    deviation: Annotated[float, Meta(gt=0, le=1e9)] | None = None

    def fits(self, other: object) -> bool:
        """Return whether the other quantity, as the plan has it, can have such an error: it has numbers."""
        values = other if isinstance(other, tuple) else (other,)
        return self.deviation is None or not any(isinstance(value, bool | str) for value in values)

    def draw(self, value: Value, source: random.Random) -> Value:
        """Return what it is where the other one has this value."""
        return value if self.deviation is None else float(value) + source.gauss(0.0, self.deviation)


Drawn = Spread | tuple[Value, ...] | bool | int | float | str
"""A distribution, the values from which one is chosen, or one value."""
Quantity = Drawn | Same

_KEYS: Final = frozenset((*Spread.__struct_encode_fields__, "same"))


def draw_all(quantities: Mapping[str, Quantity], seed: str) -> dict[str, Value]:
    """Return a value of each quantity, each from its own random numbers: a new one changes no other."""
    values = {
        name: _draw(each, random.Random(f"{seed}/{name}"))
        for name, each in quantities.items()
        if not isinstance(each, Same)
    }
    copies = {
        name: each.draw(values[each.same], random.Random(f"{seed}/{name}"))
        for name, each in quantities.items()
        if isinstance(each, Same)
    }
    return {name: (values | copies)[name] for name in quantities}


def varies(quantity: Quantity) -> bool:
    """Return whether a quantity differs by itself from trial to trial."""
    return isinstance(quantity, Spread | tuple)


def _draw(quantity: Drawn, source: random.Random) -> Value:
    if isinstance(quantity, Spread):
        return quantity.draw(source)
    return source.choice(quantity) if isinstance(quantity, tuple) else quantity


def read_quantities(
    table: Mapping[str, Any], section: str, source: str, text: str, error: Callable[[str], Exception]
) -> dict[str, Quantity]:
    """Return the quantities in a section of a TOML file by their dotted names; raises `error`."""
    found: dict[str, Quantity] = {}

    def read(part: Mapping[str, Any], path: tuple[str, ...]) -> None:
        for key, value in part.items():
            here = (*path, key)
            if isinstance(value, Mapping) and not _KEYS & value.keys():
                read(value, here)
                continue
            kind: Any = Same if isinstance(value, Mapping) and "same" in value else Drawn
            quantity: Quantity = convert(value, kind, source, error, path=here, text=text)
            if quantity == ():
                raise error(
                    f"{place(source, text, *here)}: the list is empty; write the values to choose from"
                )
            found[".".join(here[1:])] = quantity

    read(table, (section,))
    return found
