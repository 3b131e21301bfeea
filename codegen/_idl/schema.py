"""Describe definitions as data: canonical forms with fingerprints, and schemas of packages.

Two definitions have the same canonical form if and only if they are equal on the wire. It ignores comments,
files, the order of definitions and members, the names of sequences and dictionaries, default values, tags and
compact ids.

The schema is JSON: `comment`, and `definitions` by scoped name. `zenoh_ice.data.reflection` has its classes,
reads it and writes the canonical form.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any, cast

import msgspec

from zenoh_ice.data import reflection
from zenoh_ice.data.reflection import Enumerator, Member, OperationDescription

from . import ast
from .doc_comments import DocComment
from .names import python_name

SCHEMA_FILE = "schema.json"

Entry = dict[str, Any]

_FINGERPRINT_DIGITS = 16


def type_name(kind: ast.Type) -> str:
    """Return the name of a type, scoped from the root where it has one."""
    match kind:
        case ast.ProxyType(target=target):
            return f"{type_name(target)}*"
        case ast.NamedType(definition=ast.Definition() as definition):
            return definition.scoped
    return kind.name


# Canonical forms


def fingerprint(definition: ast.Definition) -> str:
    """Return the first hexadecimal digits of the SHA-256 of the canonical form of an interface or a type.

    The form has a line for each member, including those of its bases and of all types that they use, sorted.
    """
    schema = _schema_of(definition)
    lines = {*reflection.canonical_lines(schema).values(), *_unnamed_lines(definition, schema)}
    text = "\n".join(sorted(lines)) + "\n"
    return hashlib.sha256(text.encode()).hexdigest()[:_FINGERPRINT_DIGITS]


def canonical_members(definition: ast.Definition) -> dict[str, str]:
    """Return the lines of a definition itself in canonical forms, by the scoped names that they begin with.

    That of the definition, without one for what has no name on the wire, is by its own name.
    """
    schema = _schema_of(definition)
    found = dict.fromkeys([definition.scoped], "".join(_unnamed_lines(definition, schema)))
    names = {definition.scoped, *(each.scoped for each in members_of(definition))}
    for subject, line in reflection.canonical_lines(schema).items():
        name = subject.rpartition(" ")[2]  # behind its kind
        if name in names:
            found[name] = line
    return found


def members_of(definition: ast.Definition) -> Sequence[ast.Definition]:
    """Return the operations, members or enumerators of a definition."""
    match definition:
        case ast.Interface():
            return definition.operations
        case ast.Struct() | ast.Class() | ast.ExceptionType():
            return definition.members
        case ast.Enumeration():
            return definition.enumerators
    return ()


def _schema_of(definition: ast.Definition) -> reflection.Schema:
    """Return a definition with all that it extends, contains and throws; what no file defines is left out."""
    found: dict[str, reflection.Definition] = {}
    waiting = [definition]
    while waiting:
        each = waiting.pop()
        if each.scoped not in found and not isinstance(each, ast.ForwardDeclaration):
            found[each.scoped] = _described(each)
            named = (kind for kind in ast.types_in(each) if isinstance(kind, ast.NamedType))
            waiting += [kind.definition for kind in named if kind.definition is not None]
    return reflection.Schema(definition.scoped, found)


def _unnamed_lines(definition: ast.Definition, schema: reflection.Schema) -> list[str]:
    """Return the lines of definitions that are part of no other form by their names."""
    match definition:
        case ast.Sequence() | ast.Dictionary():
            return [schema.type_text(definition.scoped)]
        case ast.Constant():
            kind = schema.type_text(type_name(definition.type))
            return [f"const {definition.scoped}: {kind} = {definition.literal.value!r}"]
    return []


# The schema of a package


def schema_text(comment: str, entries: Mapping[str, Entry]) -> str:
    """Return the schema file of a package, with the definitions ordered by name."""
    schema = {"comment": comment, "definitions": dict(sorted(entries.items()))}
    return json.dumps(schema, indent=1, ensure_ascii=False) + "\n"


def kept_entries(text: str, modules: Collection[str]) -> dict[str, Entry]:
    """Return the old entries of Python modules that are not generated again."""
    try:
        definitions = json.loads(text)["definitions"]
        return {name: entry for name, entry in definitions.items() if entry["module"] in modules}
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return {}  # edited by hand or truncated: these modules have no entries until they are generated again


def schema_entry(definition: ast.Definition, module: str) -> Entry:
    """Return the entry of a definition in a Python module, without empty values."""
    described = msgspec.structs.replace(
        _described(definition), module=module, fingerprint=fingerprint(definition)
    )
    return cast("Entry", msgspec.to_builtins(described))


def _described(definition: ast.Definition) -> reflection.Definition:
    fields: Entry = {}
    match definition:
        case ast.Interface():
            fields["bases"] = tuple(base.scoped for base in definition.base_definitions)
            fields["operations"] = tuple(map(_operation, definition.operations))
        case ast.Class() | ast.ExceptionType():
            base = definition.base_definition
            fields["bases"] = () if base is None else (base.scoped,)
            fields["members"] = _members(definition.members)
        case ast.Struct():
            fields["members"] = _members(definition.members)
        case ast.Enumeration():
            fields["enumerators"] = tuple(
                Enumerator(each.name, each.value, each.documentation.text) for each in definition.enumerators
            )
        case ast.Sequence():
            fields["element"] = type_name(definition.element)
        case ast.Dictionary():
            fields["key"], fields["value"] = type_name(definition.key), type_name(definition.value)
        case ast.Constant():
            fields["type"], fields["constant"] = type_name(definition.type), _value(definition.literal)
    name, doc = python_name(definition), definition.documentation.text
    kind = cast("Any", definition.kind)
    return reflection.Definition(kind=kind, module="", name=name, fingerprint="", doc=doc, **fields)


def _operation(operation: ast.Operation) -> OperationDescription:
    doc = operation.documentation
    results = _members(operation.outputs, doc)
    if operation.returns is not None:
        is_optional = operation.return_tag is not None
        kind = type_name(operation.returns)
        results = (Member("returnValue", kind, doc.returns, optional=is_optional), *results)
    thrown = [named.definition for named in operation.throws if named.definition is not None]
    return OperationDescription(
        operation.name,
        doc.text,
        parameters=_members(operation.inputs, doc),
        results=results,
        exceptions={each.scoped: doc.throws.get(each.name, "") for each in thrown},
        idempotent=operation.idempotent,
        streamed=operation.streamed,
    )


def _members(
    members: Iterable[ast.Member | ast.Parameter], operation: DocComment | None = None
) -> tuple[Member, ...]:
    return tuple(
        Member(
            member.name,
            type_name(member.type),
            (operation.parameters.get(member.name) if operation else None) or member.documentation.text,
            optional=member.tag is not None,
            default=_value(member.default) if isinstance(member, ast.Member) else None,
        )
        for member in members
    )


def _value(literal: ast.Literal | None) -> ast.Value | None:
    """Return a value for JSON: an enumerator as its name."""
    if literal is None:
        return None
    return literal.target.name if isinstance(literal.target, ast.Enumerator) else literal.value
