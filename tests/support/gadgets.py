"""Objects of a library that answer otherwise each time that they are asked, as sensors do."""

from __future__ import annotations

from collections.abc import Iterator

__all__ = ["Gadget", "alternate", "flag", "gadget"]


class Gadget:
    """Say yes and no by turns, whatever one does with it."""

    def __init__(self) -> None:
        self.calls = 0

    def _turn(self) -> bool:
        self.calls += 1
        return self.calls % 2 == 0

    @property
    def pressed(self) -> bool:
        """Whether it is pressed this time."""
        return self._turn()

    def __bool__(self) -> bool:
        return self._turn()

    def __gt__(self, other: object) -> bool:
        return self._turn()

    def __lt__(self, other: object) -> bool:
        return self._turn()

    def __eq__(self, other: object) -> bool:
        return self._turn()

    def __hash__(self) -> int:
        return 0

    def __len__(self) -> int:
        return self._turn()

    def __float__(self) -> float:
        return float(self._turn())

    def __int__(self) -> int:
        return int(self._turn())

    def __abs__(self) -> int:
        return int(self._turn())

    def __neg__(self) -> int:
        return int(self._turn())

    def __round__(self, digits: int = 0) -> int:
        return int(self._turn())

    def __floor__(self) -> int:
        return int(self._turn())

    def __add__(self, other: object) -> int:
        return int(self._turn())

    def __rmul__(self, other: object) -> int:
        return int(self._turn())

    def __str__(self) -> str:
        return "1" * self._turn()

    def __format__(self, spec: str) -> str:
        return str(self)

    def __getitem__(self, key: object) -> bool:
        return self._turn()

    def __contains__(self, key: object) -> bool:
        return self._turn()

    def __iter__(self) -> Iterator[bool]:
        return iter([True] * self._turn())

    def strip(self) -> bool:
        """Return whether it is pressed this time: a name that texts have, too."""
        return self._turn()


gadget = Gadget()
alternate = Gadget


def __getattr__(name: str) -> bool:
    if name == "flag":
        return gadget._turn()
    raise AttributeError(name)
