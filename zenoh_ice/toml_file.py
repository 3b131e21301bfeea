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
from itertools import takewhile
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Final, Literal, TypeVar, Union, get_args, get_origin

import msgspec

from .text import cut

__all__ = ["LARGEST_FILE", "convert", "parse_toml", "place", "read_text", "read_toml", "shown"]

LARGEST_FILE: Final = 1 << 20
"""The most bytes that are read of a file."""

_LONGEST_SHOWN: Final = 200  # characters of a value, in an error
_LONGEST_MESSAGE: Final = 1000
_PLACE: Final = re.compile(r" - at (`key` in )?`\$(.*)`$", re.DOTALL)
_STEP: Final = re.compile(r"\.(\w+)|\[(\d+|\.\.\.)\]")
_FIELD: Final = re.compile(r"Object (contains unknown|missing required) field `(.*)`", re.DOTALL)
_ABOUT_VALUE: Final = ("Expected", "Invalid", "Number")  # how msgspec begins what it says of a value
_EXPECTED: Final = re.compile(r"Expected `(bool|int|float|str|array|object)(?: \| null)?`, got ")
_WORDS: Final = {
    "bool": "true or false",
    "int": "a whole number",
    "float": "a number",
    "str": "text",
    "array": "a list",
    "object": "a table",
}
_HEADER: Final = re.compile(r"\s*(\[\[?)\s*([^\[\]]+?)\s*\]")
_KEY: Final = re.compile(r"\s*([\w\-]+|\"[^\"]*\"|'[^']*')\s*=")

_T = TypeVar("_T")
_Error = Callable[[str], Exception]


def read_text(path: Path, error: _Error) -> str:
    """Return the text of a file; raises `error` for one that cannot be read, is too large or not UTF-8."""
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
        if len(content) > LARGEST_FILE:
            raise error(f"{path}: larger than {LARGEST_FILE} bytes")
        return content.decode("utf-8-sig")
    except OSError as problem:
        raise error(f"{path}: cannot be read: {problem.strerror}") from problem
    except UnicodeDecodeError as problem:
        line = content.count(b"\n", 0, problem.start) + 1
        raise error(f"{path}:{line}: not UTF-8 text: {problem.reason}") from problem
    except ValueError as problem:  # of a path with a null byte
        raise error(f"{path}: cannot be read: {problem}") from problem


def read_toml(path: Path, kind: type[_T], error: _Error) -> _T:
    """Return what a file holds as a value of type `kind`; raises `error`."""
    return parse_toml(read_text(path, error), kind, str(path), error)


def parse_toml(text: str, kind: type[_T], source: str, error: _Error) -> _T:
    """Return what a text holds as a value of type `kind`; `source` is its file, for the `error` raised."""
    try:
        document = tomllib.loads(text)
    except RecursionError as problem:
        raise error(f"{source}: not TOML: nested too deeply") from problem
    except ValueError as problem:  # of syntax, or of a number's length
        raise error(f"{source}: not TOML: {problem}") from problem
    return convert(document, kind, source, error, text=text)


def convert(
    value: object,
    kind: type[_T],
    source: str,
    error: _Error,
    *,
    path: Sequence[str | int] = (),
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
        below, why = _explain(str(problem), kind, value)
        raise error(f"{place(source, text, *path, *below)}{cut(why, _LONGEST_MESSAGE)}") from None


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


def _explain(problem: str, kind: Any, value: Any) -> tuple[list[str | int], str]:  # noqa: ANN401 - of any type
    """Return the path of what msgspec finds wrong with a value, and what follows it in an error."""
    match = _PLACE.search(problem)
    message = problem[: match.start()] if match else problem
    path: list[str | int] = []
    for name, number in _STEP.findall(match[2] if match else ""):
        plain = _plain(kind)[0]
        key: str | int
        if name:
            if name not in _fields(plain):  # a key that looks like the place of an error
                return path, f": {problem}"
            key, kind = name, _fields(plain)[name]
        elif isinstance(value, Mapping):  # msgspec does not say which key
            kind = get_args(plain)[1]
            key = next(key for key, item in value.items() if not _fits(item, kind))
        else:
            key, kinds = int(number), get_args(plain)
            kind = kinds[0] if get_origin(plain) is list or kinds[-1] is ... else kinds[key]
        value = value[key]
        path.append(key)
    plain, remedy = _plain(kind)
    if match and match[1]:  # a key of a table is wrong
        kind = get_args(plain)[0]
        key = next(key for key in value if not _fits(key, kind))
        return path, f": {shown(key)}: {_plain(kind)[1] or message}"
    if field := _FIELD.fullmatch(message):
        if field[1].startswith("missing"):
            return path, f": {field[2]} is missing"
        return [*path, field[2]], f": there is no such key; there is {', '.join(_fields(plain))}"
    if message.startswith(_ABOUT_VALUE):
        if not remedy and (expected := _EXPECTED.match(message)):
            remedy = f"write {_WORDS[expected[1]]}"
        return path, f" = {shown(value)}: {remedy or message}"
    return path, f": {message}"


def _plain(kind: Any) -> tuple[Any, str]:  # noqa: ANN401 - a type
    """Return a type without its constraints and without None, and what to write for it."""
    remedy = ""
    while get_origin(kind) in (Annotated, Union, UnionType):
        if get_origin(kind) is Annotated:
            metas = [item.description for item in get_args(kind)[1:] if isinstance(item, msgspec.Meta)]
            remedy = remedy or next(filter(None, metas), "")
            kind = get_args(kind)[0]
        else:
            kind = next(member for member in get_args(kind) if member is not type(None))
    words: Iterable[object] = get_args(kind) if get_origin(kind) is Literal else ()
    if isinstance(kind, enum.EnumType):
        members: list[enum.Enum] = list(kind)
        words = [member.value for member in members]
    listed = ", ".join(map(str, words))
    return kind, remedy or (listed and f"write one of {listed}")


def _fields(kind: type[msgspec.Struct]) -> dict[str, Any]:
    return {field.encode_name: field.type for field in msgspec.structs.fields(kind)}


def _fits(value: object, kind: Any) -> bool:  # noqa: ANN401 - a type
    try:
        msgspec.convert(value, kind)
    except msgspec.ValidationError:
        return False
    return True


def _line(text: str, path: Sequence[str | int]) -> int | None:
    """Return the number of the line where a key stands, or else the nearest table around it."""
    found, depth = None, 0
    table: list[str | int] = []
    counts: dict[str, int] = {}  # of the tables of each array so far
    for number, line in enumerate(text.splitlines(), 1):
        here = table
        if header := _HEADER.match(line):
            table, name = [], ""
            for key in header[2].split("."):
                name = f"{name}.{key.strip()}".lstrip(".")
                table.append(key.strip().strip("\"'"))
                if header[1] == "[[" and name == header[2]:
                    counts[name] = counts.get(name, -1) + 1
                if name in counts:
                    table.append(counts[name])
            here = table
        elif key_match := _KEY.match(line):
            here = [*table, key_match[1].strip("\"'")]
        common = sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(here, path, strict=False)))
        if common > depth:
            found, depth = number, common
    return found
