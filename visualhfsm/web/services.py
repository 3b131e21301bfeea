"""What running, monitoring and code completion offer to the server, as protocols.

Each is implemented in a package of its own; where that is missing, a null implementation answers that it is
not available. All methods run on the server's event loop and must not block it; they are cancelled after
`Limits.operation_seconds`, and `close` after a few seconds. What happens by itself is told to a `Publish`,
which may be called from any thread and never blocks. What a method returns goes to the page as JSON, by
msgspec: structs, dataclasses, mappings, lists and plain values.
"""

from __future__ import annotations

from collections.abc import AsyncGenerator, Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn, Protocol

from codegen.hfsm.document import Document
from visualhfsm.editing.places import Place
from visualhfsm.errors import VisualHfsmError

from .protocol import Output, RunPush, Snapshot, Stale, Structure

__all__ = [
    "CodeHelp",
    "Components",
    "Live",
    "NoCodeHelp",
    "NoLive",
    "NoRunning",
    "NotAvailableError",
    "Publish",
    "Running",
    "ServiceError",
    "Services",
    "Source",
]


class ServiceError(VisualHfsmError):
    """A service could not do what it was asked for; the message is shown to the person."""


class NotAvailableError(ServiceError):
    """A service is not there."""


@dataclass(frozen=True, slots=True)
class Source:
    """An open document as it stands at the moment of a request.

    `path` is its file, None as long as it has none; `dirty` says that the file holds something else, `title`
    what it is called.
    """

    tab: int
    revision: int
    document: Document
    path: Path | None
    dirty: bool
    title: str = ""


@dataclass(frozen=True, slots=True)
class Components:
    """The components that run in the realm: their names and whatever else the page shows of them."""

    running: Sequence[Mapping[str, Any]]
    robot_stopped: str = ""
    """Why the emergency stop of the realm's robot is latched; empty while it is not."""


Publish = Callable[[Components | Snapshot | Structure | Stale | Output | RunPush], None]
"""Tell the page something; of two values of the same thing the older one may be left out, output never is."""


class CodeHelp(Protocol):
    """Help for who types code. `line` counts from 1, `column` from 0; both within `code`."""

    async def complete(self, source: Source, place: Place, code: str, line: int, column: int) -> object:
        """Return what could follow, best first."""
        ...

    async def explain(self, source: Source, place: Place, code: str, line: int, column: int) -> object:
        """Return what the name at a position stands for, None when there is nothing to say."""
        ...

    async def signature(self, source: Source, place: Place, code: str, line: int, column: int) -> object:
        """Return the parameters of the call around the cursor, None outside of calls."""
        ...

    async def lint(self, source: Source, place: Place, code: str) -> object:
        """Return what is wrong with a piece of code as it is being typed, None when it was not looked at."""
        ...

    async def interfaces(self) -> object:
        """Return the interfaces that a document may declare, with operations and documentation."""
        ...

    async def close(self) -> None:
        """Let go of processes and threads."""
        ...


class Running(Protocol):
    """Generates components and runs them as child processes, one for each tab."""

    async def generate(self, source: Source) -> object:
        """Write the component's Python; return what was written."""
        ...

    async def run(self, source: Source, arguments: Sequence[str]) -> object:
        """Generate and start; its output, its end and its exit code are published."""
        ...

    async def stop(self, tab: int) -> object:
        """Stop what `run` started; nothing happens when nothing runs."""
        ...

    async def forget(self, tab: int) -> None:
        """Stop what runs for a tab that is closed, and let go of what was kept for it."""
        ...

    async def locate(self, source: Source, text: str, automaton: int, state: int) -> object:
        """Return which line of the document's code a line of a log speaks of, with its place; else None.

        Of pieces that share a line that of the `automaton` and its `state` is meant; 0 when they are unknown.
        """
        ...

    async def close(self) -> None:
        """Stop everything that runs."""
        ...


class Live(Protocol):
    """Follows and steers the components and the robot of a realm.

    `components`, `attach` and `control` raise ServiceError when there is no such component. A component is
    attached once however many windows follow it.
    """

    async def attach(self, component: str) -> object:
        """Publish the component's structure and snapshots from now on; return what the page begins with."""
        ...

    async def detach(self, component: str) -> None:
        """Publish them no longer."""
        ...

    async def control(self, component: str, action: str, arguments: Mapping[str, Any]) -> object:
        """Pause, step, force a transition, change a variable, stop the robot and the like."""
        ...

    async def recording(self, path: Path) -> object:
        """Open the recording of a run, for the timeline."""
        ...

    def camera(self, name: str) -> AsyncGenerator[bytes, None]:
        """Yield the newest image of a camera, as JPEG, whenever there is a newer one.

        It is asked for the next only when the page has drawn the last. Raises ServiceError.
        """
        ...

    def scene(self) -> AsyncGenerator[bytes, None]:
        """Yield first the robot's geometry as JSON, then the newest poses, for the view in 3D."""
        ...

    async def close(self) -> None:
        """Let go of sessions and threads."""
        ...


class _Missing:
    _what = ""

    def _refuse(self) -> NoReturn:
        raise NotAvailableError(f"{self._what} is not available")

    async def close(self) -> None:
        """Do nothing: there is nothing to let go of."""


class NoCodeHelp(_Missing):
    """Stands in where there is no help for code."""

    _what = "help for code"

    async def complete(self, source: Source, place: Place, code: str, line: int, column: int) -> object:  # noqa: ARG002
        """Refuse."""
        self._refuse()

    async def explain(self, source: Source, place: Place, code: str, line: int, column: int) -> object:  # noqa: ARG002
        """Refuse."""
        self._refuse()

    async def signature(self, source: Source, place: Place, code: str, line: int, column: int) -> object:  # noqa: ARG002
        """Refuse."""
        self._refuse()

    async def lint(self, source: Source, place: Place, code: str) -> object:  # noqa: ARG002
        """Refuse."""
        self._refuse()

    async def interfaces(self) -> object:
        """Refuse."""
        self._refuse()


class NoRunning(_Missing):
    """Stands in where components cannot be run."""

    _what = "running components"

    async def generate(self, source: Source) -> object:  # noqa: ARG002
        """Refuse."""
        self._refuse()

    async def run(self, source: Source, arguments: Sequence[str]) -> object:  # noqa: ARG002
        """Refuse."""
        self._refuse()

    async def stop(self, tab: int) -> object:
        """Do nothing: nothing runs."""

    async def forget(self, tab: int) -> None:
        """Do nothing: nothing runs."""

    async def locate(self, source: Source, text: str, automaton: int, state: int) -> object:  # noqa: ARG002
        """Know of nothing."""
        return None


class NoLive(_Missing):
    """Stands in where nothing can be followed."""

    _what = "monitoring"

    async def attach(self, component: str) -> object:  # noqa: ARG002
        """Refuse."""
        self._refuse()

    async def detach(self, component: str) -> None:  # noqa: ARG002
        """Refuse."""
        self._refuse()

    async def control(self, component: str, action: str, arguments: Mapping[str, Any]) -> object:  # noqa: ARG002
        """Refuse."""
        self._refuse()

    async def recording(self, path: Path) -> object:  # noqa: ARG002
        """Refuse."""
        self._refuse()

    def camera(self, name: str) -> AsyncGenerator[bytes, None]:  # noqa: ARG002
        """Refuse."""
        self._refuse()

    def scene(self) -> AsyncGenerator[bytes, None]:
        """Refuse."""
        self._refuse()


@dataclass(frozen=True, slots=True)
class Services:
    """What the server works with beside the documents."""

    code_help: CodeHelp = field(default_factory=NoCodeHelp)
    running: Running = field(default_factory=NoRunning)
    live: Live = field(default_factory=NoLive)


MakeServices = Callable[[Publish], Services]
"""Makes the services once the event loop runs; called on it."""


def no_services(_publish: Publish) -> Services:
    """Return services that answer that they are not available."""
    return Services()
