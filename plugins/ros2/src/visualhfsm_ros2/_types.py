"""The topics, services and actions of ROS 2 in documents: the meaning of their words, and their types.

`zenoh_ros2` knows the types; it is imported only for documents that use some.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

from codegen.files import read_regular
from codegen.hfsm.kinds import NOT_INSTALLED
from codegen.messages import Message, MessageError

if TYPE_CHECKING:
    from zenoh_ros2 import Types

FOLDERS: Final[Mapping[str, Literal["msg", "srv", "action"]]] = {
    "publish": "msg",
    "subscribe": "msg",
    "service": "srv",
    "action": "action",
}
"""The middle of the name of a type, which is also the folder of its file, by the kind of interface."""
_PARTS: Final = {"publish": "", "call": "_Request", "call_async": "_Request", "send": "_Goal"}
"""The suffix that turns the name of a type into that of the message that an operation takes."""

_VELOCITIES: Final = ("geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped")
_QOS: Final[Mapping[str, Mapping[str, object]]] = {
    "sensor_data": {"reliability": "best_effort", "depth": 5},
    "latched": {"durability": "transient_local", "depth": 1},
    "reliable": {"reliability": "reliable"},
    "best_effort": {"reliability": "best_effort"},
    "volatile": {"durability": "volatile"},
    "transient_local": {"durability": "transient_local"},
    "keep_all": {"keep_all": True},
}
_LARGEST_DEPTH: Final = 10_000
_NAME: Final = re.compile(r"(/|~/)?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*")
_LONGEST_NAME: Final = 200
_LARGEST_FILE: Final = 1 << 18
_TYPE_NAME: Final = re.compile(r"\b(?:([a-z][a-z0-9_]*)/(?:msg/)?)?([A-Z][A-Za-z0-9]*)\b")


def is_ros_name(name: str) -> bool:
    """Return whether ROS 2 accepts a name of a topic, service or action: `/scan`, `scan` or `~/scan`."""
    return len(name) <= _LONGEST_NAME and "__" not in name and _NAME.fullmatch(name) is not None


class QosError(MessageError):
    """A word means no quality of service."""


def parse_qos(text: str) -> dict[str, object]:
    """Return the fields of `QoS` from words, such as `best_effort depth=5`, of which later ones win.

    Raises QosError.
    """
    found: dict[str, object] = {}
    for word in text.split():
        depth = word.removeprefix("depth=")
        if word in _QOS:
            found |= _QOS[word]
        elif depth.isascii() and depth.isdigit() and 1 <= int(depth[:9]) <= _LARGEST_DEPTH:
            found["depth"] = int(depth)
        else:
            raise QosError.because(
                "`{word}` is none of {known} and depth=1 to depth={limit}",
                word=word[:40],
                known=", ".join(_QOS),
                limit=_LARGEST_DEPTH,
            )
    return found


def stops(kind: str, type_name: str, stop: str) -> bool:
    """Return whether a default message is published when the component stops; velocities do so unasked."""
    return kind == "publish" and (stop == "true" or (not stop and type_name in _VELOCITIES))


@dataclass(frozen=True)
class RosTypes:
    """The types that a document may use: those of `zenoh_ros2`, and those of files below some `directories`.

    Such a file lies in the folder of its kind in that of its package, as in ROS: `my_msgs/msg/Ball.msg`.
    """

    directories: Sequence[Path] = ()

    def names(self, kind: str) -> list[str]:
        """Return the names of the types that an interface of a kind may have."""
        types = self._loaded.types
        return [] if types is None else [*types.names(FOLDERS[kind])]

    def problem(self, name: str, kind: str) -> Message | None:
        """Return why an interface of a kind cannot have a type, None if it can."""
        if re.fullmatch(rf"[a-z][a-z0-9_]*/{FOLDERS[kind]}/[A-Z][A-Za-z0-9]*", name) is None:
            return Message("`{name}` is not the type of {wanted}", name=name[:60], wanted=_WANTED[kind])
        if name in self._loaded.failures:
            return Message.verbatim(self._loaded.failures[name])
        types = self._loaded.types
        if types is None:
            return NOT_INSTALLED
        if name in types.names(FOLDERS[kind]):
            return None
        return Message("there is no type `{name}`", name=name)

    def fields(self, type_name: str, operation: str = "publish") -> dict[str, str] | None:
        """Return the fields of the message that an operation takes, with their types as in a .msg file.

        None if they are unknown.
        """
        types, name = self._loaded.types, type_name + _PARTS[operation]
        return dict(types.fields(name)) if types is not None and name in types else None

    def type_texts(self, used: Sequence[str]) -> dict[str, str]:
        """Return the texts of the project's own types among those used, each after the types it needs."""
        return _with_needed(used, self._own) if used else {}

    @cached_property
    def _own(self) -> dict[str, str]:
        """The texts of all files by the names of their types."""
        found: dict[str, str] = {}
        for directory in self.directories:
            for folder in dict.fromkeys(FOLDERS.values()):
                for path in sorted(directory.glob(f"*/{folder}/*.{folder}")):
                    name = f"{path.parent.parent.name}/{folder}/{path.stem}"
                    with suppress(OSError):  # what cannot be read defines no type
                        text = read_regular(path, _LARGEST_FILE + 1)
                        if len(text) <= _LARGEST_FILE:
                            found.setdefault(name, text.decode(errors="replace").replace("\r\n", "\n"))
        return found

    @cached_property
    def _loaded(self) -> _Loaded:
        return _load(tuple(_with_needed([*self._own], self._own).items()))


class _Loaded(NamedTuple):
    """Types, None where `zenoh_ros2` is not installed, and why some could not be read, by their names."""

    types: Types | None
    failures: dict[str, str]


_WANTED: Final = {
    "publish": Message("a topic, such as geometry_msgs/msg/Twist"),
    "subscribe": Message("a topic, such as sensor_msgs/msg/LaserScan"),
    "service": Message("a service, such as std_srvs/srv/Trigger"),
    "action": Message("an action, such as control_msgs/action/FollowJointTrajectory"),
}


def _with_needed(used: Sequence[str], texts: Mapping[str, str]) -> dict[str, str]:
    found: dict[str, str] = {}

    def add(name: str) -> None:
        if name in found or name not in texts:
            return
        found[name] = ""  # in case types need each other, which `zenoh_ros2` reports
        for needed in _needed(name, texts[name]):
            add(needed)
        del found[name]  # after the types that it needs
        found[name] = texts[name]

    for each in used:
        add(each)
    return found


def _needed(name: str, text: str) -> Iterator[str]:
    package = name.partition("/")[0]
    for line in text.splitlines():
        for match in _TYPE_NAME.finditer(line.partition("#")[0]):
            yield f"{match[1] or package}/msg/{match[2]}"


@lru_cache(maxsize=8)
def _load(texts: tuple[tuple[str, str], ...]) -> _Loaded:
    try:
        from zenoh_ros2 import RosError, Types
    except ImportError:
        return _Loaded(None, {})
    types = Types()
    failures: dict[str, str] = {}
    for name, text in texts:
        try:
            types.add(name, text)
        except RosError as error:
            failures[name] = str(error)
    return _Loaded(types, failures)
