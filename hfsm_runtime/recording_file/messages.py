"""The contents of a recording: the messages of each channel, as JSON.

A channel's schema names the message, so that a reader need not know the topics. Messages are in the order in
which things happened; their time is the wall time at the start of the component plus component time.
`context` says whose code was running: `automaton 3`, the start of the component (`start`),
the arrival of an asynchronous result (`future 2`), a callback (`subscription 1`), or empty for a thread that
the runtime does not know.
"""

from __future__ import annotations

from hashlib import sha256
from typing import Annotated, Any, Final

import msgspec
from msgspec import Meta

WATCHED: Final = "watched"
"""The metadata that marks a recording made by a watcher of the component: it cannot be replayed."""

METADATA: Final = "visualhfsm.component"
"""The name of the metadata about the component."""

FORMAT: Final = "1"
"""The metadata `format`: another number with each change that an older version cannot read."""

SOURCES: Final = ("document", "component", "extension", "import")
"""The attachments, as `document/follow_ball.xml`: the document, and the Python that ran."""

LARGEST_DESCRIPTION: Final = 3 << 20
"""Most bytes of a robot's description, less than of any message."""

Text = Annotated[str, Meta(max_length=1 << 20)]


class Message(msgspec.Struct, frozen=True, omit_defaults=True):
    """The root of the messages."""


class OfAutomaton(Message, frozen=True):
    """The root of messages about one automaton, by its id and its name."""

    automaton: int
    name: Text


class Cycle(OfAutomaton, frozen=True):
    """A cycle of an automaton begins or has ended; `at` is its component time in ns."""

    begins: bool
    at: int


class Change(OfAutomaton, frozen=True):
    """An automaton entered a state, became a ghost in it, resumed it, or has finished in it."""

    state: int
    state_name: Text
    kind: Text
    at: int


class Guard(OfAutomaton, frozen=True):
    """The guard of a transition was evaluated."""

    transition: int
    transition_name: Text
    value: bool


class Firing(OfAutomaton, frozen=True):
    """A transition fires."""

    transition: int
    transition_name: Text
    origin: Text
    destination: Text


class Variables(OfAutomaton, frozen=True):
    """The variables of an automaton that a cycle changed; `gone` names those without a value."""

    values: dict[str, Any]
    gone: list[str] = []


class EventSent(Message, frozen=True):
    """An event was sent, by the component's own code in a context, or from outside."""

    name: Text
    data: Any = None
    context: Text = ""


class Mark(Message, frozen=True):
    """The component marked a pixel of a camera's picture; it is shown for 0.5 s of component time."""

    camera: Text
    u: float
    v: float
    label: Text = ""


def values_of(pose: Any) -> list[float]:  # noqa: ANN401
    """Return a nao::Pose as a place: its position and its quaternion."""
    at, turn = pose.position, pose.orientation
    return [at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w]


class RobotPose(Message, frozen=True):
    """The pose of the robot and, in a simulation, of movable objects: not an input of the component.

    Angles in rad by joint. A place is a position in m in the world's frame, then a quaternion x, y, z, w.
    What the robot `says`, and the name of the `sound` that it plays, are known where the editor recorded.
    """

    joints: dict[str, float]
    torso: list[float] | None = None
    objects: dict[str, list[float]] = {}
    says: str = ""
    sound: str = ""


class Fault(msgspec.Struct, frozen=True):
    """A failure that somebody injected into a part of a robot, by a kind of `nao::FaultKind`.

    The part of a robot of another realm has that behind it, as in `Camera@nao2`; `amount` is in the unit
    of the kind, and 0 for one without.
    """

    part: Annotated[str, Meta(max_length=200)]
    kind: Annotated[str, Meta(max_length=200)]
    amount: float = 0.0

    def __str__(self) -> str:
        return f"{self.part} {self.kind}" + (f" {self.amount:g}" if self.amount else "")


class Failing(Message, frozen=True):
    """All that fails from now on, of the robots of the component: not an input of it."""

    faults: Annotated[tuple[Fault, ...], Meta(max_length=500)]


class Shape(msgspec.Struct, frozen=True, omit_defaults=True):
    """A shape of the world as `nao::WorldShape` has it; `at` is its place, and `kind` a word like box."""

    object: str
    kind: str
    size: list[float]
    at: list[float]
    color: list[float]
    opacity: float = 1.0

    @classmethod
    def of(cls, shape: Any) -> Shape:  # noqa: ANN401 - a nao::WorldShape, which this package does not know
        """Return the shape that a simulation reports."""
        size, color = shape.size, shape.color
        return cls(
            shape.object, shape.kind.name.lower(), [size.x, size.y, size.z], values_of(shape.pose),
            [color.x, color.y, color.z], shape.opacity,
        )  # fmt: skip


class World(Message, frozen=True):
    """The world of a simulation, without the robot."""

    shapes: list[Shape]


class Description(Message, frozen=True):
    """The robot's body and its looks, in JSON, as `nao::Description` has them."""

    body: str
    looks: str = ""

    @classmethod
    def of(cls, body: str, looks: str) -> Description:
        """Return the description, without looks that are too large for a recording."""
        found = cls(body, looks)
        return found if len(msgspec.json.encode(found)) < LARGEST_DESCRIPTION else cls(body)


class Action(Message, frozen=True):
    """A client steers the component: pauses it, forces a transition or sets a variable."""

    kind: Text
    arguments: dict[str, Any] = {}


class Failure(OfAutomaton, frozen=True):
    """A piece of user code raised an exception."""

    state_name: Text
    message: Text
    location: Text = ""


class Stamp(msgspec.Struct, frozen=True):
    """A wall time, as Foxglove writes it."""

    sec: int
    nsec: int

    @classmethod
    def of(cls, time: int) -> Stamp:
        """Return a time in ns since the epoch."""
        return cls(*divmod(time, 1_000_000_000))


class LogLine(Message, frozen=True):
    """A line of the component's log, in the shape of foxglove.Log."""

    timestamp: Stamp
    level: int
    message: Text
    name: Text
    file: Text = ""
    line: int = 0


class Reading(Message, frozen=True):
    """A local reading by user code: a clock (`now`, `time.time`), the end of a sleep, or an age."""

    context: Text
    kind: Text
    value: Any = None


class Missing(msgspec.Struct, frozen=True):
    """Bytes, such as those of an image, that are elsewhere in the recording or were not recorded."""

    path: list[str | int]
    size: int
    hash: Text


class Result(Message, frozen=True):
    """The result of an operation of a proxy.

    `kind` is call; begin and async of a call without waiting; latest and wait, which is over when it has
    returned an error or a newer sample; subscribe and sample. `value` is for people, and cut if it is long.
    `packed` is the exact value as on the wire, in base64, or None if there is none or it was `too_large`.
    """

    context: Text
    kind: Text
    operation: Text
    arguments: Any = None
    value: Any = None
    packed: bytes | None = None
    error: Text = ""
    packed_error: bytes | None = None
    missing: list[Missing] = []
    too_large: int = 0
    ticket: int = 0
    """Number of the asynchronous call or the subscription that it belongs to."""
    sequence: int = 0
    time: float | None = None
    wall_time: float = 0.0
    same: bool = False
    """True for the sample of this context's last reading of the stream."""
    age: float | None = None
    stream: Text = ""
    """Id of the stream of the sample; it changes with each restart of the servant."""


class Image(Message, frozen=True):
    """An image, in the shape of foxglove.RawImage; of other bytes width and height are their number and 1."""

    timestamp: Stamp
    frame_id: Text
    width: int
    height: int
    encoding: Text
    step: int
    data: bytes
    hash: Text


class Picture(Message, frozen=True):
    """A compressed image, in the shape of foxglove.CompressedImage."""

    timestamp: Stamp
    frame_id: Text
    data: bytes
    format: Text
    hash: Text

    @classmethod
    def of(cls, camera: str, time: int, jpeg: bytes) -> Picture:
        """Return the message of a JPEG."""
        return cls(Stamp.of(time), camera, jpeg, "jpeg", sha256(jpeg).hexdigest())


class Snapshot(Message, frozen=True):
    """A component as its monitor shows it: a `hfsm::ComponentSnapshot` in JSON."""

    component: msgspec.Raw

    @classmethod
    def of(cls, component: msgspec.Struct) -> Snapshot:
        """Return the message of a snapshot."""
        return cls(msgspec.Raw(msgspec.json.encode(component)))


class Gap(Message, frozen=True):
    """Messages were lost because the recording could not keep up."""

    lost: int


class Overlap(Message, frozen=True):
    """User code blocked for so long that other code ran beside it: from here on their order is unknown."""

    context: Text
    beside: Text


_OURS: Final[tuple[type[Message], ...]] = (
    Cycle, Change, Guard, Firing, Variables, Failure,
    EventSent, Mark, RobotPose, Failing, World, Description, Action, Reading, Result, Gap, Overlap, Snapshot,
)  # fmt: skip
TO_LOOK_AT: Final[tuple[type[Message], ...]] = (
    Description, Failing, Image, Picture, RobotPose, Snapshot, World,
)  # fmt: skip
"""Messages that a replay skips: they are not inputs of the component or, like images, found by hash."""
MESSAGES: Final[dict[str, type[Message]]] = {
    "foxglove.Log": LogLine,
    "foxglove.RawImage": Image,
    "foxglove.CompressedImage": Picture,
    **{f"visualhfsm.{kind.__name__}": kind for kind in _OURS},
}
"""The messages by the name of their schema."""


def schema_of(message: type[Message]) -> bytes:
    """Return the JSON Schema of a message: an object without references, as viewers want it."""
    schema = msgspec.json.schema(message)
    definitions = schema.pop("$defs", {})
    return msgspec.json.encode(_inline(schema, definitions))


def _inline(node: Any, definitions: dict[str, Any]) -> Any:  # noqa: ANN401 - JSON
    if isinstance(node, list):
        return [_inline(item, definitions) for item in node]
    if not isinstance(node, dict):
        return node
    reference = node.get("$ref")
    if isinstance(reference, str):
        return _inline(definitions[reference.rpartition("/")[2]], definitions)
    return {key: _inline(value, definitions) for key, value in node.items()}
