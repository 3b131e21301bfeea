"""Read a payload as a type of an interface file, believing nothing that it announces.

The type leads: a map is entered only where a map belongs, an element is read only while there are bytes for
it, and the first thing that does not fit ends the reading with its place.
"""

from __future__ import annotations

import base64
import math
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

import msgpack

from . import ast
from .wire_shape import TYPE_FIELD, Field, Part, fields_of, is_bytes

__all__ = ["Json", "PayloadError", "PayloadReader"]

Json = bool | int | float | str | None | list["Json"] | dict[str, "Json"]

_DEEPEST = 150  # each level takes four calls of Python's thousand
_MOST_VALUES = 1_000_000
_RANGES = {
    "byte": (0, 255),
    "short": (-(1 << 15), (1 << 15) - 1),
    "int": (-(1 << 31), (1 << 31) - 1),
    "long": (-(1 << 63), (1 << 63) - 1),
}
_PROXY = re.compile(r"[A-Za-z0-9_.\-]{1,128}(@[A-Za-z0-9_.\-]{1,128})?")
# As in Protobuf's JSON.
_NOT_FINITE = {"nan": "NaN", "inf": "Infinity", "-inf": "-Infinity"}
# The kind of a value by its first byte, each with the last byte that tells of it.
_KINDS = (
    (0x7F, "an integer"),
    (0x8F, "a map"),
    (0x9F, "an array"),
    (0xBF, "a string"),
    (0xC0, "nil"),
    (0xC1, "an invalid byte"),
    (0xC3, "a bool"),
    (0xC6, "bytes"),
    (0xC9, "an extension"),
    (0xCB, "a float"),
    (0xD3, "an integer"),
    (0xD8, "an extension"),
    (0xDB, "a string"),
    (0xDD, "an array"),
    (0xDF, "a map"),
    (0xFF, "an integer"),
)


class PayloadError(Exception):
    """A payload is not of the type that it is read as; the message begins with the place, as `$.a[3]`."""


class PayloadReader:
    """Reads one payload; `types` are the classes and exceptions that a value may be of, by scoped name.

    `ignored` are the places of members that the type does not have: a receiver leaves them out.
    """

    def __init__(self, payload: bytes, types: Mapping[str, ast.Definition]) -> None:
        self._payload = payload
        self._classes = {name: each for name, each in types.items() if isinstance(each, ast.Class)}
        self._exceptions = {name: each for name, each in types.items() if isinstance(each, ast.ExceptionType)}
        # Containers are opened here by their headers alone; inside of a single value none is allowed.
        self._unpacker = msgpack.Unpacker(
            max_buffer_size=max(1, len(payload)), max_array_len=0, max_map_len=0, max_ext_len=0
        )
        self._unpacker.feed(payload)
        self._path = ["$"]
        self._values = 0
        self.ignored: list[str] = []

    def read(self, definition: ast.Definition, part: Part = Part.RESULT) -> Json:
        """Return the payload as what JSON can hold: bytes in base64, enumerators by name, NaN as text.

        Raises PayloadError.
        """
        value = self._definition(definition, part)
        rest = len(self._payload) - self._unpacker.tell()
        if rest:
            raise self._error(f"{rest} bytes follow the value")
        return value

    # What stands at the present place

    def _error(self, message: str) -> PayloadError:
        return PayloadError(f"{''.join(self._path)}: {message}")

    def _kind(self) -> str:
        position = self._unpacker.tell()
        if position >= len(self._payload):
            raise self._error("the payload ends here")
        byte = self._payload[position]
        return next(kind for last, kind in _KINDS if byte <= last)

    def _expect(self, wanted: str, *also: str) -> None:
        """Refuse anything but a value of this kind."""
        kind = self._kind()
        if kind != wanted and kind not in also:
            raise self._error(f"expected {wanted}, found {kind}")
        self._values += 1
        if self._values > _MOST_VALUES:
            raise self._error(f"more than {_MOST_VALUES} values")

    def _unpack(self) -> bool | int | float | str | bytes | None:
        with self._readable():
            value: bool | int | float | str | bytes | None = self._unpacker.unpack()
            return value

    @contextmanager
    def _readable(self) -> Iterator[None]:
        try:
            yield
        except msgpack.OutOfData:
            raise self._error("the payload ends inside of this value") from None
        except UnicodeDecodeError:
            raise self._error("the text is not UTF-8") from None
        except msgpack.StackError:
            raise self._error("nested too deeply") from None
        except ValueError as error:
            raise self._error(f"malformed: {error}") from None

    def _header(self, wanted: str) -> int:
        self._expect(wanted)
        if len(self._path) > _DEEPEST:
            raise self._error("nested too deeply")
        with self._readable():
            read = self._unpacker.read_map_header if wanted == "a map" else self._unpacker.read_array_header
            return int(read())

    @contextmanager
    def _at(self, step: str) -> Iterator[None]:
        self._path.append(step)
        yield
        self._path.pop()

    # Values by their type

    def _type(self, kind: ast.Type) -> Json:
        match kind:
            case ast.BuiltinType(name="Object" | "Value"):
                return self._class(None)
            case ast.BuiltinType(name=name):
                return self._builtin(name)
            case ast.ProxyType():
                return self._proxy()
            case ast.NamedType(definition=ast.Definition() as definition):
                return self._definition(definition, Part.RESULT)
        raise self._error(f"`{kind.name}` is not defined in the files given")

    def _definition(self, definition: ast.Definition, part: Part) -> Json:
        match definition:
            case ast.Class():
                return self._class(definition)
            case ast.Interface() | ast.ForwardDeclaration():
                return self._class(None)
            case ast.ExceptionType():
                return self._exception(definition)
            case ast.Enumeration():
                return self._enumerator(definition)
            case ast.Sequence() if is_bytes(definition):
                self._expect("bytes")
                data = self._unpack()
                assert isinstance(data, bytes)
                return base64.b64encode(data).decode()
            case ast.Sequence():
                return self._sequence(definition)
            case ast.Dictionary():
                return self._dictionary(definition)
        fields = fields_of(definition, part)
        assert fields is not None, f"{definition.kind} does not travel"
        return self._map(fields)

    def _builtin(self, name: str) -> Json:
        match name:
            case "bool":
                self._expect("a bool")
            case "string":
                self._expect("a string")
            case "float" | "double":
                self._expect("a float", "an integer")
            case _:
                self._expect("an integer")
        value = self._unpack()
        if isinstance(value, bool | str):
            return value
        assert isinstance(value, int | float)
        if name in {"float", "double"}:
            number = float(value)
            return number if math.isfinite(number) else _NOT_FINITE[str(number)]
        low, high = _RANGES[name]
        if not low <= value <= high:
            raise self._error(f"{value} is out of the range of {name}, {low} to {high}")
        return value

    def _proxy(self) -> Json:
        self._expect("a string", "nil")
        text = self._unpack()
        if isinstance(text, str) and not _PROXY.fullmatch(text):
            raise self._error("the text is no proxy: an identity, perhaps with `@realm`")
        return text if isinstance(text, str) else None

    def _enumerator(self, enumeration: ast.Enumeration) -> Json:
        self._expect("an integer")
        value = self._unpack()
        for enumerator in enumeration.enumerators:
            if enumerator.value == value:
                return enumerator.name
        raise self._error(f"{value!r} is no value of {enumeration.scoped}")

    def _sequence(self, sequence: ast.Sequence) -> Json:
        items: list[Json] = []
        for index in range(self._header("an array")):
            with self._at(f"[{index}]"):
                items.append(self._type(sequence.element))
        return items

    def _dictionary(self, dictionary: ast.Dictionary) -> Json:
        items: dict[str, Json] = {}
        for index in range(self._header("a map")):
            with self._at(f".keys[{index}]"):
                key = self._type(dictionary.key)
            name = _key_text(key)
            with self._at(f"[{name[:60]}]"):
                items[name] = self._type(dictionary.value)
        return items

    def _map(self, fields: list[Field], count: int | None = None) -> dict[str, Json]:
        """Read the members of a map whose header says how many there are, unless it has been read."""
        members: dict[str, Json] = {}
        known = {field.name: field for field in fields}
        for _ in range(self._header("a map") if count is None else count):
            self._expect("a string")
            name = self._unpack()
            field = known.get(str(name))
            if field is None:
                self._ignore(str(name))
                continue
            with self._at(f".{field.name}"):
                if field.optional and self._kind() == "nil":
                    members[field.name] = None
                    self._unpack()
                else:
                    members[field.name] = self._type(field.type)
        for field in fields:
            if field.name not in members and not field.optional:
                raise self._error(f"`{field.name}` is missing")
        return {field.name: members[field.name] for field in fields if field.name in members}

    def _ignore(self, name: str) -> None:
        """Skip a member that the type does not have."""
        self.ignored.append(f"{''.join(self._path)}.{name[:60]}")
        with self._readable():
            self._unpacker.skip()

    def _class(self, expected: ast.Class | None) -> Json:
        if self._kind() == "nil":
            self._unpack()
            return None
        count = self._header("a map")
        if not count:
            raise self._error(f"`{TYPE_FIELD}` is missing")
        self._expect("a string")
        if self._unpack() != TYPE_FIELD:
            raise self._error(f"`{TYPE_FIELD}` must come first")
        with self._at(f".{TYPE_FIELD}"):
            self._expect("a string")
            announced = str(self._unpack())
            actual = next((self._classes[each] for each in announced.split() if each in self._classes), None)
            if expected is not None and (actual is None or expected not in (actual, *actual.ancestors())):
                raise self._error(f"`{announced[:120]}` is no {expected.scoped}")
        fields = fields_of(actual) if actual is not None else []
        return {TYPE_FIELD: announced, **self._map(fields or [], count - 1)}

    def _exception(self, expected: ast.ExceptionType) -> Json:
        count = self._header("a map")
        if not count:
            raise self._error("`exception` is missing")
        self._expect("a string")
        if self._unpack() != "exception":
            raise self._error("`exception` must come first")
        with self._at(".exception"):
            announced = self._text()
        bases: list[str] = []
        members: Json = None
        for _ in range(count - 1):
            name = self._text()
            if name == "bases" and members is None:
                with self._at(".bases"):
                    bases = [self._text() for _ in range(self._header("an array"))]
            elif name == "members" and members is None:
                fields = fields_of(self._nearest(announced, bases, expected)) or []
                with self._at(".members"):
                    members = self._map(fields)
            else:
                self._ignore(name)
        if members is None:
            members = self._map(fields_of(self._nearest(announced, bases, expected)) or [], 0)
        return {"exception": announced, **({"bases": [*bases]} if bases else {}), "members": members}

    def _nearest(self, announced: str, bases: list[str], expected: ast.ExceptionType) -> ast.ExceptionType:
        """Return the nearest exception that is known, of those that one says to be."""
        known = (self._exceptions[each] for each in (announced, *bases) if each in self._exceptions)
        nearest = next(known, None)
        if nearest is None or expected not in (nearest, *nearest.ancestors()):
            raise self._error(f"`{announced[:120]}` is no {expected.scoped}")
        return nearest

    def _text(self) -> str:
        self._expect("a string")
        return str(self._unpack())


def _key_text(key: Json) -> str:
    """Return the key of a dictionary as the text that JSON demands."""
    if isinstance(key, str):
        return key
    if isinstance(key, bool):
        return "true" if key else "false"
    if isinstance(key, dict):
        return "{" + ", ".join(f"{name}: {_key_text(value)}" for name, value in key.items()) + "}"
    return str(key)
