"""Find what code does with `self`, the component: the attributes behind it, and the call behind them."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from ..code.trees import own_nodes
from .pieces import Piece

__all__ = ["Access", "accesses", "defined_names", "sets_attributes_by_name"]

ALIASES: Final = frozenset({"globalNamespace", "interfaces", "namespace", "rosNode"})
"""What VisualStates calls the component in places; each is the component itself."""


@dataclass(frozen=True, eq=False, slots=True)
class Access:
    """A use of the component: `self.Head.getPose.latest()` has the path Head, getPose, latest and its call.

    `function` is the function of the document in which it stands, if it stands in one. `is_stored` is true
    where the first attribute itself is assigned or deleted.
    """

    piece: Piece
    function: str | None
    path: tuple[str, ...]
    nodes: tuple[ast.Attribute, ...]
    call: ast.Call | None
    is_stored: bool

    @property
    def name(self) -> str:
        """The first attribute."""
        return self.path[0]


def accesses(piece: Piece) -> Iterator[Access]:
    """Yield the uses of the component in a piece of code."""
    if not piece.is_functions:
        yield from _in_nodes(piece, None, list(piece.tree.body), "self")
        return
    for node in piece.tree.body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            arguments = [*node.args.posonlyargs, *node.args.args]
            if arguments and not _is_static(node):
                yield from _in_nodes(piece, node.name, list(node.body), arguments[0].arg)


def defined_names(functions: Piece) -> frozenset[str]:
    """Return the attributes that functions, and what stands among them, give to the component."""
    names: set[str] = set()
    for node in own_nodes(functions.tree):
        match node:
            case ast.Name(id=name, ctx=ast.Store()):
                names.add(name)
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) | ast.ClassDef(name=name):
                names.add(name)
            case ast.alias(name=name, asname=alias):
                names.add(alias or name.split(".")[0])
    return frozenset(names)


def sets_attributes_by_name(piece: Piece) -> bool:
    """Return whether code may give the component attributes whose names do not stand in it."""
    for node in ast.walk(piece.tree):
        match node:
            case ast.Name(id="setattr" | "vars") | ast.Attribute(attr="__dict__" | "__setattr__"):
                return True
            case ast.FunctionDef(name="__getattr__" | "__getattribute__"):
                return True
    return False


def _is_static(function: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    return any(
        isinstance(decorator, ast.Name) and decorator.id == "staticmethod"
        for decorator in function.decorator_list
    )


def _in_nodes(piece: Piece, function: str | None, nodes: list[ast.AST], self_name: str) -> Iterator[Access]:
    pending = nodes[::-1]
    while pending:
        node = pending.pop()
        if isinstance(node, ast.ClassDef):
            continue  # its methods have a `self` of their own
        chain_of = node.func if isinstance(node, ast.Call) else node
        chain = _chain(chain_of, self_name)
        if not chain:
            pending += [*ast.iter_child_nodes(node)][::-1]
            continue
        call = node if isinstance(node, ast.Call) else None
        if call is not None:
            pending += [*call.keywords, *call.args][::-1]
        while len(chain) > 1 and chain[0].attr in ALIASES:
            del chain[0]
        is_stored = len(chain) == 1 and not isinstance(chain[0].ctx, ast.Load)
        path = tuple(attribute.attr for attribute in chain)
        yield Access(piece, function, path, tuple(chain), call, is_stored)


def _chain(node: ast.AST, self_name: str) -> list[ast.Attribute]:
    """Return the attributes from `self` on, or nothing when a node does not begin with `self`."""
    found: list[ast.Attribute] = []
    while isinstance(node, ast.Attribute):
        found.append(node)
        node = node.value
    return found[::-1] if isinstance(node, ast.Name) and node.id == self_name else []
