"""Find a type, an interface or an operation by its name, and describe it: what it means and what travels.

This is the form that `zenoh_ice` gives to values: a struct, the arguments and the results of an operation are
MessagePack maps by member name; a class says under `@type` which one it is; a proxy is the text that stands
for it; an optional member may be missing. The map of an exception holds its type id under `exception`, those
of what it extends under `bases`, and the map of its members under `members`.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from codegen.diagnostics import did_you_mean

from . import ast
from .doc_comments import DocComment, parse_doc_comment
from .schema import canonical_definition, fingerprint, operation_signature, type_name

__all__ = ["UnknownNameError", "describe", "find_definition"]

_WIDTH = 100
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


class UnknownNameError(Exception):
    """No definition has the name, or several have."""


def find_definition(name: str, definitions: Mapping[str, ast.Definition]) -> ast.Definition:
    """Return a definition or an operation by its scoped name or the end of it: `nao::HeadPose`, `HeadPose`.

    An operation, own or inherited, is named with its interface: `PoseHead::getPose`. Dots stand for colons.
    Raises UnknownNameError.
    """
    wanted = "::" + name.replace(".", "::").removeprefix("::")
    found = _matches(wanted, definitions)
    if not found:
        owner, _, member = wanted.rpartition("::")
        interfaces = [each for each in _matches(owner, definitions) if isinstance(each, ast.Interface)]
        found = [each for interface in interfaces for each in _operations(interface) if each.name == member]
    if len(found) == 1:
        return found[0]
    if found:
        names = ", ".join(each.scoped for each in found)
        raise UnknownNameError(f"`{name}` may be {names}: write more of the name")
    known = [scoped.removeprefix("::") for scoped in definitions]
    notes = did_you_mean(name, [*known, *(each.rpartition("::")[2] for each in known)])
    hint = f": {notes[0].message}" if notes else ""
    raise UnknownNameError(f"no file defines `{name}`{hint}")


def _matches(wanted: str, definitions: Mapping[str, ast.Definition]) -> list[ast.Definition]:
    exact = definitions.get(wanted)
    if exact is not None:
        return [exact]
    return [definition for scoped, definition in definitions.items() if scoped.endswith(wanted)]


def _operations(interface: ast.Interface) -> list[ast.Operation]:
    found = {each.name: each for base in interface.ancestors() for each in base.operations}
    return list({**found, **{each.name: each for each in interface.operations}}.values())


class _Field(NamedTuple):
    """A member of a map on the wire."""

    name: str
    type: ast.Type
    optional: bool
    doc: str


def describe(definition: ast.Definition) -> str:
    """Return several lines about a definition: documentation, wire form, fingerprint."""
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
    results = _fields(operation.outputs, doc)
    if operation.returns is not None:
        optional = operation.return_tag is not None
        results.insert(0, _Field("returnValue", operation.returns, optional, doc.returns))
    blocks.append(_map_lines("on the wire, arguments: ", _fields(operation.inputs, doc)))
    blocks.append(_map_lines("on the wire, results: ", results))
    if operation.throws:
        names = ", ".join(named.definition.scoped for named in operation.throws if named.definition)
        blocks.append([f"throws {names}"])
    return blocks


def _fields(
    members: Iterable[ast.Member | ast.Parameter], operation: DocComment | None = None
) -> list[_Field]:
    """Return the fields for members; parameters may be documented with their operation."""
    documented = operation.parameters if operation is not None else {}
    return [
        _Field(
            each.name,
            each.type,
            each.tag is not None,
            parse_doc_comment(each.doc).text or documented.get(each.name, ""),
        )
        for each in members
    ]


def _data(definition: ast.Definition) -> list[list[str]]:
    before = "on the wire: "
    match definition:
        case ast.Struct():
            return [_map_lines(before, _fields(definition.members))]
        case ast.ExceptionType():
            return [_exception_lines(before, definition)]
        case ast.Class():
            ids = " ".join([definition.scoped, *(base.scoped for base in definition.ancestors())])
            lines = _map_lines(f"{before}nil, or ", _fields(definition.all_members))
            lines.insert(1, f'  @type  "{ids}" or the like of a class that extends it')
            return [lines]
        case ast.Enumeration():
            lines = [f"{before}an integer"]
            for enumerator in definition.enumerators:
                lines.append(f"  {enumerator.value}  {enumerator.name}")
                lines += _indented(parse_doc_comment(enumerator.doc).text, 6)
            return [lines]
    return [[f"{before}{_wire_type_of(definition)}"]]


def _exception_lines(before: str, exception: ast.ExceptionType) -> list[str]:
    bases = ", ".join(f'"{base.scoped}"' for base in exception.ancestors())
    return [
        f"{before}a map",
        f'  exception  "{exception.scoped}" or that of an exception that extends it',
        f"  bases      array of what that extends, the nearest first: {bases}"
        if bases
        else "  bases      array of what that extends, the nearest first; missing if it is nothing",
        *(f"  {line}" for line in _map_lines("members    ", _fields(exception.all_members))),
    ]


def _map_lines(before: str, fields: Sequence[_Field]) -> list[str]:
    if not fields:
        return [f"{before}an empty map"]
    lines = [f"{before}a map"]
    longest = max(len(field.name) for field in fields)
    for field in fields:
        optional = ", may be missing" if field.optional else ""
        lines.append(f"  {field.name:{longest}}  {_wire_type(field.type)}{optional}")
        lines += _indented(field.doc, longest + 6)
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
        case ast.Sequence(element=ast.BuiltinType(name="byte")):
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


def _indented(text: str, width: int = 4) -> list[str]:
    indent = " " * width
    return [
        line
        for paragraph in text.split("\n\n")
        for line in textwrap.wrap(paragraph, _WIDTH, initial_indent=indent, subsequent_indent=indent)
    ]
