"""Other ways into a served robot, for programs that do not call its servants: plug-ins have them."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple, Protocol

from naoserver.protocol.robot import Robot
from naoserver.serving.assembly import Assembly
from naoserver.soccer_field import Field
from zenoh_ice import ObjectAdapter, plugins

_PORT: Final = re.compile(r":(\d+)(?=$|[?#/])")


class Serve(Protocol):
    """Serve a started robot in a `with` block, which gets the address, until it ends."""

    def __call__(
        self, robot: Robot, assembly: Assembly, options: Mapping[str, Any]
    ) -> AbstractContextManager[str]:
        """Serve it through the guards of `assembly`, which is closed later; may raise RobotError."""


class Served(NamedTuple):
    """A robot of a world as it is served."""

    robot: Robot
    assembly: Assembly
    adapter: ObjectAdapter
    """Which is not active yet: more servants can be added."""
    team: str


class ServeWorld(Protocol):
    """Serve more of a world in a `with` block, which gets what to say, until it ends."""

    def __call__(
        self, robots: Sequence[Served], field: Field | None, options: Mapping[str, Any]
    ) -> AbstractContextManager[str]:
        """Serve it beside its robots, on the soccer field if there is one; may raise RobotError."""


@dataclass(frozen=True, kw_only=True)
class Entrance:
    """What an entry point of the seam `naoserver.entrances` names."""

    programs: str
    """Whose programs come in, as people call them: `NAOqi`; or who does."""
    options: Mapping[str, tuple[Any, Any]]
    """The options that it adds to `naoserver-sim`: annotation, with typer's, and default, by parameter. The
    first one asks for the entrance; entrances may have one in common."""
    example: tuple[str, str]
    """A command line, and what it does, for the command's help."""
    serve: Serve | None = None
    """Serves each robot."""
    serve_world: ServeWorld | None = None
    """Serves all robots of a world together."""
    apart: Mapping[str, Callable[[Any, int], object]] = field(default_factory=dict)
    """Options that several robots cannot share: what that of robot 0, 1, ... is, by the given one."""

    @property
    def asked_by(self) -> str:
        """The name of the option that asks for it."""
        return next(iter(self.options))

    def is_wanted(self, options: Mapping[str, Any]) -> bool:
        """Return whether the values of a command line ask for it."""
        value = options[self.asked_by]
        return value is not None and value is not False


def find_entrances() -> list[Entrance]:
    """Return the entrances that are installed."""
    return [entrance for _, entrance in plugins.each("naoserver.entrances")]


def options_of(entrances: Iterable[Entrance]) -> list[inspect.Parameter]:
    """Return the options that entrances add to a command, each once."""
    options = {name: each for entrance in entrances for name, each in entrance.options.items()}
    only = inspect.Parameter.KEYWORD_ONLY
    return [
        inspect.Parameter(name, only, default=default, annotation=annotation)
        for name, (annotation, default) in options.items()
    ]


def later_port(address: str, number: int) -> str:
    """Return an address with its port increased by a number; port 0, which the system picks, stays."""
    return _PORT.sub(lambda found: f":{int(found[1]) + number if int(found[1]) else 0}", address)


def flag(option: str) -> str:
    """Return how an option is written on a command line."""
    return f"--{option.replace('_', '-')}"
