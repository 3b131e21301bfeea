"""The wire format of rmw_zenoh 0.2 and later: names, keys, liveliness tokens, QoS and attachments.

The format is that of rmw_zenoh's design document and sources (ros2/rmw_zenoh, docs/design.md); names follow
design.ros2.org, "Topic and Service name mapping".
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass, field
from typing import ClassVar, Final, Literal, Self

import xxhash

from .exceptions import InvalidNameError, RosError

EntityKind = Literal["NN", "MP", "MS", "SS", "SC"]
"""Node, message publisher, message subscription, service server, service client."""

SPACE: Final = "@ros2_lv"  # the first chunk of every token
HASHLESS: Final = "TypeHashNotSupported"
"""What nodes of Humble write for the hash of any type: they have no type hashes."""
_EMPTY: Final = "%"
_LONGEST_NAME: Final = 255
_MOST_DOMAINS: Final = 232
_NAME: Final = re.compile(r"(/|~/|)[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*")
_NODE_NAME: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_ATTACHMENT: Final = struct.Struct("<qqB16s")
_DURABILITY: Final = {"transient_local": "1", "volatile": "2"}
_RELIABILITY: Final = {"reliable": "1", "best_effort": "2"}
_DEFAULT_DEPTH: Final = 42  # of a token without one


@dataclass(frozen=True, slots=True)
class QoS:
    """Quality of service of a publisher or a subscription; the defaults are those of rclpy."""

    reliability: Literal["reliable", "best_effort"] = "reliable"
    """The declared reliability; a publisher waits for a slow link only if `keep_all` is set, too."""
    durability: Literal["volatile", "transient_local"] = "volatile"
    """Whether late joiners get the last `depth` messages."""
    depth: int = 10
    """Maximum messages that wait for a slow callback; older ones are dropped."""
    keep_all: bool = False
    """Whether no message is dropped, up to 10,000, and a reliable publisher waits for a slow link."""

    def __post_init__(self) -> None:
        if self.reliability not in _RELIABILITY or self.durability not in _DURABILITY:
            raise RosError(f"QoS: {self.reliability!r} and {self.durability!r} are not known")
        if not 1 <= self.depth <= 10_000:
            raise RosError(f"QoS: a depth from 1 to 10000 is needed, not {self.depth}")

    @property
    def queue(self) -> int:
        """Return the maximum number of waiting messages."""
        return 10_000 if self.keep_all else self.depth

    def encode(self) -> str:
        """Return the text in tokens, where defaults are left out."""
        reliability = "" if self.reliability == "reliable" else _RELIABILITY[self.reliability]
        durability = "" if self.durability == "volatile" else _DURABILITY[self.durability]
        history = "2," if self.keep_all else f",{self.depth}"
        return f"{reliability}:{durability}:{history}:,:,:,,"

    @classmethod
    def decode(cls, text: str) -> Self:
        """Return the QoS of a token; unknown values have their defaults."""
        reliability, durability, history, *_ = [*text.split(":"), "", "", ""]
        kind, _, depth = history.partition(",")
        number = int(depth) if depth.isdecimal() and len(depth) < 6 else _DEFAULT_DEPTH
        return cls(
            "best_effort" if reliability == "2" else "reliable",
            "transient_local" if durability == "1" else "volatile",
            min(max(number, 1), 10_000),
            kind == "2",
        )


SENSOR_DATA: Final = QoS(reliability="best_effort", depth=5)
"""For streams of sensors: the newest message matters, and a slow reader loses some."""
LATCHED: Final = QoS(durability="transient_local", depth=1)
"""For data that seldom changes, such as a map: late joiners get the last message."""


def domain_id(value: object) -> int:
    """Return a domain's number, checked."""
    if not isinstance(value, int | str) or not str(value).isdecimal() or int(value) > _MOST_DOMAINS:
        raise RosError(f"domain {value!r}: write a whole number from 0 to {_MOST_DOMAINS} (ROS_DOMAIN_ID)")
    return int(value)


def check_node_name(name: str, namespace: str) -> str:
    """Return the namespace of a node with its leading slash; raises InvalidNameError."""
    if not _NODE_NAME.fullmatch(name) or len(name) > _LONGEST_NAME:
        raise InvalidNameError(f"node {name!r}: write letters, digits and '_', not beginning with a digit")
    whole = "/" + namespace.strip("/")
    if whole != "/" and not _NAME.fullmatch(whole):
        raise InvalidNameError(f"namespace {namespace!r}: write names divided by '/', such as /robots/nao")
    return whole


def resolve(name: str, node: str, namespace: str) -> str:
    """Return the full name of a topic or service; `~` means the node. Raises InvalidNameError."""
    if not _NAME.fullmatch(name) or "__" in name:
        raise InvalidNameError(f"{name!r}: write letters, digits and '_', divided by '/', such as /scan")
    prefix = namespace.rstrip("/")
    if name.startswith("~"):
        full = f"{prefix}/{node}/{name[2:]}"
    else:
        full = name if name.startswith("/") else f"{prefix}/{name}"
    if len(full) > _LONGEST_NAME:
        raise InvalidNameError(f"{full!r}: a name has at most {_LONGEST_NAME} characters")
    return full


def dds_name(name: str) -> str:
    """Return a type's name in keys: `std_msgs::msg::dds_::String_` for `std_msgs/msg/String`."""
    package, kind, short = name.split("/")
    return f"{package}::{kind}::dds_::{short}_"


def ros_name(dds: str) -> str:
    """Return a type's name, given its name in a key."""
    return dds.replace("::dds_::", "::").removesuffix("_").replace("::", "/")


def key(domain: int, name: str, type_name: str, type_hash: str) -> str:
    """Return the key of a topic's messages, or of a service's requests."""
    return f"{domain}/{name.strip('/')}/{dds_name(type_name)}/{type_hash}"


@dataclass(frozen=True, slots=True)
class Entity:
    """A node, or a publisher, subscription, server or client of one; its token announces it."""

    kind: EntityKind
    domain: int
    session: str
    """Zenoh's id of its session."""
    node_id: int
    entity_id: int
    namespace: str
    node: str
    name: str = ""
    """Full name of the topic or service."""
    type_name: str = ""
    type_hash: str = ""
    qos: QoS = field(default_factory=QoS)

    @property
    def node_name(self) -> str:
        """Return the full name of its node."""
        return f"{self.namespace.rstrip('/')}/{self.node}"

    def fits(self, other: Entity) -> bool:
        """Return whether messages pass between it and another end, which has the same hash, or none."""
        return other.type_name == self.type_name and other.type_hash in (self.type_hash, HASHLESS)

    def token(self) -> str:
        """Return the key of its liveliness token."""
        head = f"{SPACE}/{self.domain}/{self.session}/{self.node_id}/{self.entity_id}/{self.kind}/{_EMPTY}/"
        place = head + f"{_mangle(self.namespace)}/{_mangle(self.node)}"
        if self.kind == "NN":
            return place
        return f"{place}/{_mangle(self.name)}/{dds_name(self.type_name)}/{self.type_hash}/{self.qos.encode()}"

    @classmethod
    def parse(cls, token: str) -> Self | None:
        """Return the entity of a token; None for one that does not follow the format."""
        parts = token.split("/")
        if len(token) > 4096 or len(parts) < 9 or parts[0] != SPACE:
            return None
        _, domain, session, node_id, entity_id, kind, _, namespace, node, *rest = parts
        if not (domain.isdecimal() and node_id.isdecimal() and entity_id.isdecimal()):
            return None
        known = (
            int(domain),
            session,
            int(node_id),
            int(entity_id),
            _demangle(namespace) or "/",
            _demangle(node),
        )
        if kind == "NN" and not rest:
            return cls("NN", *known)
        if kind in ("MP", "MS", "SS", "SC") and len(rest) >= 4:
            name, type_name, type_hash, qos, *_ = rest  # a later version may append parts
            return cls(kind, *known, _demangle(name), ros_name(type_name), type_hash, QoS.decode(qos))  # type: ignore[arg-type]
        return None

    def gid(self) -> bytes:
        """Return its 16-byte id in attachments."""
        return gid_of(self.token())


def gid_of(token: str) -> bytes:
    """Return the 16-byte id of an entity by its token: XXH3-128, low half first."""
    return xxhash.xxh3_128_intdigest(token.encode()).to_bytes(16, "little")


def tokens_of(domain: int, kind: EntityKind, name: str) -> str:
    """Return the key expression of the tokens of all entities of a kind that use a topic or a service."""
    return f"{SPACE}/{domain}/*/*/*/{kind}/*/*/*/{_mangle(name)}/**"


def _mangle(name: str) -> str:
    return name.replace("/", _EMPTY) or _EMPTY


def _demangle(text: str) -> str:
    return "" if text == _EMPTY else text.replace(_EMPTY, "/")


@dataclass(frozen=True, slots=True)
class Attachment:
    """The attachment of a message, a request or a reply."""

    SIZE: ClassVar[int] = _ATTACHMENT.size

    sequence: int
    stamp: int
    """ns since 1970 by the sender's wall clock"""
    gid: bytes

    def encode(self) -> bytes:
        """Return its 33 bytes."""
        return _ATTACHMENT.pack(self.sequence, self.stamp, len(self.gid), self.gid)

    @classmethod
    def decode(cls, data: bytes) -> Self | None:
        """Return the attachment of 33 bytes; None for anything else."""
        if len(data) != _ATTACHMENT.size:
            return None
        sequence, stamp, length, gid = _ATTACHMENT.unpack(data)
        return cls(sequence, stamp, gid) if length == len(gid) else None
