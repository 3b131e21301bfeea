"""How long tests wait stands in one place: tests/support/limits.py."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from typing import Final

from tools.lint.sources import ROOT, TESTS

SHORT: Final = 5.0
"""A test that looks whether something times out waits for less than this many s."""
WAITS: Final = frozenset(
    {"communicate", "exception", "get", "join", "result", "run", "samples", "wait", "waitForShutdown"}
)
"""Functions that wait for at most `timeout` s."""
TAKE_IT_FIRST: Final = frozenset({"exception", "join", "result", "wait", "waitForShutdown"})
"""Those whose first argument it is."""
SUSPECT: Final = re.compile(
    rf"(?:\btimeout\s*=|\b(?:{'|'.join(sorted(TAKE_IT_FIRST))})\s*\(|\bmonotonic\(\)\s*\+)[\s(]*[\d.]"
)
"""What a text with such a limit has: to parse all texts takes ten times as long as to look for it."""


def mistakes() -> Iterator[str]:
    """Yield the waits whose limit is a number."""
    for path in sorted(TESTS.rglob("*.py")):
        if "node_modules" not in path.parts and SUSPECT.search(text := path.read_text("utf-8")):
            for line in _literal_limits(ast.parse(text)):
                yield f"{path.relative_to(ROOT)}:{line}: take a limit of tests/support/limits.py"


def _literal_limits(tree: ast.AST) -> Iterator[int]:
    """Yield the lines in which the limit of a wait is a number."""
    for node in ast.walk(tree):
        match node:
            case ast.Call(func=ast.Name(id=name) | ast.Attribute(attr=name), args=args, keywords=keywords):
                named = [keyword.value for keyword in keywords if keyword.arg == "timeout"]
                if (name in WAITS and any(map(_is_long, named))) or (
                    name in TAKE_IT_FIRST and args and _is_long(args[0])
                ):
                    yield node.lineno
            case ast.BinOp(left=left, op=ast.Add(), right=right):
                if ast.unparse(left) == "time.monotonic()" and _is_long(right):
                    yield node.lineno


def _is_long(value: ast.expr) -> bool:
    """Return whether an expression is a number of s that is no short wait."""
    if not isinstance(value, ast.Constant) or isinstance(value.value, bool):
        return False
    return isinstance(value.value, int | float) and value.value >= SHORT
