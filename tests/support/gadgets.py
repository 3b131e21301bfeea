"""A library with objects that answer otherwise each time that they are asked, as sensors do."""

from __future__ import annotations

from collections.abc import Iterator

__all__ = ["Gadget", "Number", "gadget"]


class Gadget:
    """Say no and yes alternately, whatever one asks: no the first time, yes the second."""

    def __init__(self) -> None:
        self._asked = 0

    def forget(self) -> None:
        """Say no the next time."""
        self._asked = 0

    @property
    def pressed(self) -> bool:
        """Whether it is pressed this time."""
        self._asked += 1
        return self._asked % 2 == 0

    def strip(self) -> bool:
        """Return whether it is pressed this time; texts have this method, too."""
        return self.pressed

    def __bool__(self) -> bool:
        return self.pressed

    def __eq__(self, other: object) -> bool:
        return self.pressed

    def __hash__(self) -> int:
        return 0

    def __gt__(self, other: object) -> bool:
        return self.pressed

    def __len__(self) -> int:
        return self.pressed

    def __float__(self) -> float:
        return float(self.pressed)

    def __abs__(self) -> int:
        return int(self.pressed)

    def __neg__(self) -> int:
        return -int(self.pressed)

    def __floor__(self) -> int:
        return int(self.pressed)

    def __add__(self, other: int) -> int:
        return self.pressed + other

    def __format__(self, spec: str) -> str:
        return f"{self.pressed}"

    def __getitem__(self, key: object) -> bool:
        return self.pressed

    def __contains__(self, key: object) -> bool:
        return self.pressed

    def __iter__(self) -> Iterator[int]:
        return iter([1] * self.pressed)


class Word(str):
    """Equal another text every second time."""

    __slots__ = ("asked",)
    __hash__ = str.__hash__

    def __eq__(self, other: object) -> bool:
        self.asked = not getattr(self, "asked", True)
        return self.asked


class Number(Gadget):
    """A number that every sum and product with it is, and every text of it a `Word`."""

    def _itself(self, other: object) -> Number:
        return self

    __add__ = __radd__ = __sub__ = __mul__ = __rmul__ = _itself  # type: ignore[assignment]

    def __str__(self) -> str:
        return Word("a")

    def __format__(self, spec: str) -> str:
        return Word("a")


gadget = Gadget()


def __getattr__(name: str) -> bool:
    if name == "flag":
        return gadget.pressed
    raise AttributeError(name)
