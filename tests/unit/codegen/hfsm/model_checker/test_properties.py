"""Properties: what is proved, what is refuted, and how it is reported."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics, Severity
from codegen.hfsm import parse_document, read_document, resolve, write_document
from codegen.hfsm.codes import Code
from codegen.hfsm.document import Document, Interface, Parameter, Text
from codegen.hfsm.known_interfaces import find_interfaces
from codegen.hfsm.model_checker import Verdict, WhyNever, check_model, read_operations, report_model
from tests.support.model_documents import (
    PATH,
    after,
    automaton,
    blink,
    chain,
    document,
    finished,
    state,
    stated,
    verdicts,
    when,
)
from tests.support.places import ROOT

BEHAVIORS = sorted((ROOT / "behaviors").glob("*.xml"))
KNOWN = find_interfaces()


def read(path: Path) -> Document:
    found = read_document(path, Diagnostics())
    assert found is not None
    return resolve(found, path, Diagnostics())


def verdict(doc: Document, kind: str, expression: str, within: str = "", limit: int = 300_000) -> str:
    (result,) = verdicts(doc, stated(kind, expression, within), limit=limit)
    return str(result.verdict)


@pytest.mark.slow
@pytest.mark.parametrize("path", BEHAVIORS, ids=lambda path: path.stem)
def test_the_behaviors_raise_no_alarm(path: Path) -> None:
    doc, diagnostics = read(path), Diagnostics()
    operations = read_operations(doc, KNOWN, diagnostics)
    report = check_model(doc, path, operations=operations)
    report_model(report, diagnostics)
    # Three automata of team_score look and walk with code that the checker cannot follow or may last: it says where.
    is_followed = path.stem != "team_score"
    assert [each.code for each in diagnostics] == ([] if is_followed else [Code.UNCLEAR_CODE] * 6)
    assert report.complete == is_followed


SOLUTIONS = [
    *sorted((ROOT / "exercises").glob("*/solution/*.xml")),
    ROOT / "exercises" / "match" / "rival.xml",
]


@pytest.mark.slow
@pytest.mark.parametrize("path", [*BEHAVIORS, *SOLUTIONS], ids=lambda path: f"{path.parts[-3]}-{path.stem}")
def test_our_documents_state_what_matters_and_it_is_proved(path: Path) -> None:
    properties = check_model(read(path), path).properties
    assert properties
    assert {each.verdict for each in properties} == {Verdict.HOLDS}


@pytest.fixture(scope="module")
def dance_and_follow() -> Document:
    return read(ROOT / "behaviors" / "dance_and_follow.xml")


def test_what_is_known_of_dance_and_follow(dance_and_follow: Document) -> None:
    expected = {
        ("never", "active(followBall/red) and active(followBall/green)", ""): "holds",
        ("never", "active(followBall/red) and active(dance)", ""): "holds",
        ("always", "ghost(followBall/red) or ghost(dance)", ""): "holds",
        ("always", "dance -> active(dance)", ""): "holds",
        ("eventually", "dance", "10000"): "holds",
        ("eventually", "dance", "9900"): "violated",
        ("eventually", "followBall/green", "8000"): "holds",
        ("never", "followBall/green", "7900"): "holds",
        ("never", "followBall/green", "8000"): "violated",
        ("always", "followBall", "9900"): "holds",
        ("always", "followBall", "10000"): "violated",
        ("eventually", "followBall/green/search", ""): "violated",
        ("never", "followBall/green/search", ""): "violated",
        ("eventually", "dance/left", ""): "violated",
        ("never", "ghost(dance)", ""): "violated",
        ("never", "dance/left", ""): "violated",
        ("never", "followBall/red/search", ""): "violated",
        ("never", "followBall and ghost(followBall/red)", ""): "violated",
    }
    results = verdicts(dance_and_follow, *(stated(*each) for each in expected))
    assert dict(zip(expected, (str(each.verdict) for each in results), strict=True)) == expected


def test_states_that_exclude_each_other_need_no_search(dance_and_follow: Document) -> None:
    apart = (
        "followBall/red and followBall/green",
        "followBall/red and dance/left",
        "active(dance) and followBall",
        "dance and ghost(dance)",
        "finished(dance)",
        "not (followBall or dance)",
        "followBall/red/search and ghost(followBall/red)",
    )
    results = verdicts(dance_and_follow, *(stated("never", each) for each in apart), limit=0)
    assert {each.property.expression.text for each in results if each.verdict is Verdict.HOLDS} == {*apart}


def test_timers_alone_make_something_come() -> None:
    assert verdict(blink(), "eventually", "on") == "holds"
    assert verdict(blink(), "eventually", "on", "300") == "holds"
    assert verdict(blink(), "eventually", "on", "299") == "violated"


def test_a_guard_that_is_asked_in_both_ways_makes_something_come() -> None:
    doc = document(
        automaton(1, [state(1, "a"), state(2, "b"), state(3, "c")], [when("x", 1, 2), when("not x", 1, 3)])
    )
    assert verdict(doc, "eventually", "b or c") == "holds"
    assert verdict(doc, "eventually", "b") == "violated"


def branching(*guards: str) -> Document:
    """Return a state that each of these guards leaves."""
    ways = [when(guard, 1, number, id=number) for number, guard in enumerate(guards, 2)]
    numbers = [state(number) for number in range(1, len(guards) + 2)]
    return document(automaton(1, numbers, ways, variables=Text("x = y = 1")))


@pytest.mark.parametrize(
    "guards",
    [
        ("x and y", "not (x and y)"),
        ("x or y", "not (x or y)"),
        ("x or y", "not x and not y"),
        ("x and y", "not x or not y"),
        ("x and not y", "y and not x", "x and y or not x and not y"),
        ("x and (y or x > 5)", "not x or not (y or x > 5)"),
        ("y", "(x or not x) and not y"),
        ("x is None", "x is not None"),
        ("x == 1 or y not in (1, 2)", "x != 1 and y in (1, 2)"),
    ],
)
def test_one_of_guards_holds_that_leave_nothing_over(guards: tuple[str, ...]) -> None:
    found = " or ".join(f"s{number}" for number in range(2, len(guards) + 2))
    assert verdict(branching(*guards), "eventually", found, "100") == "holds"
    assert verdict(branching(*guards[:-1]), "eventually", found.rpartition(" or ")[0], "100") == "violated"


IN_ORDER = ["2", "len('abc')", "int(3.5)", "7 // 2 - 1", "max(1, 2)", "True", "self.most", "'b'"]
NOT_IN_ORDER = [
    "0.5",
    "1 / 2",
    "None",
    "{1}",
    "float('nan')",
    "self.Head.getPose().pan",
    "self.far",
    "min(1, 0.5)",
]


@pytest.mark.parametrize("pair", [("x > y", "x <= y"), ("x < y", "not x < y"), ("x >= y", "x < y")])
@pytest.mark.parametrize("value", [*IN_ORDER, *NOT_IN_ORDER])
def test_of_what_is_in_order_one_is_true_of_more_and_not_more(pair: tuple[str, str], value: str) -> None:
    doc = branching(*pair)
    root = replace(doc.automata[0], variables=Text(f"k = 1\nx = {value}\ny = {value}"))
    parameters = (Parameter(name="most", type=Text("int")), Parameter(name="far", type=Text("float")))
    heads = (Interface(name="Head", type="PoseHead"),)
    doc = replace(doc, automata=(root,), parameters=parameters, interfaces=heads)
    is_known = value in IN_ORDER or ("not" in pair[1] and value != "{1}")
    assert (verdict(doc, "eventually", "s2 or s3", "100") == "holds") is is_known
    root = replace(root, variables=Text(f"k = 1\nx = {value}\ny = {value}\nx = 0.5"))
    mixed = replace(doc, automata=(root,))
    assert (verdict(mixed, "eventually", "s2 or s3", "100") == "holds") is (
        "not" in pair[1] and value != "{1}"
    )


def test_a_guard_never_holds_after_one_of_its_parts() -> None:
    assert verdict(branching("x or y", "x"), "never", "s3") == "holds"
    assert verdict(branching("x", "x or y"), "never", "s3") == "violated"
    report = check_model(branching("x or y", "x"), PATH)
    assert (report.transitions[1].why, report.transitions[1].earlier) == (WhyNever.EARLIER, (2,))


@pytest.mark.parametrize(
    "guards",
    [("f.x or y", "not f.x and not y"), ("y or f.x", "not y and not f.x"), ("f.x or not f.x", "False")],
)
def test_parts_of_guards_that_may_differ_prove_nothing(guards: tuple[str, ...]) -> None:
    assert verdict(branching(*guards), "eventually", "s2 or s3", "100") == "undecided"


def test_what_takes_too_long_is_undecided() -> None:
    doc = document(
        automaton(
            1, [state(1, children=[2]), state(2)], [after(10_000, 1, 2), after(7_300, 2, 1)], period=97
        ),
        automaton(
            2,
            [state(1), state(2), state(3)],
            [when("g", 1, 2), after(900, 2, 1), after(30_000, 1, 3)],
            father=1,
            period=89,
        ),
    )
    (result,) = verdicts(
        doc, stated("never", "#2/s3 and s1 and finished(s1)"), stated("eventually", "#2/s3"), limit=300
    )[1:]
    assert result.verdict is Verdict.UNDECIDED
    assert 0 < result.explored < 300
    assert result.until_ms > 0


def test_finished_children_restart() -> None:
    doc = document(
        automaton(1, [state(1, children=[2, 3])]),
        automaton(2, [state(1), state(2, "late")], [after(700, 1, 2)], father=1),
        automaton(3, [state(1, children=[4]), state(2)], [finished(1, 2), after(200, 2, 1)], father=1),
        automaton(4, [state(1), state(2, final=True)], [after(300, 1, 2)], father=3),
    )
    assert verdict(doc, "never", "#2/late and #4/s1", "800") == "violated"
    assert verdict(doc, "never", "active(#4) and #4/s1 and #3/s2") == "holds"


def test_cycles_of_unlike_periods_are_counted_where_something_has_to_happen() -> None:
    hurry = [when("True", 1, 2), when("True", 2, 3), when("True", 3, 4)]
    states = [state(each) for each in range(1, 5)]
    doc = document(
        automaton(1, [state(1, children=[2, 3])]),
        automaton(2, states, hurry, father=1, period=50),
        automaton(3, states, hurry, father=1, period=100),
    )
    assert verdict(doc, "never", "#2/s4 and #3/s2") == "violated"
    assert verdict(doc, "never", "#2/s4 and #3/s1") == "holds"


XML = """<?xml version="1.0" encoding="UTF-8"?>
<VisualHFSM>
  <properties>
    <property kind="never">
      <name>quiet</name>
      <expression>on and
        of</expression>
    </property>
    <property kind="{kind}">
      <name>dark</name>
      <within>{within}</within>
      <expression>on</expression>
    </property>
  </properties>
</VisualHFSM>
"""


def reported(doc: Document, limit: int = 300_000) -> list[tuple[Severity, str, str]]:
    diagnostics = Diagnostics()
    report_model(check_model(doc, PATH, limit=limit), diagnostics)
    return [(found.severity, found.code, found.message) for found in diagnostics]


def test_properties_are_reported_at_their_places() -> None:
    stated_ = parse_document(XML.format(kind="never", within="300"), PATH, Diagnostics())
    assert stated_ is not None
    diagnostics = Diagnostics()
    report_model(check_model(replace(blink(), properties=stated_.properties), PATH), diagnostics)
    error, violated = diagnostics.errors
    assert (error.code, error.location.line, error.location.column, error.location.length) == (
        "E613",
        7,
        9,
        2,
    )
    assert error.message == "`quiet`: the root automaton has no state `of`"
    assert [note.message for note in error.notes] == ["did you mean `off`?"]
    assert (violated.code, violated.location.line) == ("E610", 12)
    assert violated.message == "`dark` is violated: never on within 300 ms"
    assert "0.300 s  `off` -> `on` by transition 1" in violated.notes[0].message


@pytest.mark.parametrize(
    ("guards", "words"),
    [
        ([], ""),
        (["True"], ""),
        (["n == 4"], " if the guard `n == 4` ever holds"),
        (["n  ==\n4", "True", "not n"], " if the guards `n == 4` and `not n` ever hold"),
        (["a", "b", "c", "d", "e"], " if the guards `a`, `b`, `c` and 2 more ever hold"),
        (["n" * 70], f" if the guard `{'n' * 60}` ever holds"),
    ],
)
def test_a_violation_names_the_guards_that_it_needs(guards: list[str], words: str) -> None:
    states = [state(number) for number in range(1, len(guards) + 3)]
    ways = [when(guard, number, number + 1) for number, guard in enumerate(guards, 1)]
    ways.append(after(100, len(guards) + 1, len(guards) + 2))
    doc = document(automaton(1, states, ways), properties=[stated("never", states[-1].name, "", "p")])
    (message,) = (message for _, code, message in reported(doc) if code == "E610")
    assert message == f"`p` is violated{words}: never {states[-1].name}"


@pytest.mark.parametrize(
    ("kind", "within", "message"),
    [
        ("sometimes", "", "`p`: a property must be `always`, `eventually` or `never`, not `sometimes`"),
        ("never", "soon", "`p`: `within` must be a positive number of milliseconds, not `soon`"),
        ("never", "-3", "`p`: `within` must be a positive number of milliseconds, not `-3`"),
    ],
)
def test_a_property_that_is_not_one(kind: str, within: str, message: str) -> None:
    doc = replace(blink(), properties=(stated(kind, "on", within, "p"),))
    assert (Severity.ERROR, "E612", message) in reported(doc)


def test_an_undecided_property_is_a_warning() -> None:
    doc = replace(chain(6), properties=(stated("never", "#6/s9", "", "p"),))
    found = [one for one in reported(doc, limit=30) if one[1] == "W611"]
    assert found == [(Severity.WARNING, "W611", found[0][2])]
    assert found[0][2].startswith("`p` is undecided (explored ")


def test_what_never_happens_is_reported_once() -> None:
    doc = document(
        automaton(
            1,
            [state(1), state(2), state(3), state(4)],
            [after(300, 1, 2, id=1), after(500, 1, 3, id=2), after(100, 3, 4, id=3), after(100, 2, 1)],
        )
    )
    diagnostics = Diagnostics()
    report_model(check_model(doc, PATH), diagnostics)
    (found,) = diagnostics
    assert (found.severity, found.code) == (Severity.WARNING, "W517")
    assert found.message == "transition 2 can never fire: another always fires before it"
    assert [note.message for note in found.notes] == [
        "transition 1 fires first",
        "the state `s3` is never entered",
    ]


def test_a_document_that_was_written_and_read_says_the_same() -> None:
    doc = replace(
        blink(), properties=(stated("never", "on", "200", "p"), stated("eventually", "on", "", "q"))
    )
    again = parse_document(write_document(doc), PATH, Diagnostics())
    assert again is not None
    assert [r.verdict for r in check_model(again, PATH).properties] == [Verdict.HOLDS, Verdict.HOLDS]
