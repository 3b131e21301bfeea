"""Messages, services and actions by their ROS names: values, checks, CDR and type hashes.

`rosbags` knows the messages of each distribution, and reads and writes CDR; the parts of services and actions
are built here according to the design of rosidl (design.ros2.org, articles 200 to 230).
"""

from __future__ import annotations

import difflib
import logging
import os
import re
import struct
import threading
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, Final, Literal, cast

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, TypesysError, get_types_from_msg, get_typestore

from zenoh_ice.data.text import encodable

from ._codec import MISFITS, Codec, codec_of_humble, needed_by
from ._exact import ARRAYS, ZEROS, Check, exact
from .exceptions import DefinitionError, MessageError, TypeUnknownError

Kind = Literal["msg", "srv", "action"]

DISTRIBUTIONS: Final = {
    "humble": Stores.ROS2_JAZZY,
    "iron": Stores.ROS2_IRON,
    "jazzy": Stores.ROS2_JAZZY,
    "kilted": Stores.ROS2_KILTED,
    "lyrical": Stores.ROS2_LYRICAL,
    "rolling": Stores.ROS2_LYRICAL,
}
"""Distributions of ROS 2 for which rmw_zenoh was released, and whose messages rosbags has.

Humble has no type hashes. Its nodes are served beside those of any other, whose hashes a node needs to know.
Rolling has the newest messages.
"""
_NEWEST: Final = "lyrical"
_OF_ROS_1: Final = ("melodic", "noetic")
"""Later in the alphabet, by which distributions are named, but older."""

_LARGEST_DEFINITION: Final = 1 << 18  # characters

_NAME: Final = re.compile(r"([a-z][a-z0-9_]*)/(msg|srv|action)/([A-Za-z][A-Za-z0-9_]*)")
_PARTS: Final = "Request|Response|Event|Goal|Result|Feedback|FeedbackMessage|SendGoal|GetResult"
_PART: Final = re.compile(rf"_({_PARTS})(_.*)?$")
_DEFAULTS: Final = {("geometry_msgs/msg/Quaternion", "w"): 1.0}
"""Default values that definitions have, but rosbags lacks."""
_PLACEHOLDER: Final = "structure_needs_at_least_one_member"  # the member of an empty struct in IDL
_INTEGERS: Final = {
    name: (int(np.iinfo(name).min), int(np.iinfo(name).max))
    for name in ("int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64")
} | {"byte": (-128, 127)}  # as in rosbags
_REALS: Final = (int, float, np.integer, np.floating)

_UUID: Final = "unique_identifier_msgs/UUID goal_id\n"

_logger = logging.getLogger(__name__)


class Types:
    """The types of one distribution, and added ones.

    `types["geometry_msgs/msg/Twist"]` is the dataclass of its messages. Services have the parts `_Request`
    and `_Response`, actions `_Goal`, `_Result` and `_Feedback`: `types["std_srvs/srv/Trigger_Request"]`.
    """

    def __init__(self, distribution: str | None = None) -> None:
        """Load the types of a distribution, by default that of ROS_DISTRO, or else jazzy.

        For one that is newer than those known, it warns and takes the newest messages.
        """
        name = (distribution or os.environ.get("ROS_DISTRO") or "jazzy").lower()
        if name not in DISTRIBUTIONS:
            if not name.isalpha() or name < _NEWEST or name in _OF_ROS_1:
                raise TypeUnknownError(f"{name!r}: the distributions are {', '.join(DISTRIBUTIONS)}")
            _logger.warning("the distribution %s of ROS is not known: messages are as in %s", name, _NEWEST)
            name = _NEWEST
        self.distribution: Final = name
        self._store: Final = get_typestore(DISTRIBUTIONS[name])
        for each, (constants, fields) in self._store.fielddefs.items():
            if "'char'" in str(fields):
                self._store.fielddefs[each] = constants, [(field, _plain(kind)) for field, kind in fields]
        self._codec: Final = Codec(self._store)
        self._humble: dict[str, Codec] = {}
        self._checks: dict[str, Check] = {}
        self._interfaces: dict[str, Kind] = dict.fromkeys(self._store.types, "msg")
        self._hashes: dict[str, str] = {}
        self._reading: Final = threading.RLock()
        self._waiting = {
            each: path for path in _definitions() if (each := _name_of(path)) not in self._interfaces
        }

    def __getitem__(self, name: str) -> type[Any]:
        """Return the class of a message, or of a part of a service or an action."""
        self._require(name)
        return cast("type[Any]", self._store.types[name])

    def __contains__(self, name: str) -> bool:
        """Return whether a message, service, action or part of one is known."""
        return self._find(name)

    def names(self, kind: Kind = "msg") -> list[str]:
        """Return the sorted names of all messages, services or actions, without their parts."""
        known = {name for name, each in self._interfaces.items() if each == kind}
        return sorted(known | {name for name in self._waiting if f"/{kind}/" in name})

    def fields(self, name: str) -> dict[str, str]:
        """Return the type of each field, as a .msg file writes it."""
        self._require(name)
        return {field: _written(kind) for field, kind in self._fields(name)}

    # Definitions

    def add(self, name: str, text: str) -> None:
        """Add a message (`pkg/msg/Name`), service or action by the text of its .msg, .srv or .action file.

        Raises DefinitionError for a malformed text, and for a type already known with another definition.
        """
        match = _NAME.fullmatch(name)
        if match is None:
            raise DefinitionError(
                f"{name!r}: write PACKAGE/msg/NAME, PACKAGE/srv/NAME or PACKAGE/action/NAME"
            )
        if len(text) > _LARGEST_DEFINITION:
            raise DefinitionError(f"{name}: a definition has at most {_LARGEST_DEFINITION} characters")
        kind = cast("Kind", match[2])
        parts = re.split(r"^---[ \t]*(?:#.*)?$", text, flags=re.MULTILINE)
        wanted = {"msg": 1, "srv": 2, "action": 3}[kind]
        if len(parts) != wanted:
            raise DefinitionError(
                f"{name}: {wanted} parts divided by lines of '---' are needed, not {len(parts)}"
            )
        definitions: dict[str, Any] = {}
        if kind == "msg":
            definitions |= _parse(name, parts[0])
        elif kind == "srv":
            definitions |= _service(name, *parts)
        else:
            goal, result, feedback = (f"{name}_{part}" for part in ("Goal", "Result", "Feedback"))
            for part, content in zip((goal, result, feedback), parts, strict=True):
                definitions |= _parse(part, content)
            send = f"{_UUID}{goal} goal\n", "bool accepted\nbuiltin_interfaces/Time stamp\n"
            definitions |= _service(f"{name}_SendGoal", *send)
            definitions |= _service(f"{name}_GetResult", _UUID, f"int8 status\n{result} result\n")
            definitions |= _parse(f"{name}_FeedbackMessage", f"{_UUID}{feedback} feedback\n")
        own: set[str] = set()
        for each, (_, fields) in definitions.items():  # a part needs only earlier ones
            for needed in needed_by(fields):
                if needed not in own and (needed in definitions or not self._find(needed)):
                    raise DefinitionError(f"{each}: it needs {needed}, which is not known")
            own.add(each)
        try:
            self._store.register(definitions)
        except TypesysError as error:
            raise DefinitionError(f"{name}: {error}") from error
        self._interfaces[name] = kind
        self._waiting.pop(name, None)

    def load(self, path: Path) -> list[str]:
        """Add the types of a .msg, .srv or .action file, or of all in a folder; return their names.

        Folders name the package and the kind: `my_msgs/msg/Ball.msg`. Raises
        DefinitionError.
        """
        paths = sorted(each for each in path.rglob("*") if _is_definition(each)) if path.is_dir() else [path]
        found = {_name_of(each.absolute()): each for each in paths}
        self._waiting |= found  # one may need another
        for name, each in found.items():
            if self._waiting.pop(name, None) is not None:
                self.add(name, _read(each))
        return [*found]

    def hash(self, name: str) -> str:
        """Return the type hash of a message, a service or a part, as in keys (REP 2016)."""
        if name not in self._hashes:
            self._require(name)
            self._hashes[name] = self._store.hash_rihs01(name)
        return self._hashes[name]

    # Values

    def make(self, name: str, fields: Mapping[str, object] | None = None, /, **named: object) -> Any:  # noqa: ANN401
        """Return a message with some fields; the others are zero, empty or False.

        A quaternion that is not given is the identity: its `w` is 1. Nested messages may be given as
        mappings, arrays as any sequence. Raises MessageError, which names the field, for a wrong value.
        """
        self._require(name)
        return self._make(name, {**(fields or {}), **named}, name)

    def coerce(self, name: str, value: object, /, **named: object) -> Any:  # noqa: ANN401
        """Return a message of this type: the value itself if it is one, else one with its fields."""
        if value is None or isinstance(value, Mapping):
            return self.make(name, value, **named)
        if named:
            raise MessageError(f"{name}: give a message or fields, not both")
        if getattr(value, "__msgtype__", None) != name:
            raise MessageError(f"{name}: this is a {getattr(value, '__msgtype__', type(value).__name__)}")
        return value

    def encode(self, message: Any, *, humble: bool = False) -> bytes:  # noqa: ANN401
        """Return a message as CDR, or as that of Humble; raises MessageError for values that do not fit."""
        buffer = bytearray()
        self.encode_into(buffer, message, humble=humble)
        return bytes(buffer)

    def encode_into(self, buffer: bytearray, message: Any, *, humble: bool = False) -> None:  # noqa: ANN401
        """Write a message as CDR into a buffer, whose length becomes that of the message.

        A large message of the same length as the one before takes no new memory, which costs more time than
        the copy; its padding may then have any bytes. Raises MessageError for values that do not fit, also
        for those that were assigned to the message.
        """
        name = message.__msgtype__
        codec = self._codec_for(name, humble=humble)
        if name not in self._checks:
            self._checks[name] = exact(name, self._store)
        try:
            if self._checks[name](message):
                codec.write(buffer, message, name)
                return
        except MISFITS:  # also a field that was deleted
            pass
        codec.write(buffer, self._make(name, message, name), name)

    def largest(self, name: str) -> int:
        """Return the maximum bytes of a message: exactly, if each of its members has a fixed size."""
        return self._codec_for(name).largest(name)

    def decode(self, data: bytes | memoryview, name: str, *, humble: bool = False) -> Any:  # noqa: ANN401
        """Return the message in CDR, with arrays as views of it; fields that Humble lacks are zero.

        Raises MessageError if it is malformed, too large, or has too many elements.
        """
        message = self._codec_for(name, humble=humble).read(data, name)
        return self._make(name, message, name) if humble and self.differs(name) else message

    def differs(self, name: str) -> bool:
        """Return whether nodes of Humble write a message with fewer fields."""
        return self._codec_for(name, humble=True) is not self._codec

    def _codec_for(self, name: str, *, humble: bool = False) -> Codec:
        self._require(name)
        if not humble:
            return self._codec
        if name not in self._humble:
            self._humble[name] = codec_of_humble(self._store.fielddefs, name) or self._codec
        return self._humble[name]

    def _make(self, name: str, given: object, path: str) -> Any:  # noqa: ANN401
        own = dict(self._store.fielddefs[name][1])
        if not isinstance(given, Mapping):
            found = getattr(given, "__msgtype__", type(given).__name__)
            if found != name:
                raise MessageError(f"{path}: a {name} is expected, not {found}")
            cls: Any = self._store.types[name]
            fields = dict(zip(cls.__match_args__, own, strict=False))  # `from` is the attribute `from_`
            if type(given) is cls:  # also what was assigned by a name that no field has
                found_values = [each for each in [*vars(given).items()] if not hasattr(cls, each[0])]
                given = {fields.get(each, each): value for each, value in found_values}
            else:
                given = {fields[each]: getattr(given, each) for each in fields if hasattr(given, each)}
        for field in given:
            if field not in own:
                near = difflib.get_close_matches(str(field), own, 1)
                hint = f"; do you mean {near[0]}?" if near else f"; there are {', '.join(own)}"
                raise MessageError(f"{path}: there is no field {field!r}{hint}")
        values = [
            self._value(kind, given[field], f"{path}.{field}")
            if field in given
            else _DEFAULTS.get((name, field), self._zero(kind))
            for field, kind in own.items()
        ]
        return self._store.types[name](*values)

    def _value(self, kind: Any, given: Any, path: str) -> Any:  # noqa: ANN401
        node, detail = kind
        if node == Nodetype.BASE:
            return _scalar(detail, given, path)
        if node == Nodetype.NAME:
            return self._make(detail, given, path)
        element, count = detail
        if isinstance(given, memoryview):
            given = np.asarray(given)
        is_sequence = isinstance(given, Sequence) and not isinstance(given, str)
        if not is_sequence and not (isinstance(given, np.ndarray) and given.ndim):
            raise MessageError(f"{path}: a sequence is expected, not {type(given).__name__}")
        if (node == Nodetype.ARRAY and len(given) != count) or 0 < count < len(given):
            most = "exactly" if node == Nodetype.ARRAY else "at most"
            raise MessageError(f"{path}: {most} {count} elements are expected, not {len(given)}")
        if element[0] == Nodetype.BASE and element[1][0] != "string":
            return _numbers(element[1][0], given, path)
        return [self._value(element, each, f"{path}[{index}]") for index, each in enumerate(given)]

    def _zero(self, kind: Any) -> Any:  # noqa: ANN401
        node, detail = kind
        if node == Nodetype.BASE:
            return ZEROS.get(detail[0], 0)
        if node == Nodetype.NAME:
            return self._make(detail, {}, detail)
        element, count = detail
        length = count if node == Nodetype.ARRAY else 0
        if element[0] == Nodetype.BASE and element[1][0] != "string":
            return np.zeros(length, ARRAYS.get(element[1][0], element[1][0]))
        return [self._zero(element) for _ in range(length)]

    # Known types

    def _fields(self, name: str) -> Iterator[tuple[str, Any]]:
        return ((field, kind) for field, kind in self._store.fielddefs[name][1] if field != _PLACEHOLDER)

    def _find(self, name: str) -> bool:
        """Return whether a type is known; read its definition if that waits."""
        if name in self._store.types:
            return True
        with self._reading:  # another thread may be reading it
            path = self._waiting.pop(name, None) or self._waiting.pop(_PART.sub("", name), None)
            if path is not None:
                self.add(_name_of(path), _read(path))
            return name in self._store.types or name in self._interfaces

    def _require(self, name: str) -> None:
        if self._find(name):
            return
        near = difflib.get_close_matches(
            name, [*self.names("msg"), *self.names("srv"), *self.names("action")], 1
        )
        hint = f"; do you mean {near[0]}?" if near else "; add its .msg, .srv or .action text"
        raise TypeUnknownError(f"no type {name!r} is known{hint}")


def _parse(name: str, text: str) -> dict[str, Any]:
    """Return the definition of one message, or of a part, in rosbags' form."""
    package, kind, short = name.split("/")
    qualified = re.sub(rf"^(\s*){package}/{kind}/", r"\1", text, flags=re.MULTILINE)
    try:
        parsed = get_types_from_msg(f"{qualified.strip()}\n", f"{package}/msg/{short}")
    except (TypesysError, AssertionError, ValueError, RecursionError) as error:
        raise DefinitionError(f"{name}: {error}") from error
    constants, fields = parsed[f"{package}/msg/{short}"]
    if kind != "msg":
        # rosbags treats a bare name as a message of the package, but it may be a part from the same file.
        own = f"{package}/msg/{short.partition('_')[0]}_"
        fields = [(field, _moved(each, own, f"{package}/{kind}/")) for field, each in fields]
    fields = [(field, _plain(each)) for field, each in fields]
    return {name: (constants, fields or [(_PLACEHOLDER, (Nodetype.BASE, ("uint8", 0)))])}


def _plain(kind: Any) -> Any:  # noqa: ANN401
    """Return a field's type with uint8 for char, as in rosidl and its type hashes."""
    node, detail = kind
    if node == Nodetype.BASE:
        return (node, ("uint8", detail[1])) if detail[0] == "char" else kind
    return kind if node == Nodetype.NAME else (node, (_plain(detail[0]), detail[1]))


def _moved(kind: Any, own: str, folder: str) -> Any:  # noqa: ANN401
    node, detail = kind
    if node == Nodetype.NAME and detail.startswith(own):
        return node, folder + detail.rpartition("/")[2]
    return kind


def _service(name: str, request: str, response: str) -> dict[str, Any]:
    """Return the definitions of a service: its parts, the event of its introspection, and itself."""
    parts = {part: f"{name}_{part}" for part in ("Request", "Response", "Event")}
    named = {part: (Nodetype.NAME, each) for part, each in parts.items()}
    event = [
        ("info", (Nodetype.NAME, "service_msgs/msg/ServiceEventInfo")),
        ("request", (Nodetype.SEQUENCE, (named["Request"], 1))),
        ("response", (Nodetype.SEQUENCE, (named["Response"], 1))),
    ]
    whole = [(f"{part.lower()}_message", named[part]) for part in parts]
    return {
        **_parse(parts["Request"], request),
        **_parse(parts["Response"], response),
        parts["Event"]: ([], event),
        name: ([], whole),
    }


def _written(kind: Any) -> str:  # noqa: ANN401
    node, detail = kind
    if node == Nodetype.BASE:
        return f"{detail[0]}<={detail[1]}" if detail[1] else str(detail[0])
    if node == Nodetype.NAME:
        return str(detail)
    element, count = detail
    if node == Nodetype.ARRAY:
        return f"{_written(element)}[{count}]"
    return f"{_written(element)}[<={count}]" if count else f"{_written(element)}[]"


def _scalar(detail: tuple[str, int], given: Any, path: str) -> object:  # noqa: ANN401
    name, limit = detail
    least, most = _INTEGERS.get(name, (0, 0))
    if name == "string":
        what, fits = "text in UTF-8 without zero characters", isinstance(given, str) and "\0" not in given
        fits = fits and (given.isascii() or given == encodable(given))
    elif name == "bool":
        what, fits = "True or False", isinstance(given, bool | np.bool_)
    elif name in _INTEGERS:
        what, fits = f"a whole number from {least} to {most}", isinstance(given, int | np.integer)
        fits = fits and not isinstance(given, bool) and least <= given <= most
    else:
        what, fits = "a number", isinstance(given, _REALS) and not isinstance(given, bool)
    if not fits:
        raise MessageError(f"{path}: {what} is expected, not {given!r:.60}")
    if limit and len(given.encode()) > limit:
        raise MessageError(f"{path}: at most {limit} bytes are expected")
    try:
        value = type(ZEROS.get(name, 0))(given)
        if name == "float32":
            struct.pack("<f", value)
        return value
    except OverflowError as error:
        raise MessageError(f"{path}: {error}") from error


def _numbers(name: str, given: Any, path: str) -> np.ndarray[Any, Any]:  # noqa: ANN401
    wanted = np.dtype(ARRAYS.get(name, name))
    if isinstance(given, bytes | bytearray):
        given = np.frombuffer(given, np.uint8)
    try:
        array = np.asarray(given)
        if not array.size:  # of whatever type
            array = np.zeros(array.shape, wanted)
        fits = np.can_cast(array.dtype, wanted, "same_kind")
        if name in _INTEGERS and array.dtype != wanted and array.dtype.kind in "biu":
            least, most = _INTEGERS[name]
            fits = least <= array.min() and array.max() <= most
        if fits and array.ndim == 1 and not np.ma.is_masked(given):
            with np.errstate(over="raise"):
                return np.ascontiguousarray(array, wanted)  # the codec takes no others
    except (TypeError, ValueError, ArithmeticError):
        pass
    raise MessageError(f"{path}: a sequence of {name} is expected, not {given!r:.60}")


def _read(path: Path) -> str:
    try:
        return path.read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise DefinitionError(f"{path}: {error}") from error


def _is_definition(path: Path) -> bool:
    return path.suffix in (".msg", ".srv", ".action") and path.parent.name == path.suffix[1:]


def _name_of(path: Path) -> str:
    return f"{path.parent.parent.name}/{path.suffix[1:]}/{path.stem}"


@cache
def _definitions() -> tuple[Path, ...]:
    """Return the files of the types in this package, which rosbags lacks."""
    folder = Path(str(resources.files("zenoh_ros2") / "definitions"))
    return tuple(sorted(each for each in folder.rglob("*") if _is_definition(each)))
