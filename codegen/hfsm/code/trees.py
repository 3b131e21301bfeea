"""Parse Python, also from several threads at a time, as the editor does."""

from __future__ import annotations

import ast
import threading
from typing import Literal, overload

__all__ = ["parse_python"]

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
