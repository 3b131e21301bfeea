"""Describe a type, an interface or an operation for people: what it means and what travels."""

from __future__ import annotations

import base64
import json
import textwrap
from collections.abc import Iterable, Sequence

import msgpack

from . import ast
from .doc_comments import parse_doc_comment
from .example import ExampleTooLargeError, Wire, example_of
from .fingerprint import canonical_definition, fingerprint
from .signature import operation_signature, type_name
from .wire_shape import TYPE_FIELD, Field, Part, fields_of, is_bytes, type_ids

__all__ = ["describe"]

_WIDTH = 100
_MOST_BYTES = 128
_NUMBERS = {
    "byte": "integer, 0 to 255",
    "short": "integer of 16 bits",
    "int": "integer of 32 bits",
    "long": "integer of 64 bits",
    "float": "float",
    "double": "float",
    "string": "string",
    "bool": "bool",
}


def describe(definition: ast.Definition) -> str:
    """Return several lines about a definition: documentation, wire form with an example, fingerprint."""
    place = definition.token.location
    blocks = [[f"{definition.kind} {definition.scoped}", f"defined in {place}"]]
    blocks += [[*lines] for lines in _documentation(definition)]
    match definition:
        case ast.Interface():
            blocks += _interface(definition)
        case ast.Operation():
            blocks += _operation(definition)
        case ast.Constant():
            blocks.append([f"{type_name(definition.type)}, always {definition.literal.value!r}"])
        case _:
            blocks += _data(definition)
    if not isinstance(definition, ast.Operation):
        blocks.append([f"fingerprint {fingerprint(canonical_definition(definition))}"])
    return "\n\n".join("\n".join(block) for block in blocks if block)


def _documentation(definition: ast.Definition) -> list[list[str]]:
    text = parse_doc_comment(definition.doc).text
    return [textwrap.wrap(paragraph, _WIDTH) for paragraph in text.split("\n\n") if paragraph]


def _interface(interface: ast.Interface) -> list[list[str]]:
    blocks: list[list[str]] = []
    bases = [base.scoped for base in interface.base_definitions]
    if bases:
        blocks.append([f"extends {', '.join(bases)}"])
    lines: list[str] = []
    for operation in interface.operations:
        lines.append(operation_signature(operation))
        lines += _indented(parse_doc_comment(operation.doc).text)
    blocks.append(lines)
    return blocks


def _operation(operation: ast.Operation) -> list[list[str]]:
    blocks = [[operation_signature(operation)]]
    kind = "called with a query"
    if operation.streamed:
        kind += ", published as a stream"
    if operation.stop:
        kind += ", stops what its interface commands"
    if operation.amd:
        kind += ", answered now or later"
    blocks.append([f"key {{realm}}/{{identity}}/{operation.name}: {kind}"])
    doc = parse_doc_comment(operation.doc)
    for part, title in ((Part.ARGUMENTS, "arguments"), (Part.RESULT, "results")):
        fields = fields_of(operation, part) or []
        described = [_with_doc(field, doc.parameters.get(field.name, "")) for field in fields]
        blocks.append(_map_lines(f"on the wire, {title}: ", described))
        blocks += _example(operation, part)
    if operation.throws:
        names = ", ".join(named.definition.scoped for named in operation.throws if named.definition)
        blocks.append([f"throws {names}"])
    return blocks


def _with_doc(field: Field, text: str) -> Field:
    return field if field.doc or not text else Field(field.name, field.type, field.optional, text)


def _data(definition: ast.Definition) -> list[list[str]]:
    fields = fields_of(definition)
    before = "on the wire: "
    if isinstance(definition, ast.ExceptionType):
        return [_exception_lines(before, definition), *_example(definition)]
    if fields is not None:
        before += "nil, or " if isinstance(definition, ast.Class) else ""
        lines = _map_lines(before, fields)
        if isinstance(definition, ast.Class):
            lines.insert(
                1, f'  {TYPE_FIELD}  "{type_ids(definition)}" or the like of a class that extends it'
            )
        return [lines, *_example(definition)]
    if isinstance(definition, ast.Enumeration):
        lines = [f"{before}an integer"]
        for enumerator in definition.enumerators:
            lines.append(f"  {enumerator.value}  {enumerator.name}")
            lines += _indented(parse_doc_comment(enumerator.doc).text, 6)
        return [lines]
    return [[f"{before}{_wire_type_of(definition)}"], *_example(definition)]


def _exception_lines(before: str, exception: ast.ExceptionType) -> list[str]:
    bases = ", ".join(f'"{base.scoped}"' for base in exception.ancestors())
    return [
        f"{before}a map",
        f'  exception  "{exception.scoped}" or that of an exception that extends it',
        f"  bases      array of what that extends, the nearest first: {bases}"
        if bases
        else "  bases      array of what that extends, the nearest first; missing if it is nothing",
        *_indent(_map_lines("members    ", fields_of(exception) or [])),
    ]


def _map_lines(before: str, fields: Sequence[Field]) -> list[str]:
    if not fields:
        return [f"{before}an empty map"]
    lines = [f"{before}a map"]
    longest = max(len(field.name) for field in fields)
    for field in fields:
        optional = ", may be missing" if field.optional else ""
        lines.append(f"  {field.name:{longest}}  {_wire_type(field.type)}{optional}")
        lines += _indented(parse_doc_comment(field.doc).text, longest + 6)
    return lines


def _wire_type(kind: ast.Type) -> str:
    """Return how a value of a type travels, with the name of the type where it has one."""
    match kind:
        case ast.BuiltinType(name=name) if name in _NUMBERS:
            return _NUMBERS[name]
        case ast.ProxyType():
            return f"string: identity, perhaps with @realm, of a {type_name(kind)}; or nil"
        case ast.NamedType(definition=ast.Definition() as definition):
            return f"{_wire_type_of(definition)} ({definition.scoped})"
    return "map of some class, or nil"


def _wire_type_of(definition: ast.Definition) -> str:
    match definition:
        case ast.Sequence() if is_bytes(definition):
            return "bytes"
        case ast.Sequence():
            return f"array of {type_name(definition.element)}"
        case ast.Dictionary():
            return f"map from {type_name(definition.key)} to {type_name(definition.value)}"
        case ast.Enumeration():
            return "integer"
        case ast.Struct():
            return "map"
    return "map or nil"


def _example(definition: ast.Definition, part: Part = Part.RESULT) -> list[list[str]]:
    """Return an example as JSON and as bytes."""
    try:
        value = example_of(definition, part)
    except ExampleTooLargeError:
        return []
    if value == {}:
        return []
    payload: bytes = msgpack.packb(value)
    text = json.dumps(_as_json(value), ensure_ascii=False)
    if len(text) > _WIDTH:
        text = json.dumps(_as_json(value), ensure_ascii=False, indent=2)
    shown = [payload[start : start + 16].hex(" ") for start in range(0, min(len(payload), _MOST_BYTES), 16)]
    if len(payload) > _MOST_BYTES:
        shown.append("...")
    return [["for example", *_indent(text.split("\n"))], [f"in {len(payload)} bytes", *_indent(shown)]]


def _as_json(value: Wire) -> object:
    match value:
        case bytes():
            return base64.b64encode(value).decode()
        case list():
            return [_as_json(item) for item in value]
        case dict():
            return {str(key): _as_json(item) for key, item in value.items()}
    return value


def _indent(lines: Iterable[str]) -> list[str]:
    return [f"  {line}" for line in lines]


def _indented(text: str, width: int = 4) -> list[str]:
    indent = " " * width
    return [
        line
        for paragraph in text.split("\n\n")
        for line in textwrap.wrap(paragraph, _WIDTH, initial_indent=indent, subsequent_indent=indent)
    ]
