"""Find the local names of a piece of code: no other code uses them, and they keep nothing between cycles.

All code of an automaton shares its names, since one piece may read in a later cycle what another has
assigned. A name is local to a piece if no other piece uses it and every path through the piece assigns it
before reading it. In case of doubt a name is shared. A name that is assigned but never read is also shared,
so that the monitor shows it. `free_names` finds the opposite: the names that code takes from outside.
"""

from __future__ import annotations

import ast
import symtable
from functools import lru_cache
from typing import Final

from .text import all_nodes

INSPECTING: Final = frozenset({"dir", "eval", "exec", "globals", "locals", "vars"})
"""Functions that can use names which the code does not mention."""


@lru_cache(maxsize=2048)
def free_names(source: str) -> frozenset[str]:
    """Return the names that the text of a file reads in functions and classes and that none of them binds.

    A text that Python refuses has none.
    """
    found: set[str] = set()
    try:
        pending = symtable.symtable(source, "<document>", "exec").get_children()
    except SyntaxError:
        return frozenset()
    for table in pending:  # grows
        found |= {
            each.get_name() for each in table.get_symbols() if each.is_global() and each.is_referenced()
        }
        pending += table.get_children()
    return frozenset(found)


def local_names(tree: ast.Module, names: frozenset[str]) -> frozenset[str]:
    """Return the names that are local to a piece of code; `names` are those that no other code uses."""
    walker = _Walker(names)
    walker.walk(*tree.body)
    return names - walker.shared - _unread(tree)


def _unread(tree: ast.Module) -> frozenset[str]:
    """Return the names that statements assign and that are never read."""
    assigned: set[str] = set()
    read: set[str] = set()
    for node in all_nodes(tree):
        match node:
            case ast.Assign(targets=targets):
                names = (name for each in targets for name in ast.walk(each) if isinstance(name, ast.Name))
                assigned.update(name.id for name in names if isinstance(name.ctx, ast.Store))
            case ast.AugAssign(target=ast.Name(id=name)):
                assigned.add(name)
            case ast.Name(id=name, ctx=ast.Load()):
                read.add(name)
    return frozenset(assigned - read - {"_"})


_Known = frozenset[str] | None
"""The names that every path to a place has assigned; None if the place is unreachable."""


class _Walker:
    """Walk code in the order of evaluation; `shared` collects the names that cannot be local."""

    def __init__(self, names: frozenset[str]) -> None:
        self.shared: set[str] = set()
        self._names = names
        self._known: _Known = frozenset()

    def walk(self, *nodes: ast.AST) -> None:
        for node in nodes:
            self._node(node)

    def _after(self, known: _Known, *nodes: ast.AST) -> _Known:
        """Return the names that are assigned after nodes, given those that are assigned before them."""
        self._known = known
        self.walk(*nodes)
        return self._known

    def _node(self, node: ast.AST) -> None:
        known = self._known
        match node:
            case ast.Name(id=name, ctx=ast.Load()):
                self.shared |= {name} - (known or frozenset())
            case ast.Name(id=name, ctx=ast.Store()):
                self._known = None if known is None else known | {name}
            case ast.alias(name=name, asname=alias):
                self._known = None if known is None else known | {alias or name.split(".")[0]}
            case ast.Assign(targets=targets, value=value):
                self.walk(value, *targets)
            case ast.AugAssign(target=target, value=value):
                if isinstance(target, ast.Name):
                    self.shared |= {target.id} - (known or frozenset())
                self.walk(value, target)
            case ast.If(test=test, body=body, orelse=orelse):
                self.walk(test)
                known = self._known
                self._known = _both(self._after(known, *body), self._after(known, *orelse))
            case ast.For(target=target, iter=iterable, body=body, orelse=orelse):
                known = self._after(known, iterable)
                self._after(known, target, *body)
                self._after(known, *orelse)
                self._known = known
            case ast.While(test=test, body=body, orelse=orelse):
                known = self._after(known, test)
                self._after(known, *body)
                self._after(known, *orelse)
                self._known = known
            case ast.With(items=items, body=body):
                self.walk(*items, *body)
                self._known = known  # it may have suppressed an exception
            case ast.Try(body=body, handlers=handlers, orelse=orelse, finalbody=finalbody):
                end = self._after(known, *body, *orelse)
                for handler in handlers:
                    end = _both(end, self._handler(handler, known))
                last = self._after(known, *finalbody)
                self._known = None if end is None or last is None else end | last
            case ast.Return() | ast.Raise() | ast.Break() | ast.Continue():
                self.walk(*ast.iter_child_nodes(node))
                self._known = None
            case ast.ListComp() | ast.SetComp() | ast.DictComp():
                # Its targets have their own scope, and must not count as names of the piece.
                inside = (name for each in node.generators for name in ast.walk(each.target))
                self.shared |= {each.id for each in inside if isinstance(each, ast.Name)}
                self.walk(*ast.iter_child_nodes(node))
                self._known = known
            case ast.NamedExpr() | ast.Lambda() | ast.GeneratorExp():
                self._share(node)
            case ast.Import() | ast.ImportFrom() | ast.Expr() | ast.Assert() | ast.Pass():
                self.walk(*ast.iter_child_nodes(node))
            case ast.stmt():  # definitions, `del`, `nonlocal`, `match` and future statements
                self._share(node)
            case _:
                self.walk(*ast.iter_child_nodes(node))

    def _handler(self, handler: ast.ExceptHandler, known: _Known) -> _Known:
        name = {handler.name} if handler.name else set[str]()
        known = self._after(known, *([] if handler.type is None else [handler.type]))
        after = self._after(None if known is None else known | name, *handler.body)
        return None if after is None else after - name  # Python deletes it

    def _share(self, node: ast.AST) -> None:
        # All names in the node: those of definitions and patterns are not `ast.Name`.
        for child in ast.walk(node):
            for _, value in ast.iter_fields(child):
                found = value if isinstance(value, list) else [value]
                self.shared.update(each for each in found if isinstance(each, str) and each in self._names)


def _both(first: _Known, second: _Known) -> _Known:
    """Return the names that are assigned after two paths join."""
    if first is None or second is None:
        return second if first is None else first
    return first & second
