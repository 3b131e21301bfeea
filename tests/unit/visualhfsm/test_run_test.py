"""A run as a test, which passes where the same happens again."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.messages import Message
from tests.support.documents import document, state, sub, transition
from visualhfsm._editing.serialization import parse
from visualhfsm._errors import VisualHfsmError
from visualhfsm._monitoring.run_log import Timeline
from visualhfsm._run_test import run_as_test

pytest_plugins = "pytester"

CLAPS = document(
    sub(
        1,
        0,
        state(1, "wait", initial=True),
        state(2, 'the "show"', child=2),
        transition(4, 1, 2, "clap", type="event"),
        transition(5, 2, 1, "700", type="time"),
    ),
    sub(2, 1, state(7, "bow", initial=True), state(8, "dance"), transition(9, 7, 8, "300", type="time")),
    events=("clap",),
)
DONE = [(1.2, 1, 1, 2, 4), (1.5, 2, 7, 8, 9), (1.9, 1, 2, 1, 5), (3.0, 1, 1, 2, 4), (3.0, 2, 7, 7, 0)]


def timeline(
    changes: list[tuple[float, int, int, int, int]], start: float = 0.0, end: float = 3.1
) -> Timeline:
    return Timeline(start, end, changes, [], [])


def test_a_run_with_events_passes_as_a_test(pytester: pytest.Pytester) -> None:
    (pytester.path / "claps.xml").write_text(CLAPS)
    text = run_as_test(parse(CLAPS, Message("Cannot read")), "claps.xml", timeline(DONE), None)
    assert text.count('b.send("clap")') == 2
    assert 'b.run_until("the \\"show\\"/dance"' in text
    pytester.makepyfile(test_claps=text)
    pytester.runpytest_subprocess("-p", "no:cacheprovider").assert_outcomes(passed=1)


def test_a_document_that_does_something_else_fails_it(pytester: pytest.Pytester) -> None:
    (pytester.path / "claps.xml").write_text(CLAPS.replace(">300<", ">5000<"))
    text = run_as_test(parse(CLAPS, Message("Cannot read")), "claps.xml", timeline(DONE), None)
    pytester.makepyfile(test_claps=text)
    pytester.runpytest_subprocess("-p", "no:cacheprovider").assert_outcomes(failed=1)


@pytest.mark.parametrize(
    ("seen", "words"),
    [
        (timeline(DONE, start=2.0), "seen from 2.0 s on, not from its beginning"),
        (timeline([]), "has not changed its state"),
        (timeline([(1.0, 99, 1, 2, 4)]), "has not changed its state"),
    ],
)
def test_a_run_that_makes_no_test_says_why(seen: Timeline, words: str) -> None:
    with pytest.raises(VisualHfsmError, match=words):
        run_as_test(parse(CLAPS, Message("Cannot read")), "claps.xml", seen, None)


def test_parameters_that_are_not_their_defaults_are_those_of_the_run() -> None:
    head = "".join(
        f"<parameter><name>{name}</name><type>{type_}</type><default>{default}</default></parameter>"
        for name, type_, default in [
            ("name", "str", '"Nao"'), ("speed", "float", "1"), ("turns", "int", "3"), ("wide", "bool", "True"),
        ]
    )  # fmt: skip
    content = CLAPS.replace("<SubAutomata", f"<parameters>{head}</parameters>\n<SubAutomata", 1)
    values = {"name": "'a \"robot\"'", "speed": "1.0", "turns": "4", "wide": "False", "gone": "3"}
    text = run_as_test(parse(content, Message("Cannot read")), "claps.xml", timeline(DONE), None, values)
    assert 'parameters={"name": "a \\"robot\\"", "turns": 4, "wide": False})' in text
    cut = run_as_test(
        parse(content, Message("Cannot read")), "claps.xml", timeline(DONE), None, {"name": "'aaa"}
    )
    assert "parameters" not in cut


def test_the_robot_is_the_fake_one_where_the_document_needs_one(tmp_path: Path) -> None:
    text = run_as_test(parse(CLAPS, Message("Cannot read")), "a b.xml", timeline(DONE), "fake")
    assert 'behavior("a b.xml", robot="fake")' in text
    compile(text, str(tmp_path), "exec")
