"""The containment of one submission: its trials run as others do, its code where it can harm nothing."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final, Self

from visualhfsm.simulation import Behavior, simulate

from ._errors import SandboxUnavailable


class Containment:
    """Run the trials of one submission; use it in a `with` block.

    With `unsafe` nothing contains its code. Raises SandboxUnavailable where there is nothing that could.
    """

    def __init__(self, *, unsafe: bool = False) -> None:
        self._unsafe: Final = unsafe

    def __enter__(self) -> Self:
        if not self._unsafe:
            raise SandboxUnavailable("submissions cannot be contained yet; --unsafe runs them without walls")
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def simulate(self, document: str | Path, **options: Any) -> Behavior:  # noqa: ANN401 - those of Behavior
        """Return a behavior in virtual time, as `visualhfsm.simulation.simulate` does."""
        return simulate(document, **options)
