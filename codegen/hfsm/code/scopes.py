"""Find the names that only one piece of code uses, within one cycle, and that nobody else can see.

All code of an automaton shares its names, since one piece may read in a later cycle what another assigned. A
name that a single piece assigns before it reads it, on every path through it, carries nothing from cycle to
cycle: it is local to the piece. When in doubt a name is shared. So is one that is assigned and read nowhere:
somebody wants to see it in the monitor.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable
from typing import Final, TypeGuard

from .text import all_nodes

__all__ = ["INSPECTING", "local_names"]

INSPECTING: Final = frozenset({"dir", "eval", "exec", "globals", "locals", "vars"})
"""Functions that see names which the code does not mention."""
_DEEPEST: Final = 100
"""Levels of statements below one another; code that is nested deeper shares its names."""


def local_names(tree: ast.Module, names: frozenset[str]) -> frozenset[str]:
    """Return those names that are local to a piece of code; `names` are those that no other code has."""
    walker = _Walker(names)
    try:
        walker.block(tree.body, frozenset())
    except _TooDeepError:
        return frozenset()
    return names - walker.shared - _unread(tree)


def _unread(tree: ast.Module) -> frozenset[str]:
    """Return the names that statements assign and nothing reads."""
    assigned: set[str] = set()
    read: set[str] = set()
    for node in all_nodes(tree):
        match node:
            case ast.Assign(targets=targets):
                assigned.update(name.id for each in targets for name in ast.walk(each) if _is_stored(name))
            case ast.AugAssign(target=ast.Name(id=name)):
                assigned.add(name)
            case ast.Name(id=name, ctx=ast.Load()):
                read.add(name)
    return frozenset(assigned - read - {"_"})


def _is_stored(node: ast.AST) -> TypeGuard[ast.Name]:
    return isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)


class _TooDeepError(Exception):
    """The code is nested too deeply to be followed."""


class _Walker:
    """Follow statements with the names that every path to them has assigned; `shared` are the other reads.

    What follows a statement gets None where no path leads on.
    """

    def __init__(self, names: frozenset[str]) -> None:
        self.shared: set[str] = set()
        self._names = names
        self._depth = 0

    def block(self, statements: Iterable[ast.stmt], known: frozenset[str]) -> frozenset[str] | None:
        """Return the names that are assigned after statements."""
        self._depth += 1
        if self._depth > _DEEPEST:
            raise _TooDeepError
        after: frozenset[str] | None = known
        for statement in statements:
            # What cannot be reached assigns nothing, but its names are looked at all the same.
            after = self._statement(statement, known if after is None else after)
        self._depth -= 1
        return after

    def _statement(self, node: ast.stmt, known: frozenset[str]) -> frozenset[str] | None:
        match node:
            case ast.Assign(targets=targets, value=value):
                return self._assign(targets, value, known)
            case ast.AugAssign(target=target, value=value):
                if isinstance(target, ast.Name) and target.id not in known:
                    self.shared.add(target.id)
                return self._assign([target], value, known)
            case ast.If(test=test, body=body, orelse=orelse):
                self._read(test, known)
                return _both(self.block(body, known), self.block(orelse, known))
            case ast.For(target=target, iter=iterable, body=body, orelse=orelse):
                self.block(body, self._assign([target], iterable, known))
                self.block(orelse, known)
                return known
            case ast.While(test=test, body=body, orelse=orelse):
                self._read(test, known)
                self.block(body, known)
                self.block(orelse, known)
                return known
            case ast.With(items=items, body=body):
                inside = known
                for item in items:
                    targets = [] if item.optional_vars is None else [item.optional_vars]
                    inside = self._assign(targets, item.context_expr, inside)
                self.block(body, inside)
                return known  # it may have swallowed an exception
            case ast.Try(body=body, handlers=handlers, orelse=orelse, finalbody=finalbody):
                ends = self.block(body, known)
                ends = None if ends is None else self.block(orelse, ends)
                for handler in handlers:
                    ends = _both(ends, self._handler(handler, known))
                last = self.block(finalbody, known)
                return None if ends is None or last is None else ends | last
            case ast.Import(names=aliases) | ast.ImportFrom(names=aliases):
                return known | {alias.asname or alias.name.split(".")[0] for alias in aliases}
            case ast.Expr(value=value):
                self._read(value, known)
                return known
            case ast.Return() | ast.Raise() | ast.Break() | ast.Continue():
                self._read(node, known)
                return None
            case ast.Assert() | ast.Pass():
                self._read(node, known)
                return known
        # Definitions, `del`, `nonlocal`, `match` and what may come: all names in them are shared.
        self._share(node)
        return known

    def _assign(self, targets: Iterable[ast.expr], value: ast.expr, known: frozenset[str]) -> frozenset[str]:
        """Return the names that are assigned when a value has been assigned to targets."""
        self._read(value, known)
        after = known
        for target in targets:
            self._read(target, known)
            after |= {node.id for node in ast.walk(target) if _is_stored(node)}
        return after

    def _handler(self, handler: ast.ExceptHandler, known: frozenset[str]) -> frozenset[str] | None:
        if handler.type is not None:
            self._read(handler.type, known)
        name = {handler.name} if handler.name else set()
        after = self.block(handler.body, known | name)
        return None if after is None else after - name  # Python deletes it

    def _read(self, node: ast.AST, known: frozenset[str]) -> None:
        """Share the names that an expression reads before they are assigned, or that outlive it."""
        pending = [node]
        while pending:
            child = pending.pop()
            match child:
                case ast.Name(id=name, ctx=ast.Load()) if name not in known:
                    self.shared.add(name)
                case ast.NamedExpr() | ast.Lambda() | ast.GeneratorExp():
                    self._share(child)
                case ast.ListComp() | ast.SetComp() | ast.DictComp():
                    # Its targets are names of its own, and must not pass for those of the piece.
                    targets = [name for each in child.generators for name in ast.walk(each.target)]
                    self.shared |= {each.id for each in targets if isinstance(each, ast.Name)}
                    pending += ast.iter_child_nodes(child)
                case _:
                    pending += ast.iter_child_nodes(child)

    def _share(self, node: ast.AST) -> None:
        # Whatever names it has in whatever way: those of definitions and patterns are no `ast.Name`.
        for child in ast.walk(node):
            for _, value in ast.iter_fields(child):
                found = value if isinstance(value, list) else [value]
                self.shared.update(each for each in found if isinstance(each, str) and each in self._names)


def _both(first: frozenset[str] | None, second: frozenset[str] | None) -> frozenset[str] | None:
    """Return what is assigned after two paths that meet."""
    if first is None or second is None:
        return second if first is None else first
    return first & second
