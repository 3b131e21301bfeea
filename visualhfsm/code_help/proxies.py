"""The operations of interfaces, read from the proxy classes that codegen generated; nothing is imported."""

from __future__ import annotations

import ast
import builtins
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final

from codegen.hfsm.known_interfaces import KnownInterface

__all__ = ["STREAM", "DescribedOperation", "describe_operations", "typed_proxy"]

STREAM: Final = "_Stream"
"""Ends the name of the class that stands for a streamed operation."""
SAMPLE: Final = "_Sample"
_MOST_BASES: Final = 100
_DEEPEST: Final = 8


@dataclass(frozen=True, slots=True)
class DescribedOperation:
    """A method of a proxy as it stands in its `module`; `result` is what it returns, as Python."""

    name: str
    signature: str
    result: str
    documentation: str
    is_streamed: bool
    module: str


def describe_operations(known: KnownInterface) -> list[DescribedOperation]:
    """Return the operations of an interface and of those that it extends."""
    found: dict[str, DescribedOperation] = {}
    for module, proxy in _classes(known.file, known.proxy):
        for node in proxy.body:
            if isinstance(node, ast.FunctionDef):
                found.setdefault(node.name, _describe(node, module))
    return list(found.values())


def typed_proxy(known: KnownInterface, name: str) -> str:
    """Return the source of a class `name`: the proxy of an interface, with its operations spelled out.

    A tool that follows no descriptors understands it. It belongs into a module that imports `StreamedCall`
    and `Iterator`.
    """
    package = f"_{name}_interface"
    lines = [f"import {_module_name(known.file)} as {package}"]
    body: list[str] = []
    for operation in describe_operations(known):
        module = f"_{name}_{operation.name}"
        lines.append(f"import {operation.module} as {module}")
        result = _qualified(operation.result, module)
        body += _stream(operation, result) if operation.is_streamed else _method(operation, result)
    return "\n".join([*lines, f"class {name}({package}.{known.proxy}):", *(body or ["    pass"]), ""])


def _method(operation: DescribedOperation, result: str) -> list[str]:
    return [
        f"    def {operation.name}{operation.signature} -> {result}:",
        f"        {operation.documentation!r}",
    ]


def _stream(operation: DescribedOperation, result: str) -> list[str]:
    name = operation.name
    return [
        f"    class _{name}{SAMPLE}:",
        "        'A value that a stream brought.'",
        f"        value: {result}",
        "        age: float",
        "        time: float",
        "        wall_time: float",
        "        sequence: int",
        f"    class _{name}{STREAM}(StreamedCall):",
        f"        {operation.documentation!r}",
        f"        def __call__{operation.signature} -> {result}:",
        f"            {operation.documentation!r}",
        f"        def latest(self) -> _{name}{SAMPLE}:",
        "            'Return the newest sample without a round trip, or None before the first has come.'",
        f"        def wait(self, after=None, timeout=None) -> _{name}{SAMPLE}:",
        "            'Return the next sample newer than `after`, or the newest at once without `after`.'",
        f"        def samples(self, timeout=None) -> Iterator[_{name}{SAMPLE}]:",
        "            'Yield sample after sample, always the newest.'",
        f"    {name}: _{name}{STREAM}",
    ]


def _describe(node: ast.FunctionDef, module: str) -> DescribedOperation:
    streamed = any(
        isinstance(each, ast.Call) and isinstance(each.func, ast.Attribute) and each.func.attr == "stream"
        for each in node.decorator_list
    )
    return DescribedOperation(
        name=node.name,
        signature=f"({ast.unparse(node.args)})",
        result=ast.unparse(node.returns) if node.returns else "None",
        documentation=ast.get_docstring(node) or "",
        is_streamed=streamed,
        module=module,
    )


def _classes(file: Path, name: str) -> Iterator[tuple[str, ast.ClassDef]]:
    """Yield a proxy class and those that it extends, each with the name of its module."""
    pending = [(file, name)]
    seen: set[tuple[Path, str]] = set()
    while pending and len(seen) < _MOST_BASES:
        where = pending.pop(0)
        tree = _tree(where[0], _changed(where[0])) if where not in seen else None
        seen.add(where)
        if tree is None:
            continue
        for node in tree.body:
            if isinstance(node, ast.ClassDef) and node.name == where[1]:
                yield _module_name(where[0]), node
                bases = {base.id for base in node.bases if isinstance(base, ast.Name)}
                imported = _imports(tree, where[0])
                pending += [imported.get(base, (where[0], base)) for base in sorted(bases)]


def _imports(tree: ast.Module, file: Path) -> dict[str, tuple[Path, str]]:
    """Return the files that names come from which are imported relative to a file."""
    found: dict[str, tuple[Path, str]] = {}
    for node in tree.body:
        if isinstance(node, ast.ImportFrom) and node.level and node.module:
            source = file.parents[node.level - 1].joinpath(*node.module.split(".")).with_suffix(".py")
            found |= {alias.asname or alias.name: (source, alias.name) for alias in node.names}
    return found


def _changed(file: Path) -> int:
    try:
        return file.stat().st_mtime_ns
    except OSError:
        return 0


@lru_cache(maxsize=64)
def _tree(file: Path, _changed: int) -> ast.Module | None:
    try:
        return ast.parse(file.read_bytes())
    except (OSError, SyntaxError, ValueError):  # then nothing is known of it
        return None


def _module_name(file: Path) -> str:
    """Return by what name a module is imported: all packages above it belong to it."""
    parts = [file.stem]
    for parent in list(file.parents)[:_DEEPEST]:
        if not (parent / "__init__.py").is_file():
            break
        parts.insert(0, parent.name)
    return ".".join(parts)


class _Qualify(ast.NodeTransformer):
    def __init__(self, module: str) -> None:
        self._module = module

    def visit_Name(self, node: ast.Name) -> ast.expr:
        if hasattr(builtins, node.id):
            return node
        return ast.Attribute(ast.Name(self._module, ast.Load()), node.id, ast.Load())


def _qualified(annotation: str, module: str) -> str:
    """Return an annotation as it is written outside of its module."""
    return ast.unparse(_Qualify(module).visit(ast.parse(annotation, mode="eval")))
