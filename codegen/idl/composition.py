"""What types are made of, as rules and other stages need it."""

from __future__ import annotations

from collections.abc import Iterator

from . import ast
from .resolver import declared_kind, with_article

_KEY_TYPES = frozenset({"bool", "byte", "short", "int", "long", "string"})


def parts(definition: ast.Definition) -> Iterator[ast.NamedType]:
    """Yield the types that a definition is made of: members, elements, bases, but not members of classes."""
    types: list[ast.Type | None] = []
    match definition:
        case ast.Struct():
            types = [member.type for member in definition.members]
        case ast.Class():
            types = [definition.base]
        case ast.ExceptionType():
            types = [definition.base, *(member.type for member in definition.members)]
        case ast.Interface():
            types = [*definition.bases]
        case ast.Sequence():
            types = [definition.element]
        case ast.Dictionary():
            types = [definition.key, definition.value]
    yield from (kind for kind in types if isinstance(kind, ast.NamedType))


def why_not_a_key(kind: ast.Type) -> str:
    """Return why values of a type cannot be keys of a dictionary; nothing when they can."""
    match kind:
        case ast.BuiltinType(name=name):
            return "" if name in _KEY_TYPES else f"is {with_article(name)}"
        case ast.NamedType(definition=ast.Enumeration()):
            return ""
        case ast.NamedType(definition=ast.Sequence() as sequence):
            reason = why_not_a_key(sequence.element)
            return f"is a sequence of what {reason}" if reason else ""
        case ast.NamedType(definition=ast.Struct() as struct):
            for member in struct.members:
                reason = why_not_a_key(member.type)
                if reason:
                    return f"has a member `{member.name}` that {reason}"
            return ""
        case ast.NamedType(definition=ast.Definition() as definition):
            return f"is {with_article(declared_kind(definition).kind)}"
        case ast.ProxyType():
            return "is a proxy"
    return ""


def holds_sequence(kind: ast.Type) -> bool:
    """Return whether a type is a sequence or a struct with a sequence somewhere in it."""
    match kind:
        case ast.NamedType(definition=ast.Sequence()):
            return True
        case ast.NamedType(definition=ast.Struct() as struct):
            return any(holds_sequence(member.type) for member in struct.members)
    return False
