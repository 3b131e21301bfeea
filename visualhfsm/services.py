"""What the editor's server shares with its services: running, live data and code completion.

A service publishes events as messages of this module, which are sent to the page as they are; `publish` may
be called from any thread and never blocks. Its methods run on the server's event loop and do not block it;
their results are sent to the page as JSON, a VisualHfsmError as its text. They are cancelled when they take
too long.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeVar

import msgspec

from codegen.hfsm.code.names import component_name
from codegen.hfsm.document import Document
from visualhfsm.editing.places import Place

__all__ = [
    "Components",
    "Output",
    "OutputLine",
    "Publish",
    "Push",
    "RunPush",
    "Snapshot",
    "Source",
    "Stale",
    "Structure",
    "complete",
    "retrieve",
    "tag",
]

R = TypeVar("R")


@dataclass(frozen=True, slots=True)
class Source:
    """An open document at the moment of a request.

    `path` is its file, None as long as it has none; `dirty` says that the file differs, `title` is its name.
    """

    tab: int
    revision: int
    document: Document
    path: Path | None
    dirty: bool
    title: str = ""

    @property
    def component(self) -> str:
        """The name of its component, which follows from that of the file, or from the title without one."""
        return component_name(self.title if self.path is None else self.path.stem)


@dataclass(frozen=True, slots=True)
class Components:
    """The components that run in the realm: their names and what else the page shows of them."""

    running: Sequence[Mapping[str, Any]]
    robot_stopped: str = ""
    """Why the emergency stop of the realm's robot is latched; empty while it is not."""


def tag(class_name: str) -> str:
    """Return the tag of a message in JSON: the name of its class with a lower-case first letter."""
    return class_name[0].lower() + class_name[1:]


class Push(msgspec.Struct, kw_only=True, rename="camel", tag_field="push", tag=tag):
    """A message that the page gets without a request."""


class OutputLine(msgspec.Struct, kw_only=True, rename="camel"):
    """A line that a component wrote, and the piece of code to which it refers, if any."""

    text: str
    stream: Literal["out", "err"] = "out"
    place: Place | None = None
    line: int = 0


class Output(Push):
    """Lines that a component wrote; `dropped` older ones were too many for this window.

    `whole` says that these are all lines, and replace those that the window has.
    """

    tab: int
    lines: list[OutputLine]
    dropped: int = 0
    whole: bool = False


class RunPush(Push, tag="run"):
    """The status of a component that was started here.

    `component` is its name, under which it is followed. The exit code is minus the number of the signal that
    ended it, if one did.
    """

    tab: int
    component: str
    status: Literal["generating", "starting", "running", "stopping", "ended"]
    exit_code: int | None = None
    message: str = ""


class Snapshot(Push):
    """The state of a running component at this moment."""

    component: str
    value: Any


class Structure(Push):
    """The automata of a running component."""

    component: str
    value: Any


class Stale(Push):
    """A component has been silent since a moment (s of wall time); `since` is 0 when it sends again."""

    component: str
    since: float


Publish = Callable[[Components | Snapshot | Structure | Stale | Output | RunPush], None]
"""Send something to the page; of two values of one thing the older may be dropped, output never is."""


async def complete(work: Coroutine[object, object, R]) -> R:
    """Wait for work that continues to its end even when its caller is cancelled."""
    task = asyncio.create_task(work)
    task.add_done_callback(retrieve)
    return await asyncio.shield(task)


def retrieve(future: asyncio.Future[R]) -> None:
    """Mark an exception as seen: a caller that still waits gets it."""
    if not future.cancelled():
        future.exception()
