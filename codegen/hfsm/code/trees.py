"""Parse Python, also from several threads at a time, as the editor does."""

from __future__ import annotations

import ast
import textwrap
import threading
from collections.abc import Iterator
from functools import lru_cache
from typing import Literal, overload

__all__ = ["all_nodes", "own_nodes", "parse_piece", "parse_python"]

_ONE_AT_A_TIME = threading.Lock()
# Until Python 3.13 all threads share the counter of a tree's depth: when another thread gets its turn while
# a tree is made, `ast.parse` fails with `SystemError: AST constructor recursion depth mismatch`.


@overload
def parse_python(source: str | bytes, filename: str = ..., *, mode: Literal["exec"] = ...) -> ast.Module: ...


@overload
def parse_python(source: str | bytes, filename: str = ..., *, mode: Literal["eval"]) -> ast.Expression: ...


def parse_python(source: str | bytes, filename: str = "<unknown>", *, mode: str = "exec") -> ast.AST:
    """Return the tree of a text. Raises what `ast.parse` raises."""
    with _ONE_AT_A_TIME:
        return ast.parse(source, filename, mode)


@lru_cache(maxsize=8192)
def all_nodes(tree: ast.AST) -> tuple[ast.AST, ...]:
    """Return the nodes of a tree as `ast.walk` yields them: many ask for those of the same tree."""
    return tuple(ast.walk(tree))


def own_nodes(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes below one that belong to its scope.

    Of functions and classes these are the parts that Python evaluates where they are defined: decorators,
    default values and base classes. Annotations are not evaluated.
    """
    # Without recursion: a long chain of `elif` or of `+` is deeper than Python's stack.
    pending = [*ast.iter_child_nodes(node)][::-1]
    while pending:
        child = pending.pop()
        yield child
        pending += _in_same_scope(child)[::-1]


def _in_same_scope(node: ast.AST) -> list[ast.AST]:
    match node:
        case ast.FunctionDef(args=arguments) | ast.AsyncFunctionDef(args=arguments):
            return [*node.decorator_list, *_defaults(arguments)]
        case ast.Lambda(args=arguments):
            return [*_defaults(arguments)]
        case ast.ClassDef():
            return [*node.decorator_list, *node.bases, *node.keywords]
    return [*ast.iter_child_nodes(node)]


def _defaults(arguments: ast.arguments) -> Iterator[ast.expr]:
    yield from arguments.defaults
    yield from (default for default in arguments.kw_defaults if default is not None)


def parse_piece(source: str) -> ast.Module | None:
    """Return the tree of statements, or of an expression that may span lines; None for what is no Python."""
    text = textwrap.dedent(source)
    for written in (text, f"(\n{text}\n)"):
        try:
            return parse_python(written if written.strip("(\n )") else "")
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            continue
    return None
