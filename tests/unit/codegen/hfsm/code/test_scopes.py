"""Names that one piece of code assigns and uses within a cycle are local to it; all others are shared."""

from __future__ import annotations

import random
import re
import textwrap
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from codegen.hfsm.analysis import AutomatonCode, Piece, analyze
from codegen.hfsm.document import Automaton, Document, Parameter, State, Text
from tests.support.examples import examples


def automaton_of(*codes: str, inputs: tuple[str, ...] = ()) -> AutomatonCode:
    """Return an automaton with a state for each piece of code."""
    states = [State(id=n, name=f"s{n}", code=Text(code, 1, 1)) for n, code in enumerate(codes, 1)]
    declared = tuple(Parameter(name=name) for name in inputs)
    document = Document(automata=(Automaton(id=1, states=tuple(states), inputs=declared),))
    (found,) = analyze(document, Path("test.xml")).automata
    return found


def local(code: str, *others: str, inputs: tuple[str, ...] = ()) -> set[str]:
    automaton = automaton_of(code, *others, inputs=inputs)
    first, *_ = automaton.by_owner.values()
    return set(first.bound - automaton.shared_names(first))


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        ("ball = look()\nif ball: go(ball)", {"ball"}),
        ("if a:\n  x = 1\nelse:\n  x = 2\nuse(x)", {"x"}),
        ("if a:\n  x = 1\nelif b:\n  return\nelse:\n  raise E\nuse(x)", {"x"}),
        ("for i in range(3):\n  j = i\n  use(i, j)", {"i", "j"}),
        ("try:\n  f()\nexcept E as e:\n  use(e)", {"e"}),
        ("try:\n  x = f()\nexcept E:\n  return\nuse(x)", {"x"}),
        ("with f() as g:\n  use(g)", {"g"}),
        ("import time\nx, (y, *z) = time.f()\nuse(x, y, z)", {"time", "x", "y", "z"}),
        ("x = [1]\nuse([a + i for i in x])", {"x"}),
        ("x = 1\nx += 1\nuse(x)", {"x"}),
        ("for i in range(3): f()", {"i"}),
        ("_, x = f()\nuse(x)", {"_", "x"}),
    ],
)
def test_what_is_assigned_before_it_is_read_is_local(code: str, expected: set[str]) -> None:
    assert local(code) == expected


@pytest.mark.parametrize(
    "code",
    [
        "use(x)\nx = 1",
        "x += 1",
        "if a: x = 1\nuse(x)",
        "while a: x = 1\nuse(x)",
        "for x in a: pass\nuse(x)",
        "try:\n  x = f()\nexcept E: pass\nuse(x)",
        "with f():\n  x = 1\nuse(x)",
        "match a:\n  case 1: x = 1\nuse(x)",
        "x = 1\nlater(lambda: x)",
        "x = 1\ndef f(): return x\nkeep(f)",
        "x = 1\nkeep(x for _ in a)",
        "if (x := f()): pass",
        "x = 1\nuse(eval('x'))",
        "x = 1\ndel x",
        "try:\n  f()\nexcept E as x: pass\nuse(x)",
        "use([x for x in a])\nx = 1\nuse(x)",
    ],
)
def test_what_a_later_cycle_or_a_function_may_see_is_shared(code: str) -> None:
    assert "x" not in local(code)


@pytest.mark.parametrize("code", ["x = 1", "x = 1\nx += 1", "y, [x] = f()\nuse(y)"])
def test_what_nothing_reads_is_shared_for_the_monitor_to_show(code: str) -> None:
    assert "x" not in local(code)


@pytest.mark.parametrize("other", ["use(x)", "x = 2", "y = lambda: x", "def f():\n  nonlocal x\n  x = 1"])
def test_what_other_code_mentions_is_shared(other: str) -> None:
    assert local("x = 1\nuse(x)", other) == set()


def test_variables_and_inputs_are_shared() -> None:
    assert local("x = y = 1\nuse(x, y)", inputs=("x",)) == {"y"}


_SIMPLE = [
    "x = next(n)", "y = next(n)", "out(x)", "out(y)", "x, y = y, x", "x += 1", "z = x", "out(z)",
    "import math as y", "out([z for z in (x,)])", "f = lambda: x", "out(f())", "return", "1 / 0",
    "if (z := next(n)) % 2: out(z)",
]  # fmt: skip
_NESTED = [
    "if next(n) % 2:\n{}",
    "if next(n) % 2:\n{}\nelse:\n{}",
    "for x in range(next(n) % 3):\n{}",
    "try:\n{}\nexcept ZeroDivisionError as y:\n{}",
    "try:\n{}\nfinally:\n{}",
    "while next(n) % 3:\n{}\n  if next(n) % 2: break",
    "with swallowed():\n{}",
]
_some_simple = st.lists(st.sampled_from(_SIMPLE), max_size=2, unique=True)
_some_nested = st.lists(st.sampled_from(_NESTED), min_size=1, max_size=2, unique=True)
_size, _place = st.integers(1, 3), st.integers(0, 11)
_owner = st.sampled_from(["", "_1", "_2", "_3"])
"""What the names of a piece end with: most pieces have their own."""


@st.composite
def pieces_of_code(draw: st.DrawFn) -> list[str]:
    """Draw pieces of few kinds of statements: what matters is what the same names are used for."""
    simple, nested = ["x = next(n)", "out(x)", *draw(_some_simple)], draw(_some_nested)

    def block(depth: int) -> str:
        return "\n".join(statement(depth) for _ in range(draw(_size)))

    def statement(depth: int) -> str:
        place = draw(_place)
        if not depth or place < 8:
            return simple[place % len(simple)]
        form = nested[place % len(nested)]
        return form.format(*(textwrap.indent(block(depth - 1), "  ") for _ in range(form.count("{}"))))

    return [re.sub(r"\b([xyz])\b", rf"\1{draw(_owner)}", block(2)) for _ in range(draw(_size))]


@settings(max_examples=examples(40), deadline=None)
@given(pieces_of_code())
def test_code_does_the_same_with_local_names(codes: list[str]) -> None:
    automaton = automaton_of(*codes)
    pieces = list(automaton.by_owner.values())
    all_shared = [piece.bound for piece in pieces]
    assert trace(pieces, all_shared) == trace(pieces, [automaton.shared_names(piece) for piece in pieces])


def trace(pieces: list[Piece], shared: list[frozenset[str]]) -> list[object]:
    """Run the pieces alternately, like an automaton, and return their output and exceptions."""
    names = sorted(set[str]().union(*shared))
    lines = ["def automaton(n, out, swallowed):", *(f"    {name}: object" for name in names), "    pass"]
    for number, (piece, own) in enumerate(zip(pieces, shared, strict=True)):
        lines.append(f"    def piece_{number}():")
        if own:
            lines.append(f"        nonlocal {', '.join(sorted(own))}")
        lines += piece.code.indented(2)
    functions = ", ".join(f"piece_{number}" for number in range(len(pieces)))
    lines.append(f"    return [{functions}]")
    namespace: dict[str, Any] = {}
    exec("\n".join(lines), namespace)
    found: list[object] = []

    class Swallowed:
        def __enter__(self) -> None: ...
        def __exit__(self, *_: object) -> bool:
            return True

    numbers = iter(random.Random(1).sample(range(300), 300))
    made = namespace["automaton"](numbers, lambda value: found.append(repr(value)[:40]), Swallowed)
    for function in made * 4:
        try:
            function()
        except Exception as error:  # noqa: BLE001 - whatever the code raises
            found.append(type(error) if not isinstance(error, NameError) else NameError)
    return found
