"""Fixes of problems: each is applied to a document that has the problem, and leaves nothing wrong in its place."""

from __future__ import annotations

from collections import Counter
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path

import msgspec
import pytest

from codegen.hfsm.known_interfaces import find_interfaces
from codegen.messages import Message
from tests.support.documents import document, state, sub, transition
from tests.support.editing import find_problems
from tests.support.pages import sections_of
from tests.support.places import ROOT
from tests.support.plugins import OF_THE_WHOLE
from visualhfsm._base.errors import EditError
from visualhfsm._document.commands import decode_command
from visualhfsm._document.fixes import Fix, as_declared, fixes
from visualhfsm._document.problems import Problem
from visualhfsm._document.serialization import parse, written
from visualhfsm.simulation import served_interfaces

HEAD = "<iceinterface><nameinterface>Head</nameinterface><interface>{}</interface></iceinterface>\n"
SPEED = "<parameters><parameter><name>speed</name><type>float</type><default>{}</default></parameter></parameters>"
INPUT = "<input><name>color</name><type>str</type><default>{}</default></input>\n"
OUTPUT = "<output><name>found</name><type>bool</type><default>False</default></output>\n"
PROPERTY = (
    '<properties><property kind="eventually"><name>ends</name><within>1000</within>'
    "<expression>{}</expression></property></properties>"
)
FUNCTION = "def camera(self):\n    return 1\n"


def one(code: str, *, variables: str = "", functions: str = "", head: str = "", interface: str = "") -> str:
    """Return a document of one state, perhaps with an interface `Head` of a type."""
    config = HEAD.format(interface) if interface else ""
    only = sub(1, 0, state(1, "look", code, initial=True), variables=variables, functions=functions)
    return document(only, head=head, config=config)


def below(
    code: str, *parts: str, above: str = "print(1)", variables: str = "", more: str = "", values: str = ""
) -> str:
    """Return a document whose state `top` has an automaton with one state; `more` is written in `top`.

    `variables` are those of the root, `values` those below.
    """
    top = state(1, "top", above, initial=True, child=2).replace("</state>", f"{more}</state>")
    return document(
        sub(1, 0, top, variables=variables),
        sub(2, 1, *parts, state(1, "low", code, initial=True), variables=values),
    )


def guarded(trigger: str, type: str = "condition", events: tuple[str, ...] = ()) -> str:
    return document(
        sub(
            1, 0, state(1, "a", "pass", initial=True), state(2, "b"),
            transition(1, 1, 2, trigger, type=type), transition(2, 2, 1, "100", type="time"),
        ),
        events=events,
    )  # fmt: skip


MOVE = "self.RightShoulderMotors.setPose3DMotorsData(Pose3DMotorsData(tilt=1.2))"

CASES: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "a module": (one("print(math.pi / 4, math.tau)"), "W520", ("Import math",)),
    "a usual alias": (one("print(np.zeros(3))"), "W520", ("Import numpy as np",)),
    "a module in the functions": (
        one("pass", functions="def seen(self):\n    return cv2.mean(0)\n"), "W520", ("Import cv2",),
    ),
    "a function of math": (guarded("sqrt(2) > 1"), "W520", ("Import sqrt from math",)),
    "a number of math": (one("print(pi)"), "W520", ("Import pi from math",)),
    "a struct of operations": (
        one(MOVE), "W520", ("Import Pose3DMotorsData from interfaces.jderobot",),
    ),
    "an exact name of the robot": (
        one("print(self.Camera.getImageData('RGB8'))\nprint(self.camera())", functions=FUNCTION),
        "W524", ("Declare Camera (Camera)", "Write camera"),
    ),
    "a function of the document": (one("print(camera())", functions=FUNCTION), "W520", ("Write self.camera",)),
    "an interface of the document": (one("Head.stop()", interface="PoseHead"), "W520", ("Write self.Head",)),
    "what every component has": (one('log.info("a")'), "W520", ("Write self.log",)),
    "a variable": (one("print(lento)"), "W520", ("Declare the variable lento",)),
    "a variable of a condition": (guarded("lento > 3"), "W520", ("Declare the variable lento",)),
    "no variable has attributes": (one("print(lento)\nlento.go()"), "W520", ()),
    "no variable is called": (one("print(lento())"), "W520", ()),
    "no variable is in the functions": (
        one("pass", functions="def seen(self):\n    return lento\n"), "W520", (),
    ),
    "a misspelt variable": (
        one("print(coutn)\ncount += 1", variables="count = 0"),
        "W520", ("Write count", "Declare the variable coutn"),
    ),
    "a misspelt operation, often": (
        one("x = 1.0; self.Head.setPosse(x, x, 1.0); self.Head.setPosse(0.0, x, 0.5)", interface="PoseHead"),
        "W528", ("Write setPose", "Write setPose in all 2 places"),
    ),
    "a misspelt attribute": (one("print(self.sped)", head=SPEED.format("1.0")), "W524", ("Write speed",)),
    "a misspelt stream": (
        one("print(self.Head.getPose.latets())", interface="PoseHead"), "W528", ("Write latest",),
    ),
    "a misspelt parameter of an operation": (
        one("self.Head.setSpeed(pann=1.0, tilt=0.0)", interface="PoseHead"), "W529", ("Write pan",),
    ),
    "a misspelt interface": (one("self.Head.stop()", interface="PoseHaed"), "E532", ("Write PoseHead",)),
    "a misspelt state in a property": (one("pass", head=PROPERTY.format("lok")), "E613", ("Write look",)),
    "a misspelt argument": (
        below(
            "print(color)", INPUT.format("'red'"), more='<argument name="colour">"blue"</argument>',
        ),
        "E527", ("Write color",),
    ),
    "a misspelt output": (
        below(
            "found = True", OUTPUT, above="print(seen)", variables="seen = False",
            more='<result name="fuond">seen</result>',
        ),
        "E529", ("Write found",),
    ),
    "a misspelt variable for an output": (
        below(
            "found = True", OUTPUT, above="print(seen)", variables="seen = False",
            more='<result name="found">sean</result>',
        ),
        "E529", ("Write seen",),
    ),
    "a misspelt event": (guarded("presed", "event", ("pressed",)), "W526", ("Write pressed",)),
    "an old library": (
        document(sub(1, 0, state(1, "a", "print(jderobot)", initial=True)), libraries=("jderobot",)),
        "W544", ("Write from interfaces import jderobot",),
    ),
    "a variable above that is read": (
        below("print(hits)", above="print(hits)", variables="hits = 0"),
        "W535", ("Write self.hits in both",),
    ),
    "a variable above that is assigned": (
        below("hits = 1", above="print(hits)", variables="hits = 0"),
        "W542", ("Write self.hits in both",),
    ),
    "a variable above that cannot be shared": (
        below("print(hits)", above="print(hits, lambda hits: 1)", variables="hits = 0"),
        "W535", (),
    ),
    "a variable above that is not yet there": (
        document(
            sub(
                1, 0, state(1, "top", "print(hits)", child=2), state(2, "first", "hits = 1", initial=True),
                transition(1, 2, 1, "100", type="time"), transition(2, 1, 2, "100", type="time"),
            ),
            sub(2, 1, state(1, "low", "print(hits)", initial=True)),
        ),
        "W535", ("Write self.hits in both",),
    ),
    "pasted code": (one("print(“a”)"), "E520", ("Write straight quotes, hyphens and spaces",)),
    "a pasted condition": (guarded("2 –\u00a01 > 2 or “a”"), "E520", ("Write straight quotes, hyphens and spaces",)),
    "a pasted default": (
        one("print(self.speed)", head=SPEED.format("−1.0")), "E526",
        ("Write straight quotes, hyphens and spaces",),
    ),
}  # fmt: skip
"""A document, the code of a problem that it has, and the names of the fixes of the first such problem."""


@cache
def served() -> dict[str, str]:
    """Return what a Nao serves, as documents declare it."""
    return as_declared(served_interfaces(), find_interfaces())


def offered(text: str, path: Path | None = None) -> list[tuple[Problem, tuple[Fix, ...]]]:
    problems = find_problems(text, path)
    return [*zip(problems, fixes(parse(text, Message("Cannot read")), problems, served()), strict=True)]


def said(text: str, path: Path | None = None) -> Counter[tuple[str, str]]:
    """Return what is wrong or doubtful in a document; notes say what is not known."""
    return Counter((each.code, each.message) for each in find_problems(text, path) if each.severity != "note")


def applied(text: str, fix: Fix) -> str:
    """Return a document after a fix, which travels to the page and back."""
    command = decode_command(msgspec.json.encode(fix.command))
    return written(command.apply(parse(text, Message("Cannot read"))))


def require_fixed(text: str, path: Path | None = None) -> set[str]:
    """Apply each fix of each problem of a document to it, and return the codes of those that have fixes."""
    before, fixed = said(text, path), set[str]()
    for problem, several in offered(text, path):
        for fix in several:
            fixed.add(str(problem.code))
            after = said(applied(text, fix), path)
            what = problem.code, problem.message
            assert after[what] < before[what], (what, fix.name)
            assert after - before == Counter(), (what, fix.name)
    return fixed


@pytest.mark.parametrize("case", CASES)
def test_a_problem_has_these_fixes(case: str) -> None:
    text, code, names = CASES[case]
    found = [several for problem, several in offered(text) if problem.code == code]
    assert found, find_problems(text, None)
    assert tuple(fix.name for fix in found[0]) == names


@pytest.mark.parametrize("case", [name for name, (_, _, fixes) in CASES.items() if fixes])
def test_each_fix_of_a_document_leaves_its_problem_away_and_nothing_new(case: str) -> None:
    assert CASES[case][1] in require_fixed(CASES[case][0])


@pytest.mark.parametrize("name", ["dance", "follow_ball", "get_up"])
def test_the_first_fixes_bring_a_behavior_what_it_imports_and_declares(name: str) -> None:
    before = parse((ROOT / "behaviors" / f"{name}.xml").read_text(), Message("Cannot read"))
    text = written(replace(before, libraries=(), interfaces=()))
    rows = len({each.message for each, several in offered(text) if several})
    assert rows
    for _ in range(rows):
        text = applied(text, next(several[0] for _, several in offered(text) if several))
    assert said(text) == Counter()


@OF_THE_WHOLE
@pytest.mark.slow
def test_each_fix_of_the_examples_of_all_codes_leaves_its_problem_away_and_nothing_new(
    tmp_path: Path,
) -> None:
    fixed = set[str]()
    for section in sections_of("reference/document-errors.md"):
        folder = tmp_path / section.title[:4]
        folder.mkdir()
        files = {each.name or "main.xml": each.text for each in section.blocks if each.language == "xml"}
        for name, text in files.items():
            (folder / name).write_text(text)
        for name, text in files.items():
            with suppress(EditError):  # what cannot be read is not open in a page
                fixed |= require_fixed(written(parse(text, Message("Cannot read"))), folder / name)
    in_cases = {code for _, code, _ in CASES.values()}
    assert fixed - in_cases == {"E535"}  # which the plug-in for ROS reports
