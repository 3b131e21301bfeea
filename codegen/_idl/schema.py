"""Describe definitions as data: canonical forms with fingerprints, and schemas of packages.

Two definitions have the same canonical form if and only if they are equal on the wire. It ignores comments,
files, the order of definitions and members, the names of sequences and dictionaries, default values, tags and
compact ids.

The schema is JSON: `comment`, and `definitions` by scoped name. `zenoh_ice.reflection` is its reader.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

from . import ast
from .doc_comments import DocComment
from .names import python_name

SCHEMA_FILE = "schema.json"

Entry = dict[str, Any]


def type_name(kind: ast.Type) -> str:
    """Return the name of a type, scoped from the root where it has one."""
    match kind:
        case ast.ProxyType(target=target):
            return f"{type_name(target)}*"
        case ast.NamedType(definition=ast.Definition() as definition):
            return definition.scoped
    return kind.name


# Canonical forms

_FINGERPRINT_DIGITS = 16


def fingerprint(definition: ast.Definition) -> str:
    """Return the first hexadecimal digits of the SHA-256 of the canonical form of an interface or a type.

    The form has a line for each member, including those of its bases and of all types that they use, sorted.
    """
    form = _CanonicalForm()
    form.add(definition)
    form.describe_all()
    text = "\n".join(sorted(form.lines)) + "\n"
    return hashlib.sha256(text.encode()).hexdigest()[:_FINGERPRINT_DIGITS]


def canonical_members(definition: ast.Definition) -> dict[str, str]:
    """Return the lines of a definition itself in canonical forms, by the scoped names that they begin with.

    That of the definition, without one for what has no name on the wire, is by its own name.
    """
    form = _CanonicalForm()
    form.describe(definition)
    names = {each.scoped for each in members_of(definition)}
    found: dict[str, str] = {}
    for line in form.lines:
        name = re.split(r"\(|: | = ", line, maxsplit=1)[0]
        found[name if name in names else definition.scoped] = line
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


class _CanonicalForm:
    def __init__(self) -> None:
        self.lines: list[str] = []
        self._seen: set[str] = set()
        self._waiting: list[ast.Definition] = []

    def add(self, definition: ast.Definition | None) -> None:
        """Add a definition that is used, once."""
        if definition is not None and definition.scoped not in self._seen:
            self._seen.add(definition.scoped)
            self._waiting.append(definition)

    def describe_all(self) -> None:
        """Write the lines of every added definition and of the definitions that it refers to."""
        while self._waiting:
            self.describe(self._waiting.pop())

    def describe(self, definition: ast.Definition) -> None:
        """Write the lines of one definition."""
        name = definition.scoped
        match definition:
            case ast.Interface():
                bases = sorted(base.scoped for base in definition.base_definitions)
                self.lines.append(f"interface {name}{_extends(bases)}")
                self.lines += [self._operation(operation) for operation in definition.operations]
                for base in definition.base_definitions:
                    self.add(base)
            case ast.Struct():
                self.lines.append(f"struct {name}")
                self.lines += [self._member(member) for member in definition.members]
            case ast.Class() | ast.ExceptionType():
                parent = definition.base_definition
                self.lines.append(f"{definition.kind} {name}{_extends([parent.scoped] if parent else [])}")
                self.lines += [self._member(member) for member in definition.members]
                self.add(parent)
            case ast.Enumeration():
                self.lines.append(f"enum {name}")
                self.lines += [f"{each.scoped} = {each.value}" for each in definition.enumerators]
            case ast.Sequence():
                self.lines.append(f"sequence<{self.type(definition.element)}>")
            case ast.Dictionary():
                self.lines.append(f"dictionary<{self.type(definition.key)}, {self.type(definition.value)}>")
            case ast.Constant():
                self.lines.append(
                    f"const {name}: {self.type(definition.type)} = {definition.literal.value!r}"
                )

    def _member(self, member: ast.Member) -> str:
        return f"{member.scoped}: {self.type(member.type, member.tag)}"

    def _operation(self, operation: ast.Operation) -> str:
        inputs = ", ".join(f"{self.type(each.type, each.tag)} {each.name}" for each in operation.inputs)
        results = [f"{self.type(each.type, each.tag)} {each.name}" for each in operation.outputs]
        if operation.returns is not None:
            results.insert(0, self.type(operation.returns, operation.return_tag))
        line = f"{operation.scoped}({inputs}): {', '.join(results) or 'void'}"
        thrown = [named.definition for named in operation.throws if named.definition]
        if thrown:
            line += " throws " + ", ".join(sorted(exception.scoped for exception in thrown))
        for exception in thrown:
            self.add(exception)
        if operation.idempotent:
            line += " idempotent"
        if operation.streamed:
            line += " stream"
        return line

    def type(self, kind: ast.Type, tag: ast.Literal | None = None) -> str:
        if tag is not None:
            return f"optional {self.type(kind)}"
        match kind:
            case ast.BuiltinType(name=name):
                return name
            case ast.ProxyType(target=target):
                known = target.definition if isinstance(target, ast.NamedType) else None
                return f"{known.scoped if known else target.name}*"
            case ast.NamedType(definition=ast.Sequence(element=element)):
                return f"sequence<{self.type(element)}>"
            case ast.NamedType(definition=ast.Dictionary(key=key, value=value)):
                return f"dictionary<{self.type(key)}, {self.type(value)}>"
            case ast.NamedType(definition=definition):
                self.add(definition)
                return definition.scoped if definition else kind.name
        raise AssertionError(f"no canonical form for {kind}")


def _extends(bases: list[str]) -> str:
    return f" extends {', '.join(bases)}" if bases else ""


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
    doc = definition.documentation
    entry: Entry = {
        "kind": definition.kind,
        "module": module,
        "name": python_name(definition),
        "fingerprint": fingerprint(definition),
        "doc": doc.text,
    }
    match definition:
        case ast.Interface():
            entry["bases"] = [base.scoped for base in definition.base_definitions]
            entry["operations"] = [_operation(operation) for operation in definition.operations]
        case ast.Class() | ast.ExceptionType():
            entry["bases"] = [definition.base_definition.scoped] if definition.base_definition else []
            entry["members"] = _members(definition.members)
        case ast.Struct():
            entry["members"] = _members(definition.members)
        case ast.Enumeration():
            entry["enumerators"] = [
                _filled({"name": each.name, "value": each.value, "doc": each.documentation.text})
                for each in definition.enumerators
            ]
        case ast.Sequence():
            entry["element"] = type_name(definition.element)
        case ast.Dictionary():
            entry["key"], entry["value"] = type_name(definition.key), type_name(definition.value)
        case ast.Constant():
            entry["type"], entry["constant"] = type_name(definition.type), _value(definition.literal)
    return _filled(entry)


def _operation(operation: ast.Operation) -> Entry:
    doc = operation.documentation
    results = _members(operation.outputs, doc)
    if operation.returns is not None:
        returned = {"name": "returnValue", "type": type_name(operation.returns), "doc": doc.returns}
        results.insert(0, _filled({**returned, "optional": operation.return_tag is not None}))
    return _filled(
        {
            "name": operation.name,
            "doc": doc.text,
            "parameters": _members(operation.inputs, doc),
            "results": results,
            "exceptions": {
                thrown.scoped: doc.throws.get(thrown.name, "")
                for named in operation.throws
                if (thrown := named.definition) is not None
            },
            "idempotent": operation.idempotent,
            "streamed": operation.streamed,
        }
    )


def _members(
    members: Iterable[ast.Member | ast.Parameter], operation: DocComment | None = None
) -> list[Entry]:
    return [
        _filled(
            {
                "name": member.name,
                "type": type_name(member.type),
                "doc": (operation.parameters.get(member.name) if operation else None)
                or member.documentation.text,
                "optional": member.tag is not None,
                "default": _value(member.default) if isinstance(member, ast.Member) else None,
            }
        )
        for member in members
    ]


def _value(literal: ast.Literal | None) -> ast.Value | None:
    """Return a value for JSON: an enumerator as its name."""
    if literal is None:
        return None
    return literal.target.name if isinstance(literal.target, ast.Enumerator) else literal.value


def _filled(entry: Entry) -> Entry:
    """Return an entry without empty values; 0 and false are not empty."""
    empty: tuple[object, ...] = ("", [], {})
    marks = {"optional", "idempotent", "streamed"}
    return {
        key: value
        for key, value in entry.items()
        if value is not None
        and not (key in marks and not value)
        and not (key not in {"default", "constant"} and value in empty)
    }
