"""Find the hand-written code beside a component: `NAME_ext.py` with a class that becomes one of its bases."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from pathlib import Path

from ..diagnostics import Diagnostics, Location, Note
from .code.names import camel_case, component_name, identifier
from .code.text import parse_python
from .codes import Code

__all__ = ["Extension", "ExtensionClass", "extension_path", "find_extension", "read_extension"]


@dataclass(frozen=True, slots=True)
class Extension:
    """The attributes that the extension of a component has; `is_open` when it may have others, too."""

    attributes: frozenset[str] = frozenset()
    is_open: bool = False
    exists: bool = False


@dataclass(frozen=True, slots=True)
class ExtensionClass:
    """The hand-written base of a component: its module, which lies beside the component, and its class."""

    module: str
    class_name: str


def extension_path(component: Path) -> Path:
    """Return where the extension of a component lies, if it has one."""
    return component.with_name(f"{component.stem}_ext.py")


def read_extension(document: Path) -> Extension:
    """Return the extension that lies beside a document, or an empty one when there is no such file."""
    if not document.name:
        return Extension()
    path = extension_path(document.with_stem(identifier(document.stem, "component")))
    try:
        tree = parse_python(path.read_bytes())
    except FileNotFoundError:
        return Extension()
    except (OSError, SyntaxError, ValueError, RecursionError, MemoryError):  # reported where it is loaded
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


def find_extension(document: Path, component: Path, diagnostics: Diagnostics) -> ExtensionClass | None:
    """Return the extension of the component of a document; None when there is none, or after an error.

    `component` is the file that will be generated. The extension is read, and nothing of it is run.
    """
    path = extension_path(component)
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        return None
    except OSError as error:
        diagnostics.error(
            Code.EXTENSION_WITHOUT_CLASS, f"cannot be read: {error.strerror or error}", Location(path)
        )
        return None
    diagnostics.add_source(path, content.decode("utf-8", errors="replace"))
    try:
        tree = parse_python(content, filename=str(path))
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        place = Location(path, getattr(error, "lineno", None) or 1, getattr(error, "offset", None) or 1)
        reason = error.msg if isinstance(error, SyntaxError) else str(error)
        diagnostics.error(Code.EXTENSION_WITHOUT_CLASS, f"not valid Python: {reason}", place)
        return None
    wanted = f"{camel_case(component_name(document.stem))}Extension"
    if any(isinstance(node, ast.ClassDef) and node.name == wanted for node in tree.body):
        return ExtensionClass(path.stem, wanted)
    message = f"there is no class `{wanted}`, which extends the component of {document.name}"
    diagnostics.error(
        Code.EXTENSION_WITHOUT_CLASS, message, Location(path, 1), [Note("write it, or rename the file")]
    )
    return None
