"""Write types and operations the way Slice does, with whole names."""

from __future__ import annotations

from . import ast

__all__ = ["operation_signature", "type_name"]


def type_name(kind: ast.Type | None) -> str:
    """Return the name of a type: from the root where it has one, `void` for None."""
    match kind:
        case None:
            return "void"
        case ast.ProxyType(target=target):
            return f"{type_name(target)}*"
        case ast.NamedType(definition=ast.Definition() as definition):
            return definition.scoped
    return kind.name


def operation_signature(operation: ast.Operation) -> str:
    """Return an operation on one line: metadata that counts, types, parameters, exceptions."""
    parameters = ", ".join(
        f"{'out ' if each.out else ''}{_tag(each.tag)}{type_name(each.type)} {each.name}"
        for each in operation.parameters
    )
    given = {"amd": operation.amd, "stream": operation.streamed, "stop": operation.stop}
    marks = [f'"{mark}"' for mark, is_given in given.items() if is_given]
    thrown = [named.definition.scoped if named.definition else named.name for named in operation.throws]
    return "".join(
        (
            f"[{', '.join(marks)}] " if marks else "",
            "idempotent " if operation.idempotent else "",
            f"{_tag(operation.return_tag)}{type_name(operation.returns)} {operation.name}({parameters})",
            f" throws {', '.join(thrown)}" if thrown else "",
        )
    )


def _tag(tag: ast.Literal | None) -> str:
    return f"optional({tag.value}) " if tag is not None else ""
