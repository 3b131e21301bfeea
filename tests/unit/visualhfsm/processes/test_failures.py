"""The errors of a run, as its output reports them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from codegen.messages import Message
from tests.support.any_text import any_text
from tests.support.examples import examples
from visualhfsm._document.origins import Origin
from visualhfsm._document.places import Place
from visualhfsm._processes.failures import Failure, Failures

CODE = Origin(Place(kind="state", automaton=1, id=1, part="code"), 2)
FUNCTION = Origin(Place(kind="automaton", automaton=1, part="functions"), 1)
AT = " at walk.py:9 (walk.xml:4)"
STAMP = "2026-11-21 13:49:57.123"
TRACEBACK = "Traceback (most recent call last):"

Heard = Sequence[tuple[str, Origin | None]]


def heard(*lines: tuple[str, Origin | None]) -> list[Failure]:
    failures = Failures()
    return [failure for line, origin in lines for failure in failures.parse(line, origin)]


def error(
    what: str, origin: Origin | None = CODE, level: str = "ERROR", end: str = ""
) -> tuple[str, Origin | None]:
    return f"{STAMP} {level:8} walk: walk/go: {what}{AT}{end}", origin


ONE = [Failure(CODE, "go", Message("ValueError: no"))]

CASES: dict[str, tuple[Heard, list[Failure]]] = {
    "a record": ([error("ValueError: no")], ONE),
    "a repeated one": (
        [error("ValueError: no"), error("ValueError: no", end=" (7 times more since it was last logged)")], ONE
    ),
    "a critical one": ([error("its thread failed", level="CRITICAL")], [Failure(CODE, "go", Message("its thread failed"))]),
    "one in code that is not saved": (
        [(f"{STAMP} ERROR    walk: walk/go: ValueError: no at walk.py:9 (line 2 of code 1.1)", CODE)], ONE
    ),
    "a start with code that is not saved": (
        [("walk.py: error: the variables failed: SystemExit: 5 at walk.py:9 (line 1 of variables 1)", CODE)],
        [Failure(CODE, "", Message("the variables failed: SystemExit: 5"))],
    ),
    "no error": ([error("is refused", level="WARNING")], []),
    "an error of another document": ([error("ValueError: no", None)], []),
    "several lines": (
        [(f"{STAMP} ERROR    walk: walk/go: ValueError: one", None), ("two: 2", None), (f"three{AT}", CODE)],
        [Failure(CODE, "go", Message('ValueError: one\ntwo: 2\nthree'))],
    ),
    "its own traceback": (
        [error("ValueError: no"), (TRACEBACK, None), ('  File "walk.py", line 9, in go', CODE), ("ValueError: no", None)],
        ONE,
    ),
    "a function that a state calls": (
        [
            error("ValueError: no", FUNCTION), (TRACEBACK, None), ('  File "walk.py", line 9, in go', CODE),
            ("    self.f()", None), ('  File "walk.py", line 3, in f', FUNCTION), ("ValueError: no", None),
        ],
        [
            Failure(FUNCTION, "go", Message("ValueError: no")),
            Failure(CODE, "go", Message("this calls code that fails: ValueError: no")),
        ],
    ),
    "a chain of exceptions": (
        [
            error("RuntimeError: two"), (TRACEBACK, None), ('  File "walk.py", line 8, in go', CODE),
            ("ValueError: one", None), ("", None), ("During handling of the above exception, another one", None),
            ("", None), (TRACEBACK, None), ('  File "walk.py", line 9, in go', CODE), ("RuntimeError: two", None),
        ],
        [Failure(CODE, "go", Message("RuntimeError: two"))],
    ),
    "a traceback of other code": ([(TRACEBACK, None), ('  File "x.py", line 3', None), ("ValueError: no", None)], []),
    "variables": (
        [(f"walk.py: error: the variables of the component failed: SystemExit: 5{AT}", CODE)],
        [Failure(CODE, "", Message("the variables of the component failed: SystemExit: 5"))],
    ),
    "a library": (
        [("walk.py: error: walk.xml:9: the library cv3 is not installed", FUNCTION)],
        [Failure(FUNCTION, "", Message("the library cv3 is not installed"))],
    ),
    "a crash": (
        [("Fatal Python error: Segmentation fault", None), ("", None), ('  File "walk.py", line 9 in go', CODE)],
        [Failure(CODE, "", Message("Segmentation fault"))],
    ),
    "what code prints": ([("ValueError: no", None), ("somewhere", CODE)], []),
}  # fmt: skip


@pytest.mark.parametrize(("lines", "expected"), CASES.values(), ids=CASES)
def test_failures_are_found_in_the_output(lines: Heard, expected: list[Failure]) -> None:
    assert heard(*lines) == expected


def test_the_last_of_a_chain_of_exceptions_keeps_its_state() -> None:
    failures = Failures()
    for line, origin in CASES["a chain of exceptions"][0]:
        failures.parse(line, origin)
    assert failures.last == Failure(CODE, "go", Message("RuntimeError: two"))
    assert failures.printed is None


def test_an_end_that_nothing_reported_is_a_failure_of_the_state_that_ran() -> None:
    failures = Failures()
    assert failures.end(Message("it was terminated by SIGKILL"), None, "") == []
    state = Origin(Place(kind="state", automaton=1, id=1), 0)
    expected = [Failure(state, "go", Message("the component ended here: it was terminated by SIGKILL"))]
    assert failures.end(Message("it was terminated by SIGKILL"), state, "go") == expected


def test_a_traceback_alone_is_a_failure_only_if_the_run_ends_there() -> None:
    failures = Failures()
    lines: Heard = [
        (TRACEBACK, None), ('  File "walk.py", line 3, in <module>', FUNCTION), ("ValueError: it fails", None)
    ]  # fmt: skip
    assert [found for line, origin in lines for found in failures.parse(line, origin)] == []
    assert failures.end(Message("it ended with exit code 1"), FUNCTION, "") == [
        Failure(FUNCTION, "", Message("ValueError: it fails"))
    ]


def test_an_end_after_its_error_is_no_second_failure() -> None:
    failures = Failures()
    failures.parse(*error("ValueError: no"))
    assert failures.end(Message("it ended: no in go"), CODE, "go") == []


def test_a_run_has_few_failures_whatever_it_prints() -> None:
    assert len(heard(*(error(f"ValueError: {number}") for number in range(1000)))) == 50


PIECES = st.sampled_from(
    [STAMP, " ERROR    ", " INFO ", "walk: walk/go: ", AT, TRACEBACK, "Fatal Python error: ", '  File "walk.py", line 3',
     "ValueError: no", "walk.py: error: walk.xml:9: ", "\t", ": ", "x" * 3000]
)  # fmt: skip


@given(
    st.lists(st.tuples(st.lists(PIECES | any_text(5)).map("".join), st.sampled_from([None, CODE, FUNCTION])))
)
@settings(max_examples=examples(20))
def test_no_output_is_too_strange(lines: list[tuple[str, Any]]) -> None:
    for failure in heard(*lines):
        assert failure.origin in (CODE, FUNCTION)
        assert len(failure.message) <= 7000
        assert failure.in_short
