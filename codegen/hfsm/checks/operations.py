"""Know what can be called through a proxy: its methods, read from the proxy class that codegen generated."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final

from ..code.trees import parse_python
from ..known_interfaces import KnownInterface

__all__ = ["STREAM", "Operation", "operations_of"]

_BASE: Final = "ObjectPrx"
"""The proxy class that all others extend; its own methods begin with `ice_`."""
_MAX_BASES: Final = 100


@dataclass(frozen=True, slots=True)
class Operation:
    """A method of a proxy: its parameters after `self`, how many of them have no default, and its stream."""

    name: str
    parameters: tuple[str, ...]
    required: int
    is_streamed: bool = False
    by_name: frozenset[str] = frozenset()
    """Further parameters, which are given by name."""


STREAM: Final = {
    "latest": Operation("latest", (), 0),
    "wait": Operation("wait", ("after", "timeout"), 0),
    "samples": Operation("samples", ("timeout",), 0, by_name=frozenset({"rate"})),
    "subscribe": Operation("subscribe", ("callback",), 1, by_name=frozenset({"rate", "queue"})),
}
"""What a streamed operation offers beside its call."""


def operations_of(interface: KnownInterface) -> dict[str, Operation] | None:
    """Return the operations of an interface with those that it inherits, by the names of their methods.

    None when not all of them are known: a proxy that was written by hand may do anything.
    """
    found: dict[str, Operation] = {}
    pending = [(interface.file, interface.proxy)]
    seen: set[tuple[Path, str]] = set()
    while pending:
        file, name = pending.pop()
        if (file, name) in seen or len(seen) > _MAX_BASES:
            continue
        seen.add((file, name))
        module = _module(file)
        if module is None:
            return None
        proxy = module.classes.get(name)
        if proxy is None:
            source = module.imports.get(name)
            if source is None:
                return None
            pending.append(source)
            continue
        for operation in _methods(proxy):
            found.setdefault(operation.name, operation)
        for base in proxy.bases:
            if not isinstance(base, ast.Name):
                return None
            if base.id != _BASE:
                pending.append((file, base.id))
    return found or None


@dataclass(frozen=True, slots=True)
class _Module:
    classes: dict[str, ast.ClassDef]
    imports: dict[str, tuple[Path, str]]


def _module(file: Path) -> _Module | None:
    try:
        return _parse(file, file.stat().st_mtime_ns)
    except (OSError, SyntaxError, ValueError):  # then nothing is known of it
        return None


@lru_cache(maxsize=64)
def _parse(file: Path, _changed: int) -> _Module:
    tree = parse_python(file.read_bytes())
    classes = {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}
    imports: dict[str, tuple[Path, str]] = {}
    for node in tree.body:
        if isinstance(node, ast.ImportFrom) and node.level:
            directory = file.parents[node.level - 1]
            source = directory.joinpath(*(node.module or "__init__").split("."))
            target = source / "__init__.py" if source.is_dir() else source.with_suffix(".py")
            imports.update({alias.asname or alias.name: (target, alias.name) for alias in node.names})
    return _Module(classes, imports)


def _methods(proxy: ast.ClassDef) -> list[Operation]:
    found = []
    for node in proxy.body:
        if not isinstance(node, ast.FunctionDef) or node.args.vararg or node.args.kwarg:
            continue
        names = [argument.arg for argument in node.args.args[1:]]
        required = len(names) - len(node.args.defaults)
        streamed = any(
            isinstance(decorator, ast.Call)
            and isinstance(decorator.func, ast.Name)
            and decorator.func.id == "streamed"
            for decorator in node.decorator_list
        )
        found.append(Operation(node.name, tuple(names), required, streamed))
    return found
