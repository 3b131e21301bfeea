"""Parse Python on any thread."""

from __future__ import annotations

import ast
import threading
from typing import Final, Literal, overload

_ATTEMPTS: Final = 3
_ONE_AT_A_TIME: Final = threading.Lock()


@overload
def parse_python(source: str | bytes, filename: str = ..., *, mode: Literal["exec"] = ...) -> ast.Module: ...


@overload
def parse_python(source: str | bytes, filename: str = ..., *, mode: Literal["eval"]) -> ast.Expression: ...


def parse_python(source: str | bytes, filename: str = "<unknown>", *, mode: str = "exec") -> ast.AST:
    """Return the tree of a text. Raises the same errors as `ast.parse`.

    Until Python 3.13 all threads share a counter of the tree's depth: where other code parses meanwhile, even
    a finalizer, `ast.parse` fails with `SystemError: AST constructor recursion depth mismatch`.
    """
    with _ONE_AT_A_TIME:
        for _ in range(_ATTEMPTS - 1):
            try:
                return ast.parse(source, filename, mode)
            except SystemError:
                continue
        return ast.parse(source, filename, mode)
