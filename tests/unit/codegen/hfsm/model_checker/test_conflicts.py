"""Parallel automata that command the same servant."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import resolve, write_document
from codegen.hfsm._effects import CodeEffects
from codegen.hfsm.analysis import analyze
from codegen.hfsm.document import (
    Argument,
    Automaton,
    Document,
    Import,
    Interface,
    Parameter,
    Text,
    Transition,
)
from codegen.hfsm.known_interfaces import find_interfaces
from codegen.hfsm.model_checker import (
    Command,
    Commands,
    Conflict,
    check_model,
    is_command,
    read_operations,
    report_model,
)
from tests.support.model_documents import PATH, Player, after, automaton, document, play, state, when

KNOWN = find_interfaces()
HEAD = Interface(name="Head", type="PoseHead")
LEFT = Interface(name="LeftMotors", proxy="LeftShoulderMotors", type="jderobot::Pose3DMotors")
RIGHT = Interface(name="RightMotors", proxy="RightShoulderMotors", type="Pose3DMotors")
LOOK = "self.Head.setPose(0.0, 0.0, 0.2)"


def operations_of(doc: Document) -> dict[str, Mapping[str, bool]]:
    return read_operations(doc, KNOWN, Diagnostics())


def commanded(code: str, functions: str = "", variables: str = "") -> set[tuple[str, str]]:
    root = automaton(1, [state(1, code=code)], functions=Text(functions), variables=Text(variables))
    doc = document(root, interfaces=(HEAD, LEFT, RIGHT))
    commands = Commands(CodeEffects(analyze(doc, PATH)), operations_of(doc))
    certain, _ = commands.of(doc.automata[0].states[0].code)
    return {(command.identity, command.operation) for command in certain}


MOVE = """
def arm(self, side):
    getattr(self, f"{side}Motors").setPose3DMotorsData(None)

def arms(self):
    self.arm("Left")
    self.arm(side="Right")

def loop(self):
    self.loop()
    self.Head.stop()

def read(self):
    return self.Head.getPose()

def nod(self, who):
    who.setSpeed(0.1, 0.0)

class Holder:
    def __init__(self, component):
        self.component = component

    def move(self):
        self.component.Head.stop()
"""


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        ("self.Head.setPose(1, 2, 3)", {("Head", "setPose")}),
        ("self.Head.setPose.begin(1, 2, 3)", {("Head", "setPose")}),
        ("self.Head.stop()", {("Head", "stop")}),
        ("self.Head.getPose()", set()),
        ("self.Head.getPose.latest()", set()),
        ("self.read()", set()),
        ("self.Other.stop()", set()),
        ("head = self.Head\nhead.stop()", {("Head", "stop")}),
        ("alias.stop()", {("Head", "stop")}),
        ('self.arm("Left")', {("LeftShoulderMotors", "setPose3DMotorsData")}),
        ("self.arm(side)", set()),
        ("self.loop()", {("Head", "stop")}),
        (
            "if self.arms(): pass",
            {("LeftShoulderMotors", "setPose3DMotorsData"), ("RightShoulderMotors", "setPose3DMotorsData")},
        ),
        ("def (", set()),
        ("head = self.Head\nturn = head.setSpeed\nturn(0.1, 0.0)", {("Head", "setSpeed")}),
        ("self.Head.setPose.begin(0, 0, 1)", {("Head", "setPose")}),
        ("self.nod(self.Head)", {("Head", "setSpeed")}),
        ("me = self\nself.nod(who=me.Head)", {("Head", "setSpeed")}),
        ("me = self\nme.Head.stop()", {("Head", "stop")}),
        ("self.mine = self.Head\nself.mine.stop()", {("Head", "stop")}),
        ("threading.Thread(target=self.loop).start()", {("Head", "stop")}),
        (
            "for arm in (self.LeftMotors, self.RightMotors):\n    arm.setPose3DMotorsData(None)",
            set(),  # the one or the other
        ),
    ],
)
def test_what_code_commands(code: str, expected: set[tuple[str, str]]) -> None:
    assert commanded(code, MOVE, "alias = self.Head") == expected


@pytest.mark.parametrize("code", ["self.one()", "self.other()"])
def test_functions_that_call_each_other_command_the_same(code: str) -> None:
    functions = """
def one(self):
    self.other()
    self.Head.stop()

def other(self):
    self.one()
    self.LeftMotors.setPose3DMotorsData(None)
"""
    both = {("Head", "stop"), ("LeftShoulderMotors", "setPose3DMotorsData")}
    assert commanded(code, functions, "self.one()") == both


@pytest.mark.parametrize(
    ("first", "certain"),
    [
        ("head = self.Head\nhead.setSpeed(0.1, 0.0)", True),
        ("self.nod(self.Head)", True),
        ("self.mine.stop()", True),
        ("(self.Head if x else self.LeftMotors).stop()", False),
        ("for each in (self.Head, self.LeftMotors):\n    each.stop()", False),
    ],
)
def test_a_proxy_by_another_name_is_commanded_too(first: str, certain: bool) -> None:
    (found,) = conflicts(siblings(first, LOOK))
    assert found.certain is certain


@pytest.mark.parametrize("guard", ["self.Head.setSpeed(0.1, 0.0)", "self.nod(self.Head) or True"])
@pytest.mark.parametrize("kind", ["condition", "time"])
def test_a_guard_may_command_as_code_does(guard: str, kind: str) -> None:
    way = when(guard, 1, 1) if kind == "condition" else after(200, 1, 1, guard=guard)
    (found,) = conflicts(siblings("", LOOK, way))
    assert found.first.piece == "guard"
    assert found.certain


@pytest.mark.parametrize(
    "code",
    [
        "self.Holder(self).move()",
        "helpers = [self.Head]\nhelpers[0].stop()",
        "def steer(head):\n    head.stop()\nsteer(*[self.Head])",
        'getattr(self, random.choice(["Head", "LeftMotors"])).stop()',
        'side = "Left"\nside = pick()\ngetattr(self, f"{side}Motors").stop()',
        'text = ""\nwhile True:\n    text = text + "a"\n    getattr(self, text).stop()',
        "self.nod(*[self.Head])",
        "return self.Head",
    ],
)
def test_code_that_cannot_be_followed_leaves_conflicts_undecided_and_is_shown(code: str) -> None:
    doc = siblings(code, LOOK)
    report = check_model(doc, PATH)
    assert report.conflicts == ()
    assert not report.complete
    diagnostics = Diagnostics()
    report_model(report, diagnostics)
    assert "this code may command any servant: what depends on it is undecided" in {
        found.message for found in diagnostics if found.code == "N606"
    }


@pytest.mark.parametrize(
    "code",
    ["print(self.Head)", "ready = self.Head is not None", "self.read()", "self.count = len(str(self))"],
)
def test_code_that_gives_a_proxy_to_nobody_leaves_nothing_undecided(code: str) -> None:
    report = check_model(siblings(code, LOOK), PATH)
    assert report.conflicts == ()
    assert report.complete


def test_a_proxy_that_is_handed_to_an_automaton_is_commanded_there() -> None:
    handed = Argument(name="head", child=2, value=Text("self.Head"))
    first = automaton(2, [state(1, code="head.stop()")], father=1, inputs=(Parameter(name="head"),))
    second = automaton(3, [state(1, code=LOOK)], father=1)
    root = automaton(1, [replace(state(1, children=[2, 3]), arguments=(handed,))])
    (found,) = conflicts(document(root, first, second, interfaces=(HEAD,)))
    assert found.certain


@pytest.mark.parametrize(
    ("operation", "idempotent", "expected"),
    [
        ("setPose", None, True),
        ("setPose", True, True),
        ("stop", True, True),
        ("getPose", True, False),
        ("getPose", False, False),
        ("settle", None, None),
        ("launch", False, True),
        ("launch", True, False),
        ("launch", None, None),
    ],
)
def test_which_operations_command(operation: str, idempotent: bool | None, expected: bool | None) -> None:
    assert is_command(operation, idempotent) is expected


def test_operations_of_a_base_are_those_of_the_interface() -> None:
    eye = Interface(name="Eye", type="Camera")
    operations = operations_of(document(interfaces=(eye,)))
    assert operations["Eye"]["getImageData"] is False
    assert operations["Eye"]["setCameraDescription"] is True


@pytest.mark.parametrize("type_name", ["Scene", "scene", "nao::SCENE"])
def test_an_interface_of_an_old_document_is_found_whatever_its_case(type_name: str) -> None:
    # The name alone does not say that this changes something: the description does.
    below = [automaton(number, [state(1, code="self.World.pressSensor()")], father=1) for number in (2, 3)]
    world = Interface(name="World", type=type_name)
    doc = document(automaton(1, [state(1, children=[2, 3])]), *below, interfaces=(world,))
    (found,) = check_model(doc, PATH, operations=operations_of(doc)).conflicts
    assert found.certain


def test_what_an_unknown_operation_does_is_not_certain() -> None:
    (found,) = conflicts(siblings("self.Head.launch()", LOOK))
    assert not found.certain


def conflicts(doc: Document, limit: int = 100_000) -> list[Conflict]:
    return list(check_model(doc, PATH, limit=limit).conflicts)


def siblings(first: str, second: str, *ways: Transition) -> Document:
    """Return two automata of one state each below one state."""
    below = [
        automaton(2, [state(1, code=first)], ways, father=1),
        automaton(3, [state(1, code=second)], father=1),
    ]
    root = automaton(
        1, [state(1, children=[2, 3])], functions=Text(MOVE), variables=Text("self.mine = self.Head")
    )
    return document(root, *below, interfaces=(HEAD, LEFT, RIGHT))


def test_two_automata_of_one_state_each_conflict_where_nothing_ever_changes() -> None:
    below = [automaton(number, [state(1, code=LOOK)], father=1) for number in (2, 3)]
    doc = document(automaton(1, [state(1, children=[2, 3])]), *below, interfaces=(HEAD,))
    (found,) = conflicts(doc)
    assert found.certain


def side_by_side(*second: object, code: str = LOOK) -> Document:
    """Return two automata below one state, of which the first commands the head in its second state."""
    return document(
        automaton(
            1, [state(1, children=[2, 3]), state(2, children=[4])], [after(700, 1, 2), after(700, 2, 1)]
        ),
        automaton(2, [state(1), state(2, code=code)], [after(200, 1, 2), after(200, 2, 1)], father=1),
        automaton(3, [state(1), state(2, code=LOOK)], second, father=1),  # type: ignore[arg-type]
        automaton(4, [state(1, code=LOOK)], father=1),
        interfaces=(HEAD,),
    )


def test_two_that_run_side_by_side() -> None:
    (conflict,) = conflicts(side_by_side(when("g", 1, 2)))
    assert (conflict.first.automaton, conflict.second.automaton) == (1, 2)
    assert conflict.first.command == Command("Head", "Head", "setPose")
    assert not conflict.nested
    assert conflict.certain


def test_the_way_to_a_conflict_leads_there_on_the_runtime() -> None:
    doc = side_by_side(when("g", 1, 2))
    (conflict,) = conflicts(doc)
    assert conflict.counterexample is not None
    player: Player = play(doc, conflict.counterexample)
    assert round(conflict.counterexample.ends_ms * 1e6) in player.times("#2/s2 and #3/s2")


def taking_turns(period: float) -> Document:
    """Return two automata that command the head alternately, 200 ms each."""
    doc = side_by_side()
    second = automaton(
        3, [state(1, code=LOOK), state(2)], [after(200, 1, 2), after(200, 2, 1)], father=1, period=period
    )
    return document(*doc.automata[:2], second, doc.automata[3], interfaces=(HEAD,))


def test_two_whose_timers_keep_them_apart() -> None:
    assert conflicts(taking_turns(100)) == []


def test_two_whose_timers_do_not_quite_keep_them_apart() -> None:
    assert len(conflicts(taking_turns(130))) == 1


def test_two_below_different_states_never_run_together() -> None:
    doc = side_by_side()
    assert conflicts(doc) == []


def test_a_search_that_ends_early_is_not_certain() -> None:
    (conflict,) = conflicts(side_by_side(after(300, 1, 2)), limit=20)
    assert not conflict.certain


def nested(code: str = "", entry: str = "", transition: str = "") -> Document:
    return document(
        automaton(
            1,
            [state(1, children=[2], code=code, entry=entry, exit=entry), state(2, code=LOOK)],
            [after(500, 1, 2, code=transition)],
        ),
        automaton(2, [state(1), state(2, code=LOOK)], [when("g", 1, 2)], father=1),
        interfaces=(HEAD,),
    )


def test_one_below_the_other() -> None:
    (conflict,) = conflicts(nested(code=LOOK))
    assert conflict.nested
    assert (conflict.first.automaton, conflict.first.state) == (0, 0)
    assert (conflict.second.automaton, conflict.second.state) == (1, 1)


def test_entry_exit_and_transitions_above_have_their_own_time() -> None:
    assert conflicts(nested(entry=LOOK, transition=LOOK)) == []


def test_states_that_are_never_entered_command_nothing() -> None:
    doc = nested(code=LOOK)
    unreachable = document(
        doc.automata[0],
        automaton(2, [state(1), state(2, code=LOOK)], [when("False", 1, 2)], father=1),
        interfaces=(HEAD,),
    )
    assert conflicts(unreachable) == []


def test_two_names_of_one_servant_are_one() -> None:
    other = Interface(name="Neck", proxy="Head", type="PoseHead")
    doc = side_by_side(when("g", 1, 2), code="self.Neck.stop()")
    assert conflicts(document(*doc.automata, interfaces=(HEAD,))) == []
    assert len(conflicts(document(*doc.automata, interfaces=(HEAD, other)))) == 1


def test_reading_side_by_side_is_no_conflict() -> None:
    assert conflicts(side_by_side(when("g", 1, 2), code="x = self.Head.getPose()")) == []


def test_an_automaton_that_is_imported_twice_commands_what_each_gets(tmp_path: Path) -> None:
    move = 'getattr(self, f"{side}Motors").setPose3DMotorsData(1)'
    arm = automaton(1, [state(1, code=move)], inputs=(Parameter(name="side", type=Text("str")),))
    (tmp_path / "arm.xml").write_text(write_document(document(arm, interfaces=(LEFT, RIGHT))))
    sides = (
        Argument(name="side", child=2, value=Text("'Left'")),
        Argument(name="side", child=3, value=Text("'Right'")),
    )
    imported = Import(file=Text("arm.xml"))
    doc = document(
        automaton(1, [replace(state(1, children=[2, 3, 4]), arguments=sides)]),
        Automaton(id=2, father=1, imported=imported),
        Automaton(id=3, father=1, imported=imported),
        automaton(4, [state(1, code="self.LeftMotors.setPose3DMotorsData(1)")], father=1),
        interfaces=(LEFT, RIGHT),
    )
    (found,) = conflicts(resolve(doc, tmp_path / "main.xml", Diagnostics()))
    assert found.first.command.identity == "LeftShoulderMotors"
    assert (found.first.automaton, found.second.automaton) == (1, 3)
