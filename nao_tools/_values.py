"""Convert JSON to the values of an interface, and these values to JSON."""

from __future__ import annotations

import base64
import binascii
import difflib
import json
import math
from collections.abc import Callable, Iterable, Mapping
from enum import IntEnum
from typing import Any, Final, TypeAlias

import msgspec

from nao_tools import NaoError
from nao_tools._dynamic import Types
from zenoh_ice import ObjectPrx, ZenohIceError
from zenoh_ice.data import typed
from zenoh_ice.data.reflection import Member, Schema, unscoped
from zenoh_ice.data.text import cut
from zenoh_ice.data.values import TYPE_FIELD, Value, type_id_of

Json: TypeAlias = bool | int | float | str | list["Json"] | dict[str, "Json"] | None

_ZEROS: Final[Mapping[str, object]] = {
    "bool": False,
    "string": "",
    **dict.fromkeys(("byte", "short", "int", "long"), 0),
    **dict.fromkeys(("float", "double"), 0.0),
}
"""The builtin types, each with the value for an omitted one."""
_MOST_MADE_UP: Final = 10_000  # structs; nested ones could exceed the memory
_LONGEST_SHOWN: Final = 60  # characters of a wrong value in an error


class FromJson:
    """Make values of an interface's types from JSON.

    Members of a struct that are not given are zero, empty or false, as in a new struct of Slice; `left_out`
    has their paths. Raises NaoError for a value that does not fit, with its place and the expected
    type.
    """

    def __init__(self, schema: Schema, types: Types, proxy_of: Callable[[str], ObjectPrx]) -> None:
        self._schema: Final = schema
        self._types: Final = types
        self._proxy_of: Final = proxy_of
        self.left_out: Final[list[str]] = []
        self._made_up = 0

    def member(self, member: Member, value: Any, path: str) -> object:  # noqa: ANN401 - whatever JSON holds
        """Return the value of a member or a parameter for a JSON value."""
        return None if member.optional and value is None else self.make(member.type, value, path)

    def make(self, kind: str, value: Any, path: str) -> object:  # noqa: ANN401
        """Return the value of a type for a JSON value."""
        if kind in _ZEROS:
            try:
                return typed.convert(value, self._types.of(kind))
            except msgspec.ValidationError as error:
                raise self._wrong(kind, value, path, f": {error}") from None
        if kind.endswith("*"):
            return None if value is None else self._proxy(value, path)
        match self._schema.kind(kind):
            case "sequence":
                return self._sequence(kind, value, path)
            case "dictionary":
                return self._dictionary(kind, value, path)
            case "enumeration":
                return self._enumerator(kind, value, path)
            case "struct" if isinstance(value, dict):
                return self._filled(self._types.of(kind), kind, value, path)
            case "struct":
                raise self._wrong(kind, value, path, ", a JSON object with its members")
        # Object, Value, or an interface by value are any class.
        return None if value is None else self._class(kind, value, path)

    def zero(self, kind: str) -> object:
        """Return the value of a type when none was given."""
        empty: object
        match self._schema.kind(kind):
            case "sequence":
                empty = []
            case "dictionary" | "struct":
                empty = {}
            case "enumeration":  # the first, unless the IDL numbers them otherwise
                empty = min((each.value for each in self._schema.definitions[kind].enumerators), default=None)
            case _:
                empty = _ZEROS.get(kind)
        return self.make(kind, empty, "")

    def _filled(self, struct: type[Any], type_id: str, value: Mapping[str, Any], path: str) -> object:
        """Return a struct or an object of a class for a JSON object of its members.

        Without a path, the whole struct was left out.
        """
        self._made_up += not path
        if self._made_up > _MOST_MADE_UP:
            raise NaoError(f"{type_id} has too many members to leave any out")
        known = {member.name: member for member in self._schema.members(type_id)}
        for name in value:
            if name not in known:
                near = difflib.get_close_matches(name, known, 1, 0.5)
                hint = f"; did you mean {near[0]}?" if near else f"; it has {', '.join(known) or 'none'}"
                raise NaoError(f"{path}: a {unscoped(type_id)} has no member {name!r}{hint}")
        made = {}
        for wire, name in _names(struct):
            member, where = known[wire], f"{path}.{wire}"
            if wire in value or member.optional:
                made[name] = self.member(member, value.get(wire), where)
                continue
            made[name] = self.zero(member.type)
            if path:
                self.left_out.append(where)
        return struct(**made)

    def _enumerator(self, type_id: str, value: Any, path: str) -> IntEnum:  # noqa: ANN401
        enumeration: type[IntEnum] = self._types.of(type_id)
        by_name = {each.name: each for each in enumeration}
        if isinstance(value, str) and unscoped(value) in by_name:
            return by_name[unscoped(value)]
        if isinstance(value, int) and not isinstance(value, bool) and value in by_name.values():
            return enumeration(value)
        raise NaoError(
            f"{path}: {_shown(value)} is not {unscoped(type_id)}: write one of {', '.join(by_name)}"
        )

    def _class(self, kind: str, value: object, path: str) -> object:
        if not isinstance(value, dict):
            raise NaoError(f"{path}: {_shown(value)} is not a class: write null or a JSON object")
        members = dict(value)
        wanted = str(members.pop(TYPE_FIELD, kind))
        try:
            made = self._types.class_of(wanted)
        except KeyError:
            raise NaoError(
                f"{path}: give the type of the class under {TYPE_FIELD!r}, such as '::module::Class'"
            ) from None
        if self._schema.kind(kind) == "class" and kind not in self._schema.lineage(wanted):
            raise NaoError(f"{path}: {wanted} is not {unscoped(kind)}")
        return self._filled(made, wanted, members, path)

    def _sequence(self, kind: str, value: Any, path: str) -> object:  # noqa: ANN401
        if is_bytes(self._schema, kind):
            return _bytes(value, path)
        if not isinstance(value, list):
            raise self._wrong(kind, value, path)
        element = self._schema.definitions[kind].element
        return [self.make(element, item, f"{path}[{index}]") for index, item in enumerate(value)]

    def _dictionary(self, kind: str, value: Any, path: str) -> object:  # noqa: ANN401
        definition = self._schema.definitions[kind]
        if isinstance(value, dict):
            items: list[Any] = [[_key(definition.key, text), item] for text, item in value.items()]
        elif isinstance(value, list) and all(isinstance(pair, list) and len(pair) == 2 for pair in value):
            items = value  # pairs: keys may be structs
        else:
            raise self._wrong(kind, value, path)
        keys = [self.make(definition.key, key, f"{path}: key") for key, _ in items]
        values = [self.make(definition.value, item, f"{path}[{_shown(key)}]") for key, item in items]
        return dict(zip(keys, values, strict=True))

    def _proxy(self, value: Any, path: str) -> ObjectPrx:  # noqa: ANN401
        if not isinstance(value, str):
            raise NaoError(
                f'{path}: {_shown(value)} is not a proxy: write an identity such as "Head", or null'
            )
        try:
            return self._proxy_of(value)
        except ZenohIceError as error:
            raise NaoError(f"{path}: {error}") from error

    def _wrong(self, kind: str, value: object, path: str, more: str = "") -> NaoError:
        wanted = self._schema.type_text(kind, scoped=False)
        return NaoError(f"{path}: {_shown(value)} is not {wanted}{more}")


def is_bytes(schema: Schema, kind: str) -> bool:
    """Return whether a type is a sequence of bytes, which is not a list in Python."""
    return schema.kind(kind) == "sequence" and schema.definitions[kind].element == "byte"


def to_json(value: object, of_bytes: Callable[[bytes], Json] | None = None) -> Json:
    """Return a value as JSON.

    Enumerators become their names, bytes base64, numbers that JSON lacks null. With `of_bytes`, another
    conversion of bytes, the value is for people, and such numbers stay.
    """
    match value:
        case IntEnum():
            return value.name
        case float() if not math.isfinite(value) and of_bytes is None:
            return None
        case None | bool() | int() | float() | str():
            return value
        case bytes():
            return of_bytes(value) if of_bytes else base64.b64encode(value).decode("ascii")
        case list() | tuple():
            return [to_json(item, of_bytes) for item in value]
        case dict():
            if all(isinstance(key, str | int) for key in value):
                return {_key_text(key): to_json(item, of_bytes) for key, item in value.items()}
            return [[to_json(key, of_bytes), to_json(item, of_bytes)] for key, item in value.items()]
        case msgspec.Struct():
            kind: dict[str, Json] = {TYPE_FIELD: type_id_of(type(value))} if isinstance(value, Value) else {}
            return kind | {
                wire: to_json(getattr(value, name), of_bytes) for wire, name in _names(type(value))
            }
        case ObjectPrx():
            return value.ice_toString()
    return str(value)


def _names(struct: type[msgspec.Struct]) -> Iterable[tuple[str, str]]:
    """Yield the name on the wire and in Python of each member."""
    return zip(struct.__struct_encode_fields__, struct.__struct_fields__, strict=True)


def _key_text(key: object) -> str:
    if isinstance(key, IntEnum):
        return key.name
    return str(key).lower() if isinstance(key, bool) else str(key)


def _key(kind: str, text: str) -> object:
    """Return a key of a dictionary, which JSON always has as a text."""
    if kind == "string":
        return text
    try:
        return json.loads(text)
    except ValueError:
        return text


def _bytes(value: Any, path: str) -> bytes:  # noqa: ANN401
    try:
        if isinstance(value, bytes | list):
            return bytes(value)
        return base64.b64decode(value, validate=True)
    except (TypeError, ValueError, binascii.Error) as error:
        text = f"{path}: {_shown(value)} are not bytes: write base64, a list of numbers, or @FILE"
        raise NaoError(text) from error


def _shown(value: object) -> str:
    return cut(json.dumps(value, ensure_ascii=False, default=str), _LONGEST_SHOWN)
