"""What travels for a definition: a map of named members, or a single value.

This is the form that `zenoh_ice` gives to values: a struct, the arguments and the results of an operation are
MessagePack maps by member name; a class says under `@type` which one it is; a proxy is the text that stands
for it; an optional member may be missing. The map of an exception holds its type id under `exception`, those
of what it extends under `bases`, and the map of its members under `members`.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from . import ast

__all__ = ["TYPE_FIELD", "Field", "Part", "fields_of", "holds_bytes", "is_bytes", "type_ids"]

TYPE_FIELD = "@type"
"""The key under which a value of a class says of which class it is, and which classes that extends."""


@dataclass(frozen=True, slots=True)
class Field:
    """A member of a map on the wire."""

    name: str
    type: ast.Type
    optional: bool
    doc: str | None


class Part(StrEnum):
    """Which of its two maps is meant of an operation."""

    ARGUMENTS = "arguments"
    RESULT = "result"


def fields_of(definition: ast.Definition, part: Part = Part.RESULT) -> list[Field] | None:
    """Return the members of the map that stands for a definition, or None when it is no map."""
    match definition:
        case ast.Struct():
            return [_field(member) for member in definition.members]
        case ast.Class() | ast.ExceptionType():
            return [_field(member) for member in definition.all_members]
        case ast.Operation() if part is Part.ARGUMENTS:
            return [_field(parameter) for parameter in definition.inputs]
        case ast.Operation():
            results = [_field(parameter) for parameter in definition.outputs]
            if definition.returns is not None:
                optional = definition.return_tag is not None
                results.insert(0, Field("returnValue", definition.returns, optional, None))
            return results
    return None


def _field(member: ast.Member | ast.Parameter) -> Field:
    return Field(member.name, member.type, member.tag is not None, member.doc)


def type_ids(definition: ast.Class) -> str:
    """Return what stands under `@type`: the class and those that it extends, the nearest first."""
    return " ".join([definition.scoped, *(base.scoped for base in definition.ancestors())])


def is_bytes(definition: ast.Definition | None) -> bool:
    """Return whether a definition is a sequence of bytes, which travels in one piece."""
    return (
        isinstance(definition, ast.Sequence)
        and isinstance(definition.element, ast.BuiltinType)
        and definition.element.name == "byte"
    )


def holds_bytes(definition: ast.Definition, part: Part = Part.RESULT) -> bool:
    """Return whether a sequence of bytes stands anywhere in a definition: such payloads may be larger."""
    seen: set[str] = set()
    waiting: list[ast.Definition | None] = []
    top = fields_of(definition, part)
    waiting += [definition] if top is None else [_named(field.type) for field in top]
    while waiting:
        each = waiting.pop()
        if each is None or each.scoped in seen:
            continue
        seen.add(each.scoped)
        if is_bytes(each):
            return True
        match each:
            case ast.Sequence():
                waiting.append(_named(each.element))
            case ast.Dictionary():
                waiting += [_named(each.key), _named(each.value)]
            case _:
                waiting += [_named(field.type) for field in fields_of(each) or ()]
    return False


def _named(kind: ast.Type) -> ast.Definition | None:
    return kind.definition if isinstance(kind, ast.NamedType) else None
