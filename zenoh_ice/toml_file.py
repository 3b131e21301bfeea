"""Read TOML into typed values; an error names the file, the line, the key and its value, and what to write.

    class Ball(Struct, frozen=True, forbid_unknown_fields=True):
        radius: Annotated[float, Meta(gt=0.0, description="write a radius in m, above 0")]

    ball = read_toml(Path("ball.toml"), Ball, BallError)

The `description` of a type's `Meta` is what the user reads after a bad value: `ball.toml:1: radius = -1.0:
write a radius in m, above 0`.
"""

from __future__ import annotations

import enum
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Final, Literal, TypeVar, Union, get_args, get_origin

import msgspec

from .text import cut

__all__ = ["LARGEST_FILE", "convert", "parse_toml", "place", "read_text", "read_toml", "shown"]

LARGEST_FILE: Final = 1 << 20
"""The most bytes that are read of a file."""

_LONGEST_SHOWN: Final = 200  # characters of a value, in an error
_LONGEST_MESSAGE: Final = 1000
_ABOUT_VALUE: Final = ("Expected", "Invalid", "Number")  # how msgspec begins what it says of a value
_EXPECTED: Final = re.compile(r"Expected `(\w+)(?: \| null)?`, got ")
_WORDS: Final = {
    "bool": "true or false",
    "int": "a whole number",
    "float": "a number",
    "str": "text",
    "array": "a list",
    "object": "a table",
}

_T = TypeVar("_T")
_Error = Callable[[str], Exception]
_Path = tuple[str | int, ...]


def read_text(path: Path, error: _Error) -> str:
    """Return the text of a file; raises `error` for one that cannot be read, is too large or not UTF-8."""
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
    except (OSError, ValueError) as problem:  # ValueError: the path has a null byte
        raise error(f"{path}: cannot be read: {problem.args[-1]}") from problem
    if len(content) > LARGEST_FILE:
        raise error(f"{path}: larger than {LARGEST_FILE} bytes")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as problem:
        line = content.count(b"\n", 0, problem.start) + 1
        raise error(f"{path}:{line}: not UTF-8 text: {problem.reason}") from problem


def read_toml(path: Path, kind: type[_T], error: _Error) -> _T:
    """Return what a file holds as a value of type `kind`; raises `error`."""
    return parse_toml(read_text(path, error), kind, str(path), error)


def parse_toml(text: str, kind: type[_T], source: str, error: _Error) -> _T:
    """Return what a text holds as a value of type `kind`; `source` is its file, for the `error` raised."""
    try:
        document = tomllib.loads(text)
    except (ValueError, RecursionError) as problem:  # ValueError: the syntax, or the length of a number
        why = "nested too deeply" if isinstance(problem, RecursionError) else problem
        raise error(f"{source}: not TOML: {why}") from problem
    return convert(document, kind, source, error, text=text)


def convert(
    value: object,
    kind: type[_T],
    source: str,
    error: _Error,
    *,
    path: _Path = (),
    text: str = "",
    strict: bool = True,
) -> _T:
    """Return a value as one of type `kind`.

    Raises `error` that names `source`, where the value came from, and the key; `path` is that of the value,
    and with the `text` of the file the line is named, too. Without `strict` a text may stand for a number.
    """
    try:
        return msgspec.convert(value, kind, strict=strict)
    except msgspec.ValidationError as problem:
        where, why = _fault(value, kind, path, strict=strict) or (path, f": {problem}")
        raise error(f"{place(source, text, *where)}{cut(why, _LONGEST_MESSAGE)}") from None


def place(source: str, text: str, *path: str | int) -> str:
    """Return where a value stands, as errors begin: `FILE:LINE: key[0].key`.

    `path` holds keys of tables and numbers in arrays; the line is that of the last of them that has one.
    """
    name = ".".join(f"[{key}]" if isinstance(key, int) else key for key in path).replace(".[", "[")
    line = _line(text, path)
    return f"{source}{f':{line}' if line else ''}{f': {cut(name, _LONGEST_SHOWN)}' if name else ''}"


def shown(value: object) -> str:
    """Return a value as a user reads it, cut if it is long."""
    if isinstance(value, bool):
        return str(value).lower()
    try:
        return cut(repr(list(value) if isinstance(value, tuple) else value), _LONGEST_SHOWN)
    except ValueError:  # Python refuses to write the longest numbers
        return "a number of thousands of digits"


def _fault(value: Any, kind: Any, path: _Path, *, strict: bool) -> tuple[_Path, str] | None:  # noqa: ANN401
    """Return the path of the innermost value that does not fit its type, and what follows it in an error."""
    try:
        msgspec.convert(value, kind, strict=strict)
    except msgspec.ValidationError as error:
        problem = str(error)
    else:
        return None
    plain, remedy = _plain(kind)
    for key, item, item_kind in _items(value, plain):
        if fault := _fault(item, item_kind, (*path, key), strict=strict):
            return fault
    if problem.startswith("Object contains unknown field"):
        names = plain.__struct_encode_fields__
        unknown = next(key for key in value if key not in names)
        return (*path, unknown), f": there is no such key; there is {', '.join(names)}"
    if problem.startswith("Object missing required field"):
        return path, f": {problem.split('`')[1]} is missing"
    if not problem.startswith(_ABOUT_VALUE):  # it comes from a check in the program
        return path, f": {problem}"
    if not remedy and (expected := _EXPECTED.match(problem)) and expected[1] in _WORDS:
        remedy = f"write {_WORDS[expected[1]]}"
    return path, f" = {shown(value)}: {remedy or problem}"


def _items(value: Any, kind: Any) -> Iterable[tuple[str | int, Any, Any]]:  # noqa: ANN401
    """Return what a value holds that fits the kind of its type: keys, items, and the types of these."""
    kinds = get_args(kind)
    if isinstance(value, Mapping) and get_origin(kind) is dict:
        return [(key, each, of) for key in value for each, of in zip((key, value[key]), kinds, strict=True)]
    if isinstance(value, Mapping) and isinstance(kind, type(msgspec.Struct)):
        fields = {field.encode_name: field.type for field in msgspec.structs.fields(kind)}
        return [(key, value[key], fields[key]) for key in value if key in fields]
    if isinstance(value, list | tuple) and get_origin(kind) in (list, tuple):
        fixed = get_origin(kind) is tuple and kinds[-1] is not ...
        return zip(range(len(value)), value, kinds if fixed else kinds[:1] * len(value), strict=False)
    return ()


def _plain(kind: Any) -> tuple[Any, str]:  # noqa: ANN401
    """Return a type without its constraints and without None, and what to write for it."""
    remedy = ""
    while get_origin(kind) in (Annotated, Union, UnionType):
        if get_origin(kind) is Annotated:
            kind, *rest = get_args(kind)
            found = (item.description for item in rest if isinstance(item, msgspec.Meta) and item.description)
            remedy = remedy or next(found, "")
        else:
            kind = next(member for member in get_args(kind) if member is not NoneType)
    words = get_args(kind) if get_origin(kind) is Literal else ()
    if isinstance(kind, enum.EnumType):
        words = tuple(str(member.value) for member in list[enum.Enum](kind))
    return kind, remedy or (f"write one of {', '.join(map(str, words))}" if words else "")


def _line(text: str, path: Sequence[str | int]) -> int:
    """Return the number of the line of a key, or else of the nearest table around it; 0 without either."""
    end, table = 0, ""
    for key in path:
        if isinstance(key, int):
            for _ in range(key):
                if header := re.compile(rf"^\s*\[\[\s*{table}\s*\]", re.MULTILINE).search(text, end):
                    end = header.end()
            continue
        name = rf"[\"']?{re.escape(key)}[\"']?"
        table += rf"\s*\.\s*{name}" if table else name
        if inside := re.compile(rf"(?!\s*\[)(?:.*\n(?!\s*\[))*?\s*{name}\s*=").match(text, end):
            end = inside.end()
            break
        begin = text.rfind("\n", 0, end) + 1
        if header := re.compile(rf"^\s*\[\[?\s*{table}\s*[\].]", re.MULTILINE).search(text, begin):
            end = header.end()
    return text.count("\n", 0, end) + 1 if end else 0
