"""Problems in imported files: where the document has them, and where they stand."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.documents import document, state, sub, transition
from tests.support.editing import find_problems
from visualhfsm._document.places import Place
from visualhfsm._document.problems import Problem

IMPORT = '<SubAutomata id="{}" idFather="1"><import{}>{}</import></SubAutomata>\n'
LOOK = document(
    sub(1, 0, state(7, "search", initial=True, child=3)),
    sub(3, 1, state(2, "look", "x = 1\nprint(undefined_name, x)", initial=True)),
)


def imported(id: int, file: str, automaton: int | None = None) -> str:
    return IMPORT.format(id, "" if automaton is None else f' automaton="{automaton}"', file)


def check(directory: Path, *imports: str, include: tuple[Path, ...] = ()) -> list[Problem]:
    """Check a document whose states `first`, `second` and so on have the automata 2, 3 and so on."""
    names = ("first", "second")[: len(imports)]
    states = [state(n, name, initial=n == 1, child=n + 1) for n, name in enumerate(names, 1)]
    root = sub(1, 0, *states, *(transition(1, 1, 2, "10", type="time") for _ in imports[1:]))
    text = document(root, *imports)
    (directory / "robot.xml").write_text(text)
    return find_problems(text, directory / "robot.xml", include)


def owner(id: int, automaton: int = 1) -> Place:
    return Place(kind="state", automaton=automaton, id=id)


@pytest.fixture
def parts(tmp_path: Path) -> Path:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "look.xml").write_text(LOOK)
    return tmp_path


def test_it_has_its_place_in_the_document_in_its_file_and_the_state_that_owns_it(parts: Path) -> None:
    (problem,) = [each for each in check(parts, imported(2, "parts/look.xml")) if each.code == "W520"]
    assert problem.file == "parts/look.xml"
    assert problem.place == Place(kind="state", automaton=2003, id=2, part="code")
    assert problem.source == Place(kind="state", automaton=3, id=2, part="code")
    assert (problem.line, problem.column, problem.length) == (2, 7, len("undefined_name"))
    assert problem.where == "code of look, line 2"
    assert (problem.owners, problem.copies) == ((owner(1),), ())


def test_it_is_listed_once_however_often_its_file_is_imported(parts: Path) -> None:
    found = check(parts, imported(2, "parts/look.xml"), imported(3, "parts/look.xml"))
    (problem,) = [each for each in found if each.code == "W520"]
    assert problem.place == Place(kind="state", automaton=2003, id=2, part="code")
    assert problem.copies == (Place(kind="state", automaton=3003, id=2, part="code"),)
    assert problem.owners == (owner(1), owner(2))


def test_every_state_that_owns_imported_automata_down_to_it_is_named(parts: Path) -> None:
    middle = document(sub(1, 0, state(4, "middle", initial=True, child=2)), imported(2, "look.xml"))
    (parts / "parts" / "middle.xml").write_text(middle)
    (problem,) = [each for each in check(parts, imported(2, "parts/middle.xml")) if each.code == "W520"]
    assert problem.owners == (owner(1), owner(4, automaton=2))
    assert problem.file == "parts/look.xml"


def test_what_belongs_to_no_automaton_is_at_the_states_that_own_one(parts: Path) -> None:
    text = LOOK.replace("<libraries>\n", "<libraries>\n<lib>no such</lib>\n")
    (parts / "parts" / "look.xml").write_text(text)
    problem = check(parts, imported(2, "parts/look.xml"))[0]
    assert problem.severity == "error"
    assert problem.source == Place(kind="document", part="libraries", name="name")
    assert (problem.place, problem.owners) == (owner(1), (owner(1),))


def test_a_file_that_cannot_be_read_is_at_the_states_that_import_it(parts: Path) -> None:
    (parts / "parts" / "look.xml").write_text("<VisualHFSM>\n<SubAutomata")
    middle = document(sub(1, 0, state(4, "middle", initial=True, child=2)), imported(2, "look.xml"))
    (parts / "parts" / "middle.xml").write_text(middle)
    problem, unseen = check(parts, imported(2, "parts/middle.xml"))
    assert (problem.file, problem.line, problem.source) == ("parts/look.xml", 2, None)
    assert problem.owners == (owner(1), owner(4, automaton=2))
    assert problem.place == owner(1)
    assert unseen.code == "N608"


def test_a_file_that_is_missing_is_at_the_import_and_at_its_state(tmp_path: Path) -> None:
    problem, unseen = check(tmp_path, imported(2, "gone.xml"))
    assert (unseen.code, unseen.place) == ("N608", problem.place)
    assert problem.place == Place(kind="automaton", automaton=2, part="import")
    assert (problem.owners, problem.file) == ((owner(1),), "")


def test_a_file_of_another_directory_is_named_as_it_was_found(parts: Path, tmp_path: Path) -> None:
    own = tmp_path / "own"
    own.mkdir()
    found = check(own, imported(2, "look.xml"), include=(parts / "parts",))
    (problem,) = [each for each in found if each.code == "W520"]
    assert problem.file == str(parts / "parts" / "look.xml")
    assert problem.owners == (owner(1),)


def test_notes_about_other_files_say_the_place_in_words(parts: Path) -> None:
    one = LOOK.replace("<VisualHFSM>", "<VisualHFSM><parameters>{}</parameters>")
    entry = "<parameter><name>speed</name><type>float</type><default>{}</default></parameter>"
    (parts / "parts" / "look.xml").write_text(one.format(entry.format(1.0)))
    (parts / "parts" / "walk.xml").write_text(one.format(entry.format(2.0)))
    conflict, *others = check(parts, imported(2, "parts/look.xml"), imported(3, "parts/walk.xml"))
    assert conflict.notes == ("the other one is here (parts/look.xml: parameters of the component)",)
    assert conflict.file == "parts/walk.xml"
    assert conflict.owners == (owner(2),)
    assert {each.code for each in others} == {"W520"}


def test_files_that_import_one_another_are_one_problem_where_the_circle_closes(parts: Path) -> None:
    back = document(sub(1, 0, state(4, "back", initial=True, child=2)), imported(2, "../robot.xml"))
    (parts / "parts" / "back.xml").write_text(back)
    problem, unseen = check(parts, imported(2, "parts/back.xml"))
    assert (problem.code, unseen.code) == ("E552", "N608")
    assert (problem.file, problem.where) == ("parts/back.xml", "import of the automaton of back")
    assert problem.owners == (owner(1), owner(4, automaton=2))
    assert problem.notes == ("imported here (import of the automaton of first)",)


INPUT = "<input><name>color</name><type>str</type></input>\n"


def test_an_input_that_is_not_set_is_a_problem_of_the_state_that_has_to_set_it(parts: Path) -> None:
    low = document(sub(1, 0, INPUT, state(1, "low", "print(color)", initial=True)))
    (parts / "parts" / "low.xml").write_text(low)
    (problem,) = check(parts, imported(2, "parts/low.xml"))
    assert problem.place == owner(1)
    assert problem.message == "state `first` has to pass `color` to its automaton: it has no default"
    assert problem.notes == ("the input is here (parts/low.xml: inputs of the root automaton)",)
    middle = document(sub(1, 0, state(4, "middle", initial=True, child=2)), imported(2, "low.xml"))
    (parts / "parts" / "middle.xml").write_text(middle)
    (problem,) = check(parts, imported(2, "parts/middle.xml"))
    assert (problem.place, problem.owners) == (owner(4, automaton=2), (owner(1),))
    assert (problem.file, problem.where) == ("parts/middle.xml", "state middle")
