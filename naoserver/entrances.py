"""Entrances to a served robot beside its servants, such as NAOqi's, which installed packages provide.

Each is an entry point of the group `naoserver.entrances`, so that no robot server has to know them.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Protocol, cast

import typer

from naoserver.errors import RobotError

if TYPE_CHECKING:
    from naoserver.assembly import Assembly
    from naoserver.robot import Robot

__all__ = ["Disk", "Entrance", "find_entrance"]

_GROUP: Final = "naoserver.entrances"
_DISK: Final = "With --qi: the folder that stands for the robot's disk, where its sounds are."

Disk = Annotated[Path | None, typer.Option(metavar="DIR", help=_DISK, exists=True, file_okay=False)]
"""The option of commands with an entrance for NAOqi's programs."""


class Entrance(Protocol):
    """Serve a started robot at a URL in a `with` block, which gets the URL with the port that was picked."""

    def __call__(
        self, robot: Robot, assembly: Assembly, url: str, *, disk: Path | None = None
    ) -> AbstractContextManager[str]:
        """Serve it through the guards of `assembly`; raises RobotError when that is impossible."""


def find_entrance(name: str) -> Entrance:
    """Return the entrance of a name, such as `qi`; raises RobotError if no installed package provides it."""
    for point in entry_points(group=_GROUP, name=name):
        return cast("Entrance", point.load())
    message = f"no installed package serves robots as {name!r}: install visualhfsm again"
    raise RobotError(message)
