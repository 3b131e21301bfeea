"""Find the lists, tuples and tables of constants that nothing changes: what code takes out of them is known.

A name is one if all that it is given are such literals, and code only takes items from it, goes through it,
or asks what is in it. Who passes it on, changes it or gives it another name may change it.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from typing import Final

from ._definitions import finder_of
from .analysis import Analysis
from .code.text import all_nodes, binds, child_nodes, own_nodes

Items = list[tuple[ast.expr, ast.expr]]
"""Keys and values; of lists and tuples the indices are the keys."""
_READING: Final = frozenset({"count", "get", "index", "items", "keys", "values"})
_LITERAL: Final = (ast.Constant, ast.Tuple, ast.UnaryOp, ast.unaryop, ast.expr_context)


def literals_of(analysis: Analysis) -> dict[str, Items]:
    """Return the items of such literals by name; that of an attribute begins with a dot."""
    found: dict[str, Items] = {}
    is_found = False
    """Whether code may find any attribute by its name."""
    changed = {name for automaton in analysis.document.automata for name in automaton.declared}
    changed |= {
        each.variable.text.strip() for _, state in analysis.document.states() for each in state.results
    }
    for piece in analysis.pieces:
        parents = {child: node for node in all_nodes(piece.tree) for child in child_nodes(node)}
        inside = frozenset(own_nodes(piece.tree)) if piece.is_functions else frozenset()
        for node in all_nodes(piece.tree):
            parent = parents.get(node)
            for name, value in _stored(node, parent):
                dot = "." if node in inside or isinstance(node, ast.Attribute) else ""
                items = None if value is None else _items(value)
                if items is None:
                    changed.add(f"{dot}{name}")
                else:
                    found.setdefault(f"{dot}{name}", []).extend(items)
            match node:
                case ast.Name(id=name, ctx=ast.Load()) if not _only_reads(node, parent):
                    changed.add(f".{name}" if node in inside else name)
                case ast.Attribute(attr=name, ctx=ast.Load()) if not _only_reads(node, parent):
                    changed.add(f".{name}")
                case ast.Call(args=given) if finder_of(node.func, analysis.libraries):
                    texts = [each.value for each in given[:2] if isinstance(each, ast.Constant)]
                    changed |= {f".{each!s}" for each in texts}
                    is_found = is_found or not texts
    return {
        name: items for name, items in found.items() if not (name in changed or (is_found and name[0] == "."))
    }


def _stored(node: ast.AST, parent: ast.AST | None) -> Iterator[tuple[str, ast.expr | None]]:
    """Yield the names that a node binds, each with the expression that it is given alone, if there is one."""
    match node:
        case ast.Name(id=name, ctx=ast.Store()) | ast.Attribute(attr=name, ctx=ast.Store()):
            is_alone = isinstance(parent, ast.Assign) and node in parent.targets and len(parent.targets) == 1
            yield name, parent.value if is_alone and isinstance(parent, ast.Assign) else None
        case ast.Attribute(attr=name, ctx=ast.Del()):
            yield name, None
        case ast.arg(arg=name):
            yield name, None
        case ast.Global(names=names):
            yield from ((name, None) for name in names)
        case _:
            yield from ((name, None) for name in binds(node))


def _items(node: ast.expr) -> Items | None:
    """Return the items of a literal of constants; None for anything else."""
    match node:
        case ast.List(elts=values) | ast.Tuple(elts=values):
            items: Items = [(ast.Constant(number), value) for number, value in enumerate(values)]
        case ast.Dict(keys=keys, values=values):
            items = [
                (key or ast.Name("", ast.Load()), value) for key, value in zip(keys, values, strict=True)
            ]
        case _:
            return None
    parts = (part for pair in items for each in pair for part in ast.walk(each))
    return [*items] if items and all(isinstance(each, _LITERAL) for each in parts) else None


def _only_reads(node: ast.AST, parent: ast.AST | None) -> bool:
    """Return whether what is read here only gives an item, or says what is in it."""
    match parent:
        case ast.Subscript(value=value, slice=index, ctx=ast.Load()):
            return value is node and not isinstance(index, ast.Slice)
        case ast.For(iter=through) | ast.comprehension(iter=through):
            return through is node
        case ast.Compare(ops=operators, comparators=others):
            return node in others and all(isinstance(each, ast.In | ast.NotIn) for each in operators)
        case ast.Attribute(attr=name):
            return name in _READING
        case ast.Call(func=ast.Name(id=name), args=given):
            return node in given and name in ("enumerate", "len", "reversed", "sorted", "tuple")
        case ast.Call(func=ast.Attribute(attr="choice"), args=[given]):
            return given is node
    return False
