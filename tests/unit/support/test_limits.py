"""How long tests wait stands in one place: tests/support/limits.py."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support import limits
from tests.support.places import ROOT

SHORT = 5.0
"""A test that looks whether something times out waits for less than this many s."""
WAITS = frozenset(
    {"communicate", "exception", "get", "join", "result", "run", "samples", "wait", "waitForShutdown"}
)
"""Functions that wait for at most `timeout` s."""
TAKE_IT_FIRST = frozenset({"exception", "join", "result", "wait", "waitForShutdown"})
"""Those whose first argument it is."""
SUSPECT = re.compile(
    rf"(?:\btimeout\s*=|\b(?:{'|'.join(sorted(TAKE_IT_FIRST))})\s*\(|\bmonotonic\(\)\s*\+)[\s(]*[\d.]"
)
"""What a text with such a limit has: to parse all texts takes ten times as long as to look for it."""
LIMITS = [name for name in limits.__all__ if name.endswith("_LIMIT")]


def long(value: ast.expr | None) -> bool:
    """Return whether an expression is a number of s that is no short wait."""
    if not isinstance(value, ast.Constant) or isinstance(value.value, bool):
        return False
    return isinstance(value.value, int | float) and value.value >= SHORT


def literal_limits(tree: ast.AST) -> Iterator[int]:
    """Yield the lines in which the limit of a wait is a number."""
    for node in ast.walk(tree):
        match node:
            case ast.Call(func=ast.Name(id=name) | ast.Attribute(attr=name), args=args, keywords=keywords):
                named = [keyword.value for keyword in keywords if keyword.arg == "timeout"]
                if (name in WAITS and any(map(long, named))) or (
                    name in TAKE_IT_FIRST and args and long(args[0])
                ):
                    yield node.lineno
            case ast.BinOp(left=left, op=ast.Add(), right=right):
                if ast.unparse(left) == "time.monotonic()" and long(right):
                    yield node.lineno


@pytest.mark.parametrize(
    "code",
    [
        "subprocess.run(command, timeout=60)",
        "seen.get(timeout=10.0)",
        "thread.join(20)",
        "deadline = time.monotonic() + 30",
    ],
)
def test_a_limit_that_is_a_number_is_found(code: str) -> None:
    assert SUSPECT.search(code)
    assert list(literal_limits(ast.parse(code))) == [1]


@pytest.mark.parametrize(
    "code",
    [
        "thread.join(EVENT_LIMIT)",
        "stream.wait(timeout=0.05)",
        "clock.wait(event, 60.0)",
        "gate.acquire(60.0)",
        "now = time.monotonic() + pause",
    ],
)
def test_what_is_none_is_not(code: str) -> None:
    assert list(literal_limits(ast.parse(code))) == []


@pytest.mark.slow
def test_limits_of_waits_are_named() -> None:
    texts = {
        path.relative_to(ROOT): path.read_text("utf-8")
        for path in sorted(Path(ROOT, "tests").rglob("*.py"))
        if "node_modules" not in path.parts
    }
    found = [
        f"{path}:{line}"
        for path, text in texts.items()
        if SUSPECT.search(text)
        for line in literal_limits(ast.parse(text))
    ]
    assert found == [], "these waits have numbers for limits: take those of tests/support/limits.py"


@pytest.mark.parametrize("name", LIMITS)
def test_what_takes_forever_takes_longer_than_every_limit(name: str) -> None:
    assert getattr(limits, name) < limits.FOREVER


def test_what_happens_at_once_does_so_before_the_longest_call_ends() -> None:
    assert limits.EVENT_LIMIT < limits.LONGEST_CALL
    assert limits.CALL_LIMIT <= limits.LONGEST_CALL
