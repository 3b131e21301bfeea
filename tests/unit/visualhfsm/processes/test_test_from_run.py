"""A run as a test, which passes where the same happens again."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy  # noqa: F401 - a process loads it once, and pytester lets go of what its runs load
import pytest

from codegen.messages import Message
from tests.support.documents import document, state, sub, transition
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._document.serialization import parse
from visualhfsm._monitor.realm.run_log import Intervention, Interventions, Timeline
from visualhfsm._processes.test_from_run import RunTest, run_as_test

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


def made(
    content: str,
    seen: Timeline,
    *,
    robot: str | None = None,
    parameters: dict[str, str] | None = None,
    interventions: Interventions | None = None,
) -> RunTest:
    """Return the test of a run of a document to which nothing was done."""
    done = Interventions() if interventions is None else interventions
    return run_as_test(parse(content, Message("Cannot read")), seen, robot, parameters, done)


def test_a_run_with_events_passes_as_a_test(pytester: pytest.Pytester) -> None:
    (pytester.path / "claps.xml").write_text(CLAPS)
    text = made(CLAPS, timeline(DONE)).text("claps.xml")
    assert text.count('b.send("clap")') == 2
    assert 'b.run_until("the \\"show\\"/dance"' in text
    pytester.makepyfile(test_claps=text)
    pytester.runpytest("-p", "no:cacheprovider").assert_outcomes(passed=1)


def test_a_document_that_does_something_else_fails_it(pytester: pytest.Pytester) -> None:
    (pytester.path / "claps.xml").write_text(CLAPS.replace(">300<", ">5000<"))
    text = made(CLAPS, timeline(DONE)).text("claps.xml")
    pytester.makepyfile(test_claps=text)
    pytester.runpytest("-p", "no:cacheprovider").assert_outcomes(failed=1)


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
        made(CLAPS, seen)


def test_parameters_that_are_not_their_defaults_are_those_of_the_run() -> None:
    head = "".join(
        f"<parameter><name>{name}</name><type>{type_}</type><default>{default}</default></parameter>"
        for name, type_, default in [
            ("name", "str", '"Nao"'), ("speed", "float", "1"), ("turns", "int", "3"), ("wide", "bool", "True"),
        ]
    )  # fmt: skip
    content = CLAPS.replace("<SubAutomata", f"<parameters>{head}</parameters>\n<SubAutomata", 1)
    values = {"name": "'a \"robot\"'", "speed": "1.0", "turns": "4", "wide": "False", "gone": "3"}
    text = made(content, timeline(DONE), parameters=values).text("claps.xml")
    assert 'parameters={"name": "a \\"robot\\"", "turns": 4, "wide": False})' in text
    cut = made(content, timeline(DONE), parameters={"name": "'aaa", "speed": "inf"})
    assert 'parameters={"speed": float("inf")})' in cut.text("claps.xml")
    (left_out,) = cut.left_out
    assert "the value of the parameter name, of which only the beginning is known" in left_out


def test_the_robot_is_the_fake_one_where_the_document_needs_one(tmp_path: Path) -> None:
    text = made(CLAPS, timeline(DONE), robot="fake").text("a b.xml")
    assert 'behavior("a b.xml", robot="fake")' in text
    compile(text, str(tmp_path), "exec")


LISTS = r"""x == {"it's": ["a \"b\"", None, True, [1.5, -2]]}"""
WAITS = document(
    sub(
        1,
        0,
        state(1, "look", initial=True),
        state(2, "lost"),
        state(3, "found"),
        state(5, "read"),
        state(6, "known"),
        transition(4, 1, 2, "False", name="give up"),
        transition(5, 2, 3, "x == 7"),
        transition(6, 3, 5, LISTS),
        transition(7, 5, 6, "x != x"),
        transition(8, 6, 2, "self.bold and x == 'one\\ntwo \N{DUCK}'"),
        variables="x = 0",
    ),
    head="<parameters><parameter><name>bold</name><type>bool</type><default>False</default></parameter></parameters>",
)
LOST = (36.05, 1, 1, 2, 4)


def forced(time: float, transition: int = 4, *, confirmed: bool = True) -> Intervention:
    return Intervention("forceTransition", time, time, confirmed, automaton=1, transition=transition)


def set_to(time: float, value: str | None, name: str = "x", automaton: int = 1) -> Intervention:
    return Intervention("setVariable", time, time, automaton=automaton, name=name, value=value)


def passes(pytester: pytest.Pytester, content: str, test: RunTest) -> None:
    (pytester.path / "waits.xml").write_text(content, "utf-8")
    (pytester.path / "test_waits.py").write_text(test.text("waits.xml"), "utf-8")
    pytester.runpytest("-p", "no:cacheprovider").assert_outcomes(passed=1)


def test_forced_transitions_and_values_of_all_kinds_are_in_the_test(pytester: pytest.Pytester) -> None:
    changes = [LOST, (40.0, 1, 2, 3, 5), (41.0, 1, 3, 5, 6), (42.0, 1, 5, 6, 7), (50.0, 1, 6, 2, 8)]
    values = ["7", """{"it's": ["a \\"b\\"", null, true, [1.5, -2]]}""", "NaN", '"one\\ntwo \\ud83e\\udd86"']
    done = [forced(36.0), *(set_to(39.9 + number, value) for number, value in enumerate(values))]
    test = made(
        WAITS,
        timeline(changes, end=51.0),
        interventions=Interventions([*done, set_to(49.9, "true", "bold", automaton=0)]),
    )
    assert not test.left_out
    assert [line for line in test.lines if line.startswith(("b.force", "b.set"))] == [
        "b.force(1, 4)",
        "b.set(1, x=7)",
        """b.set(1, x={"it's": ["a \\"b\\"", None, True, [1.5, -2]]})""",
        'b.set(1, x=float("nan"))',
        "b.set(1, x='one\\ntwo \N{DUCK}')",
        "b.set(0, bold=True)",
    ]
    passes(pytester, WAITS, test)


def test_what_was_forced_while_it_was_paused_is_forced_at_the_same_time(pytester: pytest.Pytester) -> None:
    content = document(
        sub(
            1,
            0,
            state(1, "both", initial=True, child=2),
            state(2, "none"),
            transition(4, 1, 1, "False"),
            transition(5, 1, 2, "900", type="time"),
        ),
        sub(2, 1, state(7, "left", initial=True), state(8, "right"), transition(9, 7, 8, "False")),
    )
    done = [
        Intervention("forceTransition", 0.4, 0.4, automaton=1, transition=4),
        Intervention("forceTransition", 1.0, 1.0, automaton=2, transition=9),
    ]
    changes = [(1.0, 2, 7, 8, 9), (0.5, 1, 1, 1, 4), (1.4, 1, 1, 2, 5)]
    test = made(content, timeline(changes), interventions=Interventions(done))
    assert [*test.lines[:2], test.lines[3]] == ["b.advance(0.400)", "b.force(1, 4)", "b.force(2, 9)"]
    passes(pytester, content, test)


def test_a_document_without_the_forced_transition_fails_the_test(pytester: pytest.Pytester) -> None:
    test = made(WAITS, timeline([LOST]), interventions=Interventions([forced(36.0)]))
    (pytester.path / "waits.xml").write_text(WAITS.replace(transition(4, 1, 2, "False", name="give up"), ""))
    pytester.makepyfile(test_waits=test.text("waits.xml"))
    result = pytester.runpytest("-p", "no:cacheprovider")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*no transition 4 leaves look; there are none*"])


@pytest.mark.parametrize(
    ("done", "words"),
    [
        ([Intervention("reload", 1.5, 1.5)], "the reload of the component at 1.500 s"),
        (
            [Intervention("step", float(time), float(time), automaton=1) for time in range(3)],
            "3 cycles that were run by hand from 0.000 to 2.000 s",
        ),
        ([forced(1.0), forced(36.0)], "give up of automaton 1, forced at 36.000 s: no change of state shows"),
        ([forced(36.0), forced(40.0)], "forced at 40.000 s: it follows the last change of state"),
        ([forced(36.0), set_to(37.0, "1")], "x of automaton 1, set at 37.000 s: it follows the last change"),
        ([set_to(1.0, "1" * 20_000)], "x of automaton 1, set at 1.000 s: its value is too long"),
        ([set_to(1.0, "[" * 50 + "]" * 50)], "its value cannot be written in Python"),
        ([set_to(1.0, "[" * 5000 + "]" * 5000)], "its value cannot be written in Python"),
        ([set_to(1.0, "1 +")], "its value cannot be written in Python"),
        (
            [set_to(1.0, "1", 'x"""\nimport os #')],
            'x""" import os # of automaton 1, set at 1.000 s: this is not',
        ),
        (
            [msgspec.structs.replace(set_to(1.0, "1"), confirmed=False)],
            "x of automaton 1, set at 1.000 s: whether it was set is not known",
        ),
        (
            [forced(1.0, 99, confirmed=False)],
            "99 of automaton 1, forced at 1.000 s: no change of state shows",
        ),
    ],
)
def test_what_the_test_leaves_out_is_named_in_it(done: list[Intervention], words: str) -> None:
    test = made(WAITS, timeline([LOST]), interventions=Interventions(done))
    (sentence,) = test.left_out
    assert sentence.startswith("Not in the test: ")
    assert words in sentence
    text = test.text("waits.xml")
    assert text.splitlines()[2] == f"# {sentence}"
    compile(text, "test_waits.py", "exec")


def test_what_nobody_remembers_is_said() -> None:
    many = Interventions(set_to(number / 100, "1") for number in range(1200))
    assert made(WAITS, timeline([LOST]), interventions=many).left_out == [
        "Not in the test: what was done before the last 1000 actions."
    ]
    many = Interventions(set_to(40.0, "1") for _ in range(100))
    left_out = made(WAITS, timeline([LOST]), interventions=many).left_out
    assert len(left_out) == 41
    assert left_out[-1] == "Not in the test: 60 more of such actions."
    unknown = run_as_test(parse(WAITS, Message("Cannot read")), timeline([LOST]), None)
    assert "not known whether transitions were forced or variables set" in unknown.text("waits.xml")
