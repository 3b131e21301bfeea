"""Parse an expression of Python on any thread."""

from __future__ import annotations

import ast
import threading
from typing import Final

_PARSE_ATTEMPTS: Final = 3

_ONE_AT_A_TIME: Final = threading.Lock()


def parse_expression(text: str) -> ast.Expression:
    """Return the tree of an expression. Raises the same errors as `ast.parse`.

    Until Python 3.13 all threads share a counter of the tree's depth: where other code parses meanwhile, even
    a finalizer, `ast.parse` fails with `SystemError: AST constructor recursion depth mismatch`.
    """
    with _ONE_AT_A_TIME:
        for _ in range(_PARSE_ATTEMPTS - 1):
            try:
                return ast.parse(text, mode="eval")
            except SystemError:
                continue
        return ast.parse(text, mode="eval")
