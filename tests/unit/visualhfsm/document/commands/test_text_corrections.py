"""Names that the checks find misspelt are corrected where they stand, and nowhere else."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.hfsm.document import Document
from codegen.messages import Message
from tests.support.documents import document, state, sub, transition
from tests.support.editing import find_problems
from visualhfsm._base.errors import EditError
from visualhfsm._document.commands.text import Correction, CorrectName, StraightenText
from visualhfsm._document.places import Place, texts_in
from visualhfsm._document.problems import Problem
from visualhfsm._document.serialization import parse, written

HEAD = "<iceinterface><nameinterface>Head</nameinterface><interface>{}</interface></iceinterface>\n"
LISTS = "<parameters><parameter><name>speed</name><type>float</type><default>1.0</default></parameter></parameters>"
INPUT = "<input><name>color</name><type>str</type><default>'red'</default></input>\n"
OUTPUT = "<output><name>found</name><type>bool</type><default>False</default></output>\n"
PROPERTY = (
    '<properties><property kind="eventually"><name>ends</name><within>1000</within>'
    "<expression>{}</expression></property></properties>"
)


def one(code: str, *, variables: str = "", head: str = LISTS, interface: str = "PoseHead") -> Document:
    """Return a document with one state, and the interface `Head`."""
    text = document(
        sub(1, 0, state(1, "look", code, initial=True), variables=variables),
        head=head,
        config=HEAD.format(interface),
    )
    return parse(text, Message("Cannot read"))


def below(state_parts: str) -> Document:
    """Return a document whose state `top` has an automaton with the input `color` and the output `found`."""
    top = state(1, "top", "print(seen)", initial=True, child=2).replace("</state>", f"{state_parts}</state>")
    text = document(
        sub(1, 0, top, variables="seen = False"),
        sub(2, 1, INPUT, OUTPUT, state(1, "low", "print(color)\nfound = True", initial=True)),
    )
    return parse(text, Message("Cannot read"))


def waiting(event: str) -> Document:
    text = document(
        sub(
            1, 0, state(1, "a", initial=True), state(2, "b"),
            transition(1, 1, 2, event, type="event"),
        ),
        events=("pressed",),
    )  # fmt: skip
    return parse(text, Message("Cannot read"))


def fixed(found: Document, problem: Problem) -> Document:
    assert problem.misspelt is not None
    assert problem.place is not None
    where = Correction(
        place=problem.place, line=problem.line, column=problem.column, field=problem.misspelt.field
    )
    if problem.line:
        where = Correction(place=problem.place, line=problem.line, column=problem.column)
    command = CorrectName(name=problem.misspelt.name, meant=problem.misspelt.meant, at=(where,))
    return command.apply(found)


@pytest.mark.parametrize(
    ("found", "code", "name", "meant"),
    [
        (one("pose = 1\nself.Head.setPosse(pose, 1.0)\nprint(pose)"), "W528", "setPosse", "setPose"),
        (one("self.Heda.stop()"), "W524", "Heda", "Head"),
        (one("print(self.sped)"), "W524", "sped", "speed"),
        (one("self.Head.getPose.latets()"), "W528", "latets", "latest"),
        (one("self.Head.setSpeed(pann=1.0, tilt=0.0)"), "W529", "pann", "pan"),
        (one("print(coutn)\ncount += 1", variables="count = 0"), "W520", "coutn", "count"),
        (one("pass", interface="PoseHaed"), "E532", "PoseHaed", "PoseHead"),
        (one("pass", head=PROPERTY.format("lok")), "E613", "lok", "look"),
        (below('<argument name="colour">"blue"</argument>'), "E527", "colour", "color"),
        (below('<result name="fuond">seen</result>'), "E529", "fuond", "found"),
        (below('<result name="found">sean</result>'), "E529", "sean", "seen"),
        (waiting("presed"), "W526", "presed", "pressed"),
    ],
)  # fmt: skip
def test_a_misspelt_name_is_corrected(found: Document, code: str, name: str, meant: str) -> None:
    problems = find_problems(written(found), None)
    problem = next(each for each in problems if each.misspelt is not None and each.code == code)
    assert problem.misspelt is not None
    assert (problem.misspelt.name, problem.misspelt.meant) == (name, meant)
    new = fixed(parse(written(found), Message("Cannot read")), problem)
    assert not [each for each in find_problems(written(new), None) if each.misspelt is not None]
    assert written(new) == written(found).replace(name, meant)


def test_only_the_name_at_that_place_is_corrected() -> None:
    code = "setPosse = 1.0\nself.Head.setPosse(setPosse, setPosse)"
    found = one(code)
    (problem,) = [each for each in find_problems(written(found), None) if each.code == "W528"]
    new = fixed(found, problem)
    assert new.automata[0].states[0].code.text == code.replace("Head.setPosse", "Head.setPose")


def test_all_places_are_corrected_by_one_step() -> None:
    found = one("self.Head.setPosse(1.0, 1.0); self.Head.setPosse(0.0, 1.0)\nself.Head.setPosse(0.0, 0.0)")
    problems = [each for each in find_problems(written(found), None) if each.code == "W528"]
    assert len(problems) == 3
    at = tuple(
        Correction(place=each.place, line=each.line, column=each.column) for each in problems if each.place
    )
    command = CorrectName(name="setPosse", meant="setPose", at=at)
    assert command.title(found) == "Replace “setPosse” by “setPose” (3 times)"
    assert "setPosse" not in written(command.apply(found))


def test_a_name_that_is_as_close_to_another_one_is_not_corrected() -> None:
    (problem,) = find_problems(written(one("print(lamp)", variables="lamps = lampe = 1")), None)[:1]
    assert problem.notes
    assert problem.misspelt is None


CODE = Place(kind="state", automaton=1, id=1, part="code")


@pytest.mark.parametrize(
    "where",
    [
        Correction(place=CODE, line=1, column=20),
        Correction(place=CODE, line=7, column=1),
        Correction(place=CODE),
        Correction(place=Place(kind="state", automaton=1, id=9, part="code"), line=1, column=1),
        Correction(place=Place(kind="state", automaton=1, id=1, part="result", name="x"), field="variable"),
        Correction(place=Place(kind="document", part="interfaces", index=5), field="type"),
        Correction(place=Place(kind="document", part="world"), field="type"),
        Correction(place=Place(kind="document", part="interfaces"), field="type"),
        Correction(place=Place(kind="document", part="interfaces"), field="nothing"),
    ],
)
def test_what_stands_there_no_longer_is_not_replaced(where: Correction) -> None:
    with pytest.raises(EditError):
        CorrectName(name="sped", meant="speed", at=(where,)).apply(one("print(sped)"))


def test_an_import_with_a_misspelt_file_is_corrected(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    for name in ("search.xml", "parts/look.xml"):
        (tmp_path / name).write_text(document(sub(1, 0, state(1, "a", initial=True))))
    for written_name, meant in (("serach.xml", "search.xml"), ("look.xml", "parts/look.xml")):
        text = document(
            sub(1, 0, state(1, "top", initial=True, child=2)),
            f'<SubAutomata id="2" idFather="1"><import automaton="1">{written_name}</import></SubAutomata>\n',
        )
        problem = next(each for each in find_problems(text, tmp_path / "main.xml") if each.code == "E550")
        after = fixed(parse(text, Message("Cannot read")), problem)
        imported = after.automata[1].imported
        assert imported is not None
        assert (imported.file.text, imported.automaton) == (meant, 1)
        assert find_problems(written(after), tmp_path / "main.xml") == []


def pasted() -> Document:
    text = document(
        sub(
            1, 0, state(1, "a", "log(“a”)", initial=True), state(2, "b"),
            transition(1, 1, 2, "x –\u00a01 > 2"),
            INPUT.replace("'red'", "‘red’"), variables="x = “é”",
        ),
        head=LISTS.replace("1.0", "−1.0") + PROPERTY.format("x =\u00a01"),
    )  # fmt: skip
    return parse(text, Message("Cannot read"))


@pytest.mark.parametrize(
    ("place", "expected"),
    [
        (Place(kind="state", automaton=1, id=1, part="code"), 'log("a")'),
        (Place(kind="transition", automaton=1, id=1, part="trigger"), "x - 1 > 2"),
        (Place(kind="automaton", automaton=1, part="variables"), 'x = "é"'),
        (Place(kind="automaton", automaton=1, part="inputs", name="default"), "'red'"),
        (Place(kind="document", part="parameters", name="default"), "-1.0"),
        (Place(kind="document", part="properties", name="expression"), "x = 1"),
    ],
)
def test_pasted_code_is_straightened_where_it_stands(place: Place, expected: str) -> None:
    before = pasted()
    after = StraightenText(place=place).apply(before)
    changed = [
        (one, other) for one, other in zip(texts_in(before), texts_in(after), strict=True) if one != other
    ]
    assert [(each.place, each.text) for _, each in changed] == [(place, expected)]
    assert StraightenText(place=place).apply(after) is after


def test_the_package_of_jderobot_is_replaced_by_that_of_today() -> None:
    text = document(sub(1, 0, state(1, "a", initial=True)), libraries=("jderobot",))
    found = parse(text, Message("Cannot read"))
    problem = next(each for each in find_problems(text, None) if each.code == "W544")
    assert fixed(found, problem).libraries[0].name.text == "from interfaces import jderobot"
