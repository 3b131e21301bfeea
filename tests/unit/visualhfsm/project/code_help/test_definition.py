"""Where names in code are defined, whatever kind of name they are."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document
from tests.support.documents import document, state, sub
from visualhfsm._document.places import Place
from visualhfsm.project._code_help.definition import define

INTERFACE = (
    "<iceinterface><nameinterface>Head</nameinterface><nameproxy>Neck</nameproxy><interface>PoseHead</interface>"
    "</iceinterface>"
)
HEAD = (
    "<parameters><parameter><name>speed</name><type>float</type><default>0.3</default></parameter></parameters>"
    "<events><event><name>ball seen</name></event></events>"
)
TEXT = document(
    sub(1, 0, state(1, "walk", "", initial=True, child=2), variables="# of steps\nsteps, goal = 0, None",
        functions="def find(self, color):\n    goal = color\n    return goal\n"),
    sub(2, 1, state(1, "inside", "other = 1", initial=True), variables="steps = 9",
        functions="def deep(self):\n    hidden = 1\n    return hidden\n"),
    libraries=("math",), config=INTERFACE, head=HEAD,
)  # fmt: skip
WALK = Place(kind="state", automaton=1, id=1, part="code")
INSIDE = Place(kind="state", automaton=2, id=1, part="exit")
FUNCTIONS = Place(kind="automaton", automaton=1, part="functions")


def defined(code: str, place: Place = WALK) -> str | None:
    """Return where the name before `|` is defined, in a few words."""
    before = code.partition("|")[0]
    line, column = before.count("\n") + 1, len(before.rpartition("\n")[2])
    parsed = parse_document(TEXT, Path("walk.xml"), Diagnostics())
    assert parsed is not None
    found = define(parsed, place, code.replace("|", ""), line, column)
    if found is None:
        return None
    owner = found.place.automaton or "document"
    return f"{found.place.part} of {owner}, {found.line}:{found.column}+{found.length}"


@pytest.mark.parametrize(
    ("code", "where"),
    [
        ("steps| += 1", "variables of 1, 2:1+5"),
        ("st|eps = 2", "variables of 1, 2:1+5"),
        ("if goal|: pass", "variables of 1, 2:8+4"),
        ("a = self.fin|d('red')", "functions of 1, 1:5+4"),
        ("a = self.|find('red')", "functions of 1, 1:5+4"),
        ("|steps += 1", "variables of 1, 2:1+5"),
        ("self.deep|()", "functions of 2, 1:5+4"),
        ("self.Head|.setPose(1, 0, 0)", "interfaces of document, 1:1+4"),
        ("self.Head.setPose|(1, 0, 0)", "interfaces of document, 1:1+4"),
        ("x = self.speed|", "parameters of document, 1:1+5"),
        ("self.send('ball |seen')", "events of document, 1:1+9"),
        ("math|.pi", "libraries of document, 1:1+4"),
        ("  ball = 1\n  print(ball|)", "code of 1, 1:3+4"),
        ("ball = 1; steps|", "variables of 1, 2:1+5"),
    ],
)
def test_a_name_leads_to_what_defines_it(code: str, where: str) -> None:
    assert defined(code) == where


def test_other_states_of_the_automaton_define_names_and_other_automata_do_not() -> None:
    assert defined("other|", INSIDE) == "code of 2, 1:1+5"
    assert defined("steps|", INSIDE) == "variables of 2, 1:1+5"
    assert defined("goal|", INSIDE) is None


def test_a_function_has_names_of_its_own() -> None:
    code = (
        "def one(self, color):\n    return color\n\ndef two(self, color):\n    return color| + self.one(1)\n"
    )
    assert defined(code, FUNCTIONS) == "functions of 1, 4:15+5"
    assert (
        defined(code.replace("|", "").replace("self.one", "self.one|"), FUNCTIONS) == "functions of 1, 1:5+3"
    )


@pytest.mark.parametrize(
    "code",
    ["", "|", "self|", "self.Nobody|", "nobody|", "self.find().x|", "1 +| 2", "hidden|", "(" * 3000 + "a|"],
)
def test_what_nothing_defines_leads_nowhere(code: str) -> None:
    assert defined(code) is None
