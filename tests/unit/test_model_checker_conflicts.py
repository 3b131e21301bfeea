"""Automata that run side by side and command the same servant."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm.document import Document, Interface, Text
from codegen.hfsm.model_checker import Command, Commands, Conflict, check_model, is_command, read_operations
from tests.support.model_documents import PATH, Player, after, automaton, document, play, state, when

ROOT = Path(__file__).resolve().parents[2]
SCHEMAS = [ROOT / "interfaces" / package / "schema.json" for package in ("nao", "jderobot")]
HEAD = Interface(name="Head", type="PoseHead")
LEFT = Interface(name="LeftMotors", proxy="LeftShoulderMotors", type="jderobot::Pose3DMotors")
RIGHT = Interface(name="RightMotors", proxy="RightShoulderMotors", type="Pose3DMotors")
LOOK = "self.Head.setPose(0.0, 0.0, 0.2)"


def commanded(code: str, functions: str = "", variables: str = "") -> set[tuple[str, str]]:
    doc = document(automaton(1, [state(1)], functions=Text(functions)), interfaces=(HEAD, LEFT, RIGHT))
    commands = Commands(doc, read_operations(SCHEMAS, Diagnostics()))
    found = commands.of(Text(code), commands.aliases(Text(variables)))
    return {(command.identity, command.operation) for command in found}


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
"""


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        ("self.Head.setPose(1, 2, 3)", {("Head", "setPose")}),
        ("self.Head.setPoseAsync(1, 2, 3)", {("Head", "setPose")}),
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
    ],
)
def test_what_code_commands(code: str, expected: set[tuple[str, str]]) -> None:
    assert commanded(code, MOVE, "alias = self.Head") == expected


@pytest.mark.parametrize(
    ("operation", "idempotent", "expected"),
    [
        ("setPose", None, True),
        ("setPose", True, True),
        ("stop", True, True),
        ("getPose", True, False),
        ("getPose", False, False),
        ("settle", None, False),
        ("launch", False, True),
        ("launch", True, False),
        ("launch", None, False),
    ],
)
def test_which_operations_command(operation: str, idempotent: bool | None, expected: bool) -> None:
    assert is_command(operation, idempotent) is expected


def test_operations_of_a_base_are_those_of_the_interface() -> None:
    operations = read_operations(SCHEMAS, Diagnostics())
    assert operations["Camera"]["getImageData"] is False
    assert operations["Camera"]["setCameraDescription"] is True


def conflicts(doc: Document, limit: int = 100_000) -> list[Conflict]:
    return list(check_model(doc, PATH, limit=limit).conflicts)


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
    """Return two automata that command the head by turns, 200 ms each."""
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
