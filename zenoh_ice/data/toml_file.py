"""Read TOML into typed values; an error names the file, the line, the key and its value, and what to write.

    class Ball(Struct, frozen=True, forbid_unknown_fields=True):
        radius: Annotated[float, Meta(gt=0.0, description="write a radius in m, above 0")]

    ball = parse_toml(text, Ball, "ball.toml", BallError)

A user reads the `description` after a bad value: `ball.toml:1: radius = -1: write a radius in m, above 0`.
"""

from __future__ import annotations

import enum
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Final, Literal, TypeVar, Union, get_args, get_origin

import msgspec

from zenoh_ice.data import typed
from zenoh_ice.data.text import cut

LARGEST_FILE: Final = 1 << 20  # bytes
_LONGEST_SHOWN: Final = 200  # characters of a value, in an error
_EXPECTED: Final = re.compile(r"Expected `(bool|float|str|array|object)(?: \| null)?`, got ")
_WORDS = {"bool": "true or false", "float": "a number", "str": "text", "array": "a list", "object": "a table"}

_T = TypeVar("_T")
_Error = Callable[[str], Exception]


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


def parse_toml(text: str, kind: type[_T], source: str, error: _Error) -> _T:
    """Return what a text holds as a value of type `kind`; `source` is its file, for the `error` raised."""
    import tomllib  # most processes read no such file

    try:
        document = tomllib.loads(text)
    except (ValueError, RecursionError) as problem:  # ValueError: the syntax, or the length of a number
        why = "nested too deeply" if isinstance(problem, RecursionError) else problem
        raise error(f"{source}: not TOML: {why}") from problem
    return convert(document, kind, source, error, text=text)


def convert(
    value: Any,  # noqa: ANN401
    kind: type[_T],
    source: str,
    error: _Error,
    *,
    path: tuple[str | int, ...] = (),
    text: str = "",
    strict: bool = True,
) -> _T:
    """Return a value as one of type `kind`.

    Raises `error` that names `source`, where the value came from, and the key; `path` is that of the value,
    and with the `text` of the file the line is named, too. Without `strict`, a text may represent a number.
    """
    try:
        return typed.convert(value, kind, strict=strict)
    except msgspec.ValidationError as refusal:
        problem = str(refusal)
    plain, remedy = _plain(kind)
    for key, item, item_kind in _items(value, plain):  # the innermost value that does not fit is reported
        convert(item, item_kind, source, error, path=(*path, key), text=text, strict=strict)
    found = ""
    if problem.startswith("Object contains unknown field"):
        names = plain.__struct_encode_fields__
        path = (*path, next(key for key in value if key not in names))
        problem = f"there is no such key; there is {', '.join(names)}"
    elif problem.startswith("Object missing required field"):
        problem = f"{problem.split('`')[1]} is missing"
    elif problem.startswith(("Expected", "Invalid", "Number")):  # else a check in the program found it
        found = f" = {shown(value)}"
        expected = _EXPECTED.match(problem)
        problem = remedy or (f"write {_WORDS[expected[1]]}" if expected else problem)
    raise error(f"{place(source, text, *path)}{found}: {cut(problem, 1000)}")


def place(source: str, text: str, *path: str | int) -> str:
    """Return the location of a value, for the start of an error: `FILE:LINE: key[0].key`.

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


def _items(value: Any, kind: Any) -> Iterable[tuple[str | int, Any, Any]]:  # noqa: ANN401
    """Return the keys, items and types of the items of a value that fits the kind of its type."""
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
            remedy = remedy or next((meta.description for meta in rest if meta.description), "")
        else:
            kind = next(member for member in get_args(kind) if member is not NoneType)
    words = get_args(kind) if get_origin(kind) is Literal else ()
    if isinstance(kind, enum.EnumType):
        words = tuple(member.value for member in list[enum.Enum](kind))
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
