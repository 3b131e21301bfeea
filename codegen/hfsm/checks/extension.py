"""Know what the hand-written file beside a component gives it."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from pathlib import Path

from ..code.names import identifier
from ..code.trees import parse_python
from ..extension import extension_path

__all__ = ["Extension", "extension_of"]


@dataclass(frozen=True, slots=True)
class Extension:
    """The attributes that the extension of a component has; `is_open` when it may have others, too."""

    attributes: frozenset[str] = frozenset()
    is_open: bool = False
    exists: bool = False


def extension_of(document: Path) -> Extension:
    """Return the extension that lies beside a document, or an empty one when there is no such file."""
    path = extension_path(document.with_stem(identifier(document.stem, "component")))
    try:
        tree = parse_python(path.read_bytes())
    except FileNotFoundError:
        return Extension()
    except (OSError, SyntaxError, ValueError):  # whoever imports it is told
        return Extension(is_open=True, exists=True)
    attributes: set[str] = set()
    is_open = False
    for node in tree.body:
        if not isinstance(node, ast.ClassDef):
            continue
        is_open |= any(not isinstance(base, ast.Name) or base.id != "Component" for base in node.bases)
        for inner in ast.walk(node):
            match inner:
                case ast.FunctionDef(name="__getattr__" | "__getattribute__"):
                    is_open = True
                case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
                    attributes.add(name)
                case ast.Name(id=name, ctx=ast.Store()):
                    attributes.add(name)
                case ast.Attribute(attr=name, ctx=ast.Store()):
                    attributes.add(name)
    return Extension(frozenset(attributes), is_open, exists=True)
