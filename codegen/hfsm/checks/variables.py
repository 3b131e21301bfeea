"""Find variables, inputs and parameters that nothing reads."""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterator
from typing import Final

from ..analysis import AutomatonCode, Piece
from ..code.names import RESERVED
from ..code.trees import own_nodes
from .report import Report

__all__ = ["check_start", "check_variables"]

_READERS: Final = frozenset({"dir", "eval", "exec", "locals", "vars"})
"""Builtins that may read any variable."""


def check_variables(code: AutomatonCode, report: Report) -> None:
    """Check the variables and inputs of one automaton; a name that begins with _ is meant to be unused."""
    if code.broken:
        return
    read = set(RESERVED)  # who assigns one of these is told when the component is generated
    for piece in code.sharing():
        read.update(piece.reads)
    if not read.isdisjoint(_READERS):
        return
    for declared in code.automaton.inputs:
        name = declared.name.strip()
        if name not in read and not name.startswith("_"):
            report.warning("W521", f"nothing reads the input `{name}`", report.place(declared))
    told: set[str] = set()
    for piece in code.sharing():
        for target in _plain_targets(piece):
            name = target.id
            if name not in read and name not in told and not name.startswith("_"):
                told.add(name)
                message = f"nothing reads the variable `{name}`"
                report.warning("W521", message, piece.place(target, len(name)))


def check_start(code: AutomatonCode, own: Collection[str], report: Report) -> None:
    """Report events and waits in the variables; `own` are the attributes that the document itself defines."""
    if code.variables is None:
        return
    for node in own_nodes(code.variables.tree):
        match node:
            case ast.Call(func=ast.Attribute(ast.Name("self"), "send" | "sleep" as name)) if name not in own:
                message = f"`self.{name}` is for entry code: no automaton runs when variables are set"
                report.error("E520", message, code.variables.place(node))


def _plain_targets(piece: Piece) -> Iterator[ast.Name]:
    """Yield what is assigned by itself; parts of a tuple and loop variables may be there for their place."""
    for node in own_nodes(piece.tree):
        match node:
            case ast.Assign(targets=targets):
                yield from (target for target in targets if isinstance(target, ast.Name))
            case ast.AnnAssign(target=ast.Name() as target):
                yield target
