"""The effects of a piece of code: the operations that it calls and the events that it sends."""

from __future__ import annotations

import pytest

from codegen.hfsm._effects import CodeEffects
from codegen.hfsm._piece_effects import Effects
from codegen.hfsm.analysis import analyze
from codegen.hfsm.document import Interface, Text
from tests.support.model_documents import PATH, automaton, document, state

FUNCTIONS = """
def send_twice(self, first, second="later"):
    self.send(first)
    self.send(second)

def stop(self, side):
    getattr(self, f"{side}Motors").stop()

@staticmethod
def halt(motors):
    motors.stop()
"""
LEFT, RIGHT = ("LeftMotors", "stop"), ("RightMotors", "stop")


def effects(code: str, variables: str = "") -> Effects:
    root = automaton(1, [state(1, code=code)], functions=Text(FUNCTIONS), variables=Text(variables))
    motors = tuple(Interface(name=f"{side}Motors", type="Motors") for side in ("Left", "Right"))
    doc = document(root, interfaces=motors)
    return CodeEffects(analyze(doc, PATH)).of(doc.automata[0].states[0].code)


@pytest.mark.parametrize(
    ("code", "calls", "possible"),
    [
        ("self.LeftMotors.stop()", {LEFT}, set()),
        ("self.LeftMotors.stop", set(), set()),
        ("self.namespace.LeftMotors.stop()", {LEFT}, set()),
        ('text = f"{self.LeftMotors.stop()!r}"', {LEFT}, set()),
        ("stop = self.LeftMotors.stop\nstop()", {LEFT}, set()),
        ('self.stop("Left")', {LEFT}, set()),
        ("self.halt(self.RightMotors)", {RIGHT}, set()),
        ('for side in ("Left", "Right"):\n    self.stop(side)', set(), {LEFT, RIGHT}),
        ("(self.LeftMotors if x else self.RightMotors).stop()", set(), {LEFT, RIGHT}),
        ("def go():\n    self.LeftMotors.stop()", set(), set()),
        ("def go():\n    self.LeftMotors.stop()\ngo()", {LEFT}, set()),
        ("threading.Thread(target=lambda: self.LeftMotors.stop())", {LEFT}, set()),
    ],
)
def test_operations_that_code_calls(
    code: str, calls: set[tuple[str, str]], possible: set[tuple[str, str]]
) -> None:
    found = effects(code)
    assert (found.calls, found.possible) == (calls, possible)
    assert not found.any_call


@pytest.mark.parametrize(
    ("code", "events"),
    [
        ('self.send("a")', {"a"}),
        ('self.send(name=" a ")', {" a "}),
        ('self.send("a" if x else "b")', {"a", "b"}),
        ('self.send_twice("a", second="b")', {"a", "b"}),
        ('self.send_twice("a")', {"a", "later"}),
        ('for name in ("a", "b"):\n    self.send(name)', {"a", "b"}),
        ('me = self\nme.send("a")', {"a"}),
        ('self.later = lambda: self.send("a")', {"a"}),
        ("socket.send(data)", set()),
    ],
)
def test_events_that_code_sends(code: str, events: set[str]) -> None:
    found = effects(code)
    assert found.events.keys() == events
    assert not found.any_event


@pytest.mark.parametrize(
    ("code", "any_event", "any_call"),
    [
        ("self.send(pick())", True, False),
        ("pick(self.send)", True, False),
        ("pick(self)", True, True),
        ("return self", True, True),
        ("pick(self.LeftMotors)", False, True),
        ("self.stop(pick())", False, True),
        ("getattr(self, pick())", True, True),
        ('getattr(self, f"{pick()}Motors")', False, True),
        ("eval('1')", True, True),
        ("self.send_twice(pick())", True, False),
        ('self.send("a" if x else __file__)', True, False),
        ("print(self, self.LeftMotors)", False, False),
    ],
)
def test_code_that_cannot_be_followed(code: str, any_event: bool, any_call: bool) -> None:
    found = effects(code)
    assert (bool(found.any_event), bool(found.any_call)) == (any_event, any_call)


def test_calls_of_unknown_objects_are_unclear_once_a_proxy_is_passed_on() -> None:
    assert not effects("helper.move()", "helper = Helper()").any_call
    assert effects("helper.move()", "helper = Helper(self.LeftMotors)").any_call


def test_a_function_that_is_called_by_a_computed_name_has_its_effects() -> None:
    assert effects('getattr(self, f"send_{pick()}")("a")').any_event
    assert not effects('getattr(self, f"halt_{pick()}")("a")').any_event
