"""Types that the editor's server shares with its parts, which start, follow and complete.

A part publishes events as messages of this module, which are sent to the page as they are; `publish` may
be called from any thread and never blocks. Its methods run on the server's event loop and do not block it;
their results are sent to the page as JSON, a VisualHfsmError as its text. They are cancelled when they take
too long.
"""

from __future__ import annotations

import contextlib
import secrets
import socket
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal, NotRequired, TypedDict

import msgspec

from codegen.hfsm.code.names import component_name
from codegen.hfsm.document import Document
from codegen.messages import NO_MESSAGE, Message
from visualhfsm._document.origins import Origin
from visualhfsm._document.places import Place
from visualhfsm._monitor.realm.follower import LiveStructure
from visualhfsm._monitor.realm.run_log import LiveSnapshot
from zenoh_ice.application.emergency_stop import STILL_LIMIT
from zenoh_ice.settings import ENVIRONMENT_PREFIX, host_and_port, is_loopback


@dataclass(frozen=True, slots=True, kw_only=True)
class PartLimits:
    """How long the parts of the server wait for a robot and for components, in s of wall time."""

    refreshment: float = 0.1
    """The period in s at which robot and components are looked at again."""
    silence: float = 1.0
    """A component sends its next snapshot, of ten per second; after that it is shown as silent."""
    appearance: float = 5.0
    """A robot's server that is ready is seen in the realm."""
    interruption: float = 5.0
    """A component's process ends after SIGINT, at which it stops the robot; then it gets SIGTERM."""
    termination: float = 3.0
    """A component's process ends after SIGTERM; then it is killed."""
    component_end: float = 2.0
    """A component ends at STOP; then the robot is stopped again."""
    stop_answer: float = 1.0
    """The robot answers to being stopped; then it is stopped again."""
    stop_repetition: float = 8.0
    """The robot confirms one of the stops that are repeated: less than a request of the page may take."""
    preparation: float = 1.0
    """A document was opened, or a component started; then a process starts that waits for the next start."""
    standstill: float = STILL_LIMIT
    """The joints are still after a confirmed stop."""


USUAL_LIMITS: Final = PartLimits()
"""The limits of a machine that does little else."""


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
class Failed:
    """An error while the component of a tab ran.

    `texts` are those at its place as they ran: in other code the error is no longer there.
    """

    tab: int
    origin: Origin
    message: Message
    texts: tuple[str, ...]


class PresentComponent(TypedDict):
    """A component of the realm; the file into which it is recorded here, and since when."""

    component: str
    recording: NotRequired[str]
    since: NotRequired[float]


@dataclass(frozen=True, slots=True)
class Present:
    """The components that run in the realm."""

    components: Sequence[PresentComponent]


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


class RecentLines:
    """The newest lines of output within two limits; the older ones are counted."""

    def __init__(self, lines: int, characters: int) -> None:
        self._most_lines = lines
        self._most_characters = characters
        self.lines: deque[OutputLine] = deque()
        self.clear()

    def clear(self) -> None:
        """Forget all lines."""
        self.lines.clear()
        self._characters = 0
        self.dropped = 0

    def add(self, lines: Iterable[OutputLine], dropped: int = 0) -> None:
        """Add lines; before them, `dropped` ones were left out."""
        self.dropped += dropped
        for line in lines:
            self.lines.append(line)
            self._characters += len(line.text)
        while len(self.lines) > self._most_lines or self._characters > self._most_characters:
            self._characters -= len(self.lines.popleft().text)
            self.dropped += 1


Stopper = Literal["window", "viewer"]
"""Who asks for the end of a run: a window of the editor, or a viewer."""


class StartedPush(Push, tag="started"):
    """The status of a component that was started here.

    `component` is its name, under which it can be followed some time after its process has `started`. The
    exit code is minus the number of the signal that ended it, if one did. An end that was not requested, or
    of code that hung, has the place in the document that led to it, and the line there, if they are known.
    `elsewhere` is the message for windows that did not request the end: it also says who did; empty if nobody
    did.
    """

    tab: int
    component: str
    status: Literal["generating", "starting", "started", "stopping", "ended"]
    exit_code: int | None = None
    message: Message = NO_MESSAGE
    elsewhere: Message = NO_MESSAGE
    place: Place | None = None
    line: int = 0


class Simulation(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    """A simulation as it is requested: options of `naoserver-sim`, and whether its balls move.

    Without a `body` it is of the default one.
    """

    world: str = "balls"
    speed: str = "1"
    balls: bool = False
    body: str = ""


class OtherRobot(msgspec.Struct, frozen=True):
    """Another robot of the world, which has another realm."""

    realm: str
    title: Message
    """Its name for people."""


class Robot(Push, omit_defaults=True):
    """The robot of the realm, and what the editor runs for it.

    A robot that is `starting` was started here and is not present yet; one that is `lost` was present, and
    was not ended here.
    """

    status: Literal["none", "starting", "present", "lost", "stopping"] = "none"
    simulated: bool = False
    name: str = ""
    """The address of a real robot that was connected here."""
    title: Message = NO_MESSAGE
    """The robot's name for people, if it is known."""
    speed: float = 0.0
    """Measured robot seconds per second of wall time."""
    since: float = 0.0
    """When it was lost, in s of wall time; 0 while it is not."""
    stopped: Message = NO_MESSAGE
    """Why its emergency stop is latched; empty while it is not."""
    started: Literal["", "simulation", "real"] = ""
    """The kind of robot that was started here and runs."""
    simulation: Simulation = Simulation()
    """The simulation that was last requested."""
    has_balls: bool = False
    """True if it has balls that can be moved."""
    postures: tuple[str, ...] = ()
    """The postures that it can be brought into, as far as they are known."""
    others: tuple[OtherRobot, ...] = ()
    """The other robots of its world."""
    serves: tuple[str, ...] = ()
    """The identities of what is served in its realm; empty while they are not known."""
    trouble: Message = NO_MESSAGE
    """Why the robot that was started here has ended, or is not seen."""


class Snapshot(Push):
    """The state of a running component at this moment."""

    component: str
    value: LiveSnapshot


class Structure(Push):
    """The automata of a running component."""

    component: str
    value: LiveStructure


class Stale(Push):
    """A component has been silent since a moment (s of wall time); `since` is 0 when it sends again."""

    component: str
    since: float


Publish = Callable[[Present | Failed | Push], None]
"""Send a message to the page; of two values of the same thing the older may be dropped, but never output."""


def free_endpoint(preferred: Iterable[str] = ()) -> str:
    """Return a free endpoint on loopback: the first of those preferred that is free, or any port."""
    for endpoint in preferred:
        place = host_and_port(endpoint) if is_loopback(endpoint) and endpoint.startswith("tcp/") else None
        with contextlib.suppress(OSError):
            if place is not None:
                with socket.create_server(place):
                    return endpoint
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


def own_listener(sockets: Path | None) -> dict[str, str]:
    """Return the variable with which a process listens at a new socket in a folder; without one, nothing."""
    if sockets is None:
        return {}
    return {f"{ENVIRONMENT_PREFIX}LISTEN": socket_endpoint(sockets)}


def socket_endpoint(sockets: Path) -> str:
    """Return an endpoint at a new socket in a folder."""
    return f"unixsock-stream/{sockets / secrets.token_hex(4)}"
