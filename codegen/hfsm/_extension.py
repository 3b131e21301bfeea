"""Find the component of a document, and its hand-written extension.

The extension is `NAME_ext.py`, with a class that becomes a base of the component. It is read, not executed.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass, replace
from pathlib import Path

from ..files import read_regular
from ..messages import NO_MESSAGE, Message
from ..parsing import parse_python
from ..reasons import reason
from .code.names import camel_case, component_name, identifier


@dataclass(frozen=True, slots=True)
class Extension:
    """The hand-written base class of a component, in a module next to it.

    `attributes` are those that are known; if it `is_open` there may be more. A `problem`, at a `line` and
    `column` of `source`, makes it unusable.
    """

    path: Path
    class_name: str
    source: str = ""
    attributes: frozenset[str] = frozenset()
    is_open: bool = True
    problem: Message = NO_MESSAGE
    line: int = 0
    column: int = 1


def component_path(document: Path, output: Path | None) -> Path:
    """Return the file of a document's component, in the directory `output` or next to the document."""
    return (output or document.parent) / f"{identifier(document.stem, 'component')}.py"


def extension_path(component: Path) -> Path:
    """Return the path that the extension of a component has, if there is one."""
    return component.with_name(f"{component.stem}_ext.py")


def find_extension(document: Path, output: Path | None) -> Extension | None:
    """Return the extension of the component of a document, or None if there is none.

    `output` is the directory of the component, by default that of the document.
    """
    path = extension_path(component_path(document, output))
    found = Extension(path, f"{camel_case(component_name(document.stem))}Extension")
    try:
        content = read_regular(path)
    except FileNotFoundError:
        return None
    except OSError as error:
        return replace(found, problem=Message("cannot be read: {reason}", reason=reason(error)))
    found = replace(found, source=content.decode("utf-8", errors="replace"))
    try:
        tree = parse_python(content, filename=str(path))
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        why = reason(error)
        line, column = getattr(error, "lineno", None) or 1, getattr(error, "offset", None) or 1
        return replace(
            found, problem=Message("not valid Python: {reason}", reason=why), line=line, column=column
        )
    classes = [node for node in tree.body if isinstance(node, ast.ClassDef)]
    if not any(each.name == found.class_name for each in classes):
        problem = Message(
            "there is no class `{name}`, which extends the component of {document}: write it, or rename "
            "the file",
            name=found.class_name,
            document=document.name,
        )
        return replace(found, problem=problem, line=1)
    is_open = any(
        not isinstance(base, ast.Name) or base.id != "Component" for each in classes for base in each.bases
    )
    attributes: set[str] = set()
    for node in (inner for each in classes for inner in ast.walk(each)):
        match node:
            case ast.FunctionDef(name="__getattr__" | "__getattribute__"):
                is_open = True
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
                attributes.add(name)
            case ast.Name(id=name, ctx=ast.Store()) | ast.Attribute(attr=name, ctx=ast.Store()):
                attributes.add(name)
    return replace(found, attributes=frozenset(attributes), is_open=is_open)
