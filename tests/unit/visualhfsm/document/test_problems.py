"""Problems with the places to jump to, checked in this process and in a child process."""

from __future__ import annotations

import contextlib
import threading
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import psutil
import pytest

from codegen.diagnostics import Severity
from codegen.hfsm.codes import PROVED
from codegen.hfsm.document import (
    Automaton,
    Document,
    Interface,
    Library,
    Property,
    State,
    Text,
    Transition,
)
from codegen.messages import Message
from tests.support.editing import check, find_problems, large_document, texted, tree
from tests.support.limits import CALL_LIMIT, END_LIMIT, EVENT_LIMIT
from visualhfsm._base.errors import EditError
from visualhfsm._document.commands.automata import AddAutomaton
from visualhfsm._document.commands.text import SetText
from visualhfsm._document.places import Located, Locator, Place, texts_at, texts_in
from visualhfsm._document.problems import Findings, Problem
from visualhfsm._document.serialization import parse, written
from visualhfsm.project._check_process import CheckProcess

TYPED = Place(kind="state", automaton=1, id=1, part="code")


def only(problems: list[Problem], code: str) -> Problem:
    (found,) = [each for each in problems if each.code == code]
    return found


def clean() -> Document:
    return Document(
        automata=(
            Automaton(
                id=1,
                states=(State(id=1, name="a", initial=True), State(id=2, name="b")),
                transitions=(
                    Transition(id=1, name="on", origin=1, destination=2, type="time", trigger=Text("1000")),
                    Transition(id=2, name="back", origin=2, destination=1, type="time", trigger=Text("1000")),
                ),
            ),
        )
    )


def test_a_document_in_order_has_no_problems() -> None:
    assert find_problems(written(clean()), None) == []


@pytest.mark.slow
def test_problems_are_counted_whether_or_not_they_are_listed(tmp_path: Path) -> None:
    nobody = "\n".join(f"self.log.info(nobody{number})" for number in range(1005))
    states = [State(id=n, name=f"s{n}", initial=n == 1, code=Text(nobody)) for n in (1, 2)]
    text = written(Document(automata=(Automaton(id=1, states=tuple(states)),)))
    found = check(text, tmp_path / "many.xml")
    total = Counter(each.severity for each in find_problems(text, tmp_path / "many.xml"))
    assert total[Severity.WARNING] > 2000
    assert len(found.problems) == 1002  # with the first of each further piece: a state, and its code
    assert found.counts == total


@pytest.mark.slow
def test_every_element_with_a_problem_is_listed(tmp_path: Path) -> None:
    nobody = "\n".join(f"self.log.info(nobody{number})" for number in range(10))
    states = tuple(State(id=n, name=f"s{n}", initial=n == 1, code=Text(nobody)) for n in range(1, 201))
    wrong = Property(name="p", kind="eventually", expression=Text("in(s2)"))
    root = Automaton(id=1, states=states, variables=Text("nobody = 1"))
    text = written(Document(automata=(root,), properties=(wrong,)))
    found = check(text, tmp_path / "many.xml")
    places = {(each.place.kind, each.place.id or each.place.part) for each in found.problems if each.place}
    assert places == {
        *(("state", n) for n in range(1, 201)),
        ("automaton", "variables"),
        ("document", "properties"),
    }


def test_what_can_never_happen_has_its_assumptions() -> None:
    never = Transition(id=3, name="late", origin=1, destination=2, type="time", trigger=Text("2000"))
    (automaton,) = clean().automata
    document = Document(automata=(replace(automaton, transitions=(*automaton.transitions, never)),))
    found = only(find_problems(written(document), None), "W517")
    assert found.assumes.startswith("Proofs, and what is called impossible, hold as long as cycles begin")


@pytest.mark.slow
def test_code_is_marked_however_much_is_wrong_before_it(tmp_path: Path) -> None:
    nobody = "\n".join(f"self.log.info(nobody{number})" for number in range(1005))
    states = (State(id=1, name="a", initial=True, code=Text(nobody)), State(id=2, name="b", code=Text("x")))
    text = written(Document(automata=(Automaton(id=1, states=states),)))
    place = Place(kind="state", automaton=1, id=2, part="code")
    found = check(text, tmp_path / "many.xml").problems
    assert [each.code for each in found if each.place == place] == ["W520"]


@pytest.mark.parametrize(
    ("place", "code", "expected"),
    [
        (TYPED, "steps += 1", []),
        (TYPED, "steps += 1\nx = = 2", [("E520", 2, 5)]),
        (TYPED, "steps = stebs", [("W520", 1, 9)]),
        (TYPED, "steps += 1\nself.Head.setPose(1)", [("W529", 2, 11)]),
        (Place(kind="transition", automaton=1, id=1, part="trigger"), "steps > ", [("E515", 1, 1)]),
        (Place(kind="automaton", automaton=1, part="functions"), "def f(self): return no", [("W520", 1, 21)]),
        (Place(kind="automaton", automaton=1, part="variables"), "return 1", [("E520", 1, 1)]),
    ],
)
def test_what_is_wrong_with_a_piece_of_code_is_marked_there(
    place: Place, code: str, expected: list[tuple[str, int, int]]
) -> None:
    (automaton,) = clean().automata
    document = Document(
        automata=(replace(automaton, variables=Text("steps = 0")),),
        interfaces=(Interface(name="Head", proxy="Head", type="PoseHead"),),
    )
    problems = find_problems(written(SetText(place=place, text=code).apply(document)), None)
    found = [(each.code, each.line, each.column) for each in problems if each.place == place and each.line]
    assert found == expected


def test_a_document_in_which_nothing_is_drawn_yet_has_no_problems() -> None:
    blank = Document(automata=(Automaton(id=1),))
    assert find_problems(written(blank), None) == []
    assert only(find_problems(written(AddAutomaton(automaton=1, state=2).apply(tree())), None), "E513").place


@pytest.mark.parametrize("part", ["entry", "code", "exit"])
def test_an_error_in_code_has_its_line_and_column_in_that_code(part: Any) -> None:
    document = texted(clean(), "a = 1\nif a < 2:\n    b = = 1", kind="state", id=2, part=part)
    problem = only(find_problems(written(document), None), "E520")
    assert problem.severity == "error"
    assert problem.place == Place(kind="state", automaton=1, id=2, part=part)
    assert (problem.line, problem.column) == (3, 9)


def test_the_first_line_counts_from_its_own_start() -> None:
    document = texted(clean(), "a < = 1", kind="state", id=1, part="code")
    problem = only(find_problems(written(document), None), "E520")
    assert (problem.line, problem.column) == (1, 5)


def test_problems_of_transitions_automata_and_lists_have_their_places() -> None:
    document = texted(clean(), "soon", kind="transition", id=2, part="trigger")
    problems = find_problems(written(document), None)
    assert problems[0].place == Place(kind="transition", automaton=1, id=2, part="trigger")
    document = Document(automata=clean().automata, libraries=(Library(name=Text("a b c")),))
    (problem,) = find_problems(written(document), None)
    assert problem.place == Place(kind="document", part="libraries", name="name")


def test_every_element_and_text_of_a_document_is_found_where_it_was_written() -> None:
    document = texted(tree(), "1 <\n2", kind="state", id=2, part="argument", name="n", child=2)
    document = texted(document, "\n\na\n", kind="state", id=1, part="exit")
    read = parse(written(document), Message("Cannot read"))
    locator = Locator(read)
    seen = 0
    for placed in texts_in(read):
        if not placed.line:
            continue
        located = locator.find(placed.line, placed.column)
        assert located is not None
        assert located.place == placed.place
        seen += 1
        for extra, text in enumerate((placed.text or "").split("\n")[1:], 1):
            located = locator.find(placed.line + extra, len(text) + 1)
            assert located == (placed.place, extra + 1, len(text) + 1)
            seen += 1
    assert seen > 40
    assert locator.find(1, 1) is None


def test_what_is_behind_a_text_belongs_to_the_element() -> None:
    text = '<VisualHFSM>\n<SubAutomata id="1">\n<state id="3"><code>a</code>\n<ours>\n</ours></state></SubAutomata></VisualHFSM>'
    located = Locator(parse(text, Message("Cannot read"))).find(4, 1)
    assert located == (Place(kind="state", automaton=1, id=3), 0, 0)


def test_a_document_that_was_never_saved_is_checked_as_it_is(tmp_path: Path) -> None:
    file = tmp_path / "a.xml"
    file.write_text("old")
    assert find_problems(written(clean()), file) == []
    assert file.read_text() == "old"


@pytest.fixture
def checks():
    process = CheckProcess()
    yield process
    process.close()


@pytest.mark.slow
def test_a_process_beside_finds_the_same_and_is_started_again_if_it_dies(
    checks: CheckProcess, tmp_path: Path
) -> None:
    document = texted(clean(), "undefined_name + 1", kind="state", id=2, part="code")
    assert [*checks.check(document, None).problems] == find_problems(written(document), None) != []
    assert checks.check(clean(), None).problems == ()
    assert_a_broken_description_is_a_problem_with_its_file(checks, tmp_path)
    (process,) = checkers()
    process.kill()
    process.wait(END_LIMIT)
    assert checks.check(clean(), None).problems == ()
    (other,) = checkers()
    assert other != process


def assert_a_broken_description_is_a_problem_with_its_file(checks: CheckProcess, tmp_path: Path) -> None:
    (tmp_path / "lab").mkdir()
    (tmp_path / "lab" / "__init__.py").write_text("")
    (tmp_path / "lab" / "lamp.py").write_text("class LampPrx(ObjectPrx):\n    pass\n")
    schema = tmp_path / "lab" / "schema.json"
    schema.write_text('{\n<<<<<<< HEAD\n "definitions": {}\n}\n')
    document = replace(clean(), interfaces=(Interface(name="Lamp", type="Lamp"),))
    (problem,) = checks.check(document, tmp_path / "main.xml", [tmp_path]).problems
    assert (problem.code, problem.severity) == ("E605", "error")
    assert (problem.file, problem.line) == (str(schema), 2)


def checkers() -> list[psutil.Process]:
    found = []
    for child in psutil.Process().children():
        with contextlib.suppress(psutil.NoSuchProcess):
            if "visualhfsm._document.problems" in child.cmdline():
                found.append(child)
    return found


@pytest.mark.slow
def test_a_revision_that_the_model_checker_did_not_look_at_has_a_warning(checks: CheckProcess) -> None:
    with ThreadPoolExecutor(1) as pool:
        future = pool.submit(checks.check, clean(), None)
        deadline = time.monotonic() + EVENT_LIMIT
        while not (running := checkers()):
            assert time.monotonic() < deadline
        running[0].kill()  # before it has answered: it takes longer to start
        (problem,) = future.result(CALL_LIMIT).problems
    assert (problem.severity, "by the model checker" in problem.message) == ("warning", True)


def endless() -> Document:
    """Return a document that the model checker explores for many seconds."""
    root = Automaton(
        id=1, states=(State(id=1, name="a", initial=True, children=tuple(range(2, 10)), code=Text("lost")),)
    )
    below = (
        Automaton(
            id=number,
            father=1,
            iteration_time=Text(str(100 + number)),
            states=tuple(State(id=n, name=f"s{number}{n}", initial=n == 1) for n in range(1, 6)),
            transitions=tuple(
                Transition(
                    id=n,
                    origin=n,
                    destination=n % 5 + 1,
                    type="condition",
                    trigger=Text(f"lost{number} > {n}"),
                )
                for n in range(1, 6)
            ),
        )
        for number in range(2, 10)
    )
    goal = Property(
        name="p", kind="never", expression=Text(" and ".join(f"#{n}/s{n}5" for n in range(2, 10)))
    )
    return Document(automata=(root, *below), properties=(goal,))


@pytest.mark.slow
def test_what_is_wrong_with_code_is_known_while_the_model_checker_searches(checks: CheckProcess) -> None:
    checks.check(clean(), None)
    known: list[Findings] = []

    def hear(found: Findings) -> None:
        known.append(found)
        checks.give_up_search()

    began = time.monotonic()
    found = checks.check(endless(), None, meanwhile=hear)
    assert time.monotonic() - began < 5
    assert known == [found]
    assert (found.complete, found.proofs) == (False, None)
    assert "W520" in {each.code for each in found.problems}
    assert not PROVED & {each.code for each in found.problems}
    assert checks.check(clean(), None) == Findings(proofs=())


@pytest.mark.slow
def test_a_check_that_takes_too_long_is_reported() -> None:
    impatient = CheckProcess(patience=0.0)
    (problem,) = impatient.check(clean(), None).problems
    assert "not checked" in problem.message
    impatient.close()


@pytest.mark.slow
def test_closing_ends_a_check_that_is_running() -> None:
    process = CheckProcess()
    process.check(clean(), None)
    started = threading.Event()
    problems: list[Problem] = []

    def check() -> None:
        started.set()
        try:
            problems.extend(process.check(large_document(2000), None).problems)
        except EditError:
            problems.append(Problem(code="", severity=Severity.WARNING, message=Message("not checked")))

    thread = threading.Thread(target=check)
    thread.start()
    assert started.wait(EVENT_LIMIT)
    process.close()
    thread.join(EVENT_LIMIT)
    assert not thread.is_alive()
    assert checkers() == []
    with pytest.raises(EditError, match="ended"):
        process.check(clean(), None)


@pytest.mark.slow
def test_modules_beside_a_document_are_not_run(tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "ast.py").write_text("raise SystemExit('run')")
    monkeypatch.chdir(tmp_path)
    process = CheckProcess()
    try:
        assert process.check(clean(), tmp_path / "a.xml").problems == ()
    finally:
        process.close()


def test_a_note_names_its_place_in_words() -> None:
    late = SetText(
        place=Place(kind="state", automaton=1, id=2, part="code"), text="x = 1\nx = distance\ndistance = 1"
    )
    problem = only(find_problems(written(late.apply(clean())), None), "W522")
    assert problem.notes[0] == "it gets a value here (code of b, line 3)"


@pytest.mark.parametrize(
    ("place", "expected"),
    [
        (Place(kind="state", automaton=1, id=1), "state a"),
        (Place(kind="state", automaton=1, id=1, part="entry"), "entry of a"),
        (Place(kind="transition", automaton=1, id=2, part="trigger"), "trigger of back"),
        (Place(kind="automaton", automaton=1, part="variables"), "variables of the root automaton"),
        (Place(kind="document", part="description"), "description of the component"),
    ],
)
def test_places_have_names(place: Place, expected: str) -> None:
    assert Locator(clean()).name(Located(place, 1, 1)) == expected


def test_the_texts_of_an_element_are_all_but_its_name() -> None:
    document = texted(clean(), "x = 1", kind="state", id=1, part="entry")
    state = Place(kind="state", automaton=1, id=1)
    assert texts_at(document, state) == ("x = 1", "", "")
    assert texts_at(document, Place(kind="state", automaton=1, id=1, part="entry")) == ("x = 1",)
    assert texts_at(document, Place(kind="state", automaton=1, id=7, part="entry")) == ()
