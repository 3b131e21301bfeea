"""Write the schema of a generated package: what it defines, as data that programs read at run time.

It is JSON: `comment`, and `definitions` by scoped name. `zenoh_ice.reflection` is its reader.
"""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Iterable, Mapping
from typing import Any

from . import ast
from .doc_comments import DocComment, parse_doc_comment
from .fingerprint import canonical_definition, fingerprint
from .names import python_name

__all__ = ["SCHEMA_FILE", "kept_entries", "schema_entry", "schema_text"]

SCHEMA_FILE = "schema.json"

_SURROGATE = re.compile("[\ud800-\udfff]")

Entry = dict[str, Any]


def schema_text(comment: str, entries: Mapping[str, Entry]) -> str:
    """Return the file of a package, definitions in the order of their names."""
    schema = {"comment": comment, "definitions": dict(sorted(entries.items()))}
    text = json.dumps(schema, indent=1, ensure_ascii=False) + "\n"
    return _SURROGATE.sub(lambda match: f"\\u{ord(match[0]):04x}", text)


def kept_entries(text: str, modules: Collection[str]) -> dict[str, Entry]:
    """Return what an earlier file says of Python modules that were not made anew."""
    try:
        definitions = json.loads(text)["definitions"]
        return {name: entry for name, entry in definitions.items() if entry["module"] in modules}
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return {}  # made by hand, or cut short: those modules have no entries until they are made anew


def schema_entry(definition: ast.Definition, module: str) -> Entry:
    """Return what the schema says of a definition of a Python module; what is empty is left out."""
    doc = parse_doc_comment(definition.doc)
    entry: Entry = {
        "kind": definition.kind,
        "module": module,
        "name": python_name(definition),
        "fingerprint": fingerprint(canonical_definition(definition)),
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
                _filled({"name": each.name, "value": each.value, "doc": parse_doc_comment(each.doc).text})
                for each in definition.enumerators
            ]
        case ast.Sequence():
            entry["element"] = _type_name(definition.element)
        case ast.Dictionary():
            entry["key"], entry["value"] = _type_name(definition.key), _type_name(definition.value)
        case ast.Constant():
            entry["type"], entry["constant"] = _type_name(definition.type), _value(definition.literal)
    return _filled(entry)


def _operation(operation: ast.Operation) -> Entry:
    doc = parse_doc_comment(operation.doc)
    results = _members(operation.outputs, doc)
    if operation.returns is not None:
        returned = {"name": "returnValue", "type": _type_name(operation.returns), "doc": doc.returns}
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
                "type": _type_name(member.type),
                "doc": (operation.parameters.get(member.name) if operation else None)
                or parse_doc_comment(member.doc).text,
                "optional": member.tag is not None,
                "default": _value(member.default) if isinstance(member, ast.Member) else None,
            }
        )
        for member in members
    ]


def _type_name(kind: ast.Type) -> str:
    """Return the name of a type, from the root where it has one."""
    match kind:
        case ast.ProxyType(target=target):
            return f"{_type_name(target)}*"
        case ast.NamedType(definition=ast.Definition() as definition):
            return definition.scoped
    return kind.name


def _value(literal: ast.Literal | None) -> ast.Value | None:
    """Return a value as JSON has it: an enumerator by its name."""
    if literal is None:
        return None
    return literal.target.name if isinstance(literal.target, ast.Enumerator) else literal.value


def _filled(entry: Entry) -> Entry:
    """Return an entry without what is empty; a value of 0 or false is not."""
    empty: tuple[object, ...] = ("", [], {})
    marks = {"optional", "idempotent", "streamed"}
    return {
        key: value
        for key, value in entry.items()
        if value is not None
        and not (key in marks and not value)
        and not (key not in {"default", "constant"} and value in empty)
    }
