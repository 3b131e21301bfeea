"""How guards answer when they are evaluated again within a cycle, as far as that can be known."""

from __future__ import annotations

import pytest

from codegen.hfsm._definitions import UNKNOWN, Answer
from codegen.hfsm._effects import CodeEffects
from codegen.hfsm.analysis import analyze
from codegen.hfsm.document import Interface, Library, Text
from tests.support.model_documents import PATH, automaton, document, state, when

FUNCTIONS = """
SPEED = 0.5

def near(self):
    return self.distance < 3

def count(self):
    self.calls = self.calls + 1
    return self.calls

def both(self):
    return self.near() and self.count()

def coin(self):
    return random.random() < SPEED

def again(self):
    return self.again()
"""


def answer(guard: str, variables: str = "", functions: str = FUNCTIONS) -> Answer:
    root = automaton(
        1,
        [state(1), state(2)],
        [when(guard, 1, 2)],
        functions=Text(functions),
        variables=Text(variables),
    )
    libraries = (Library(name=Text("random")), Library(name=Text("numpy as np")))
    doc = document(root, interfaces=(Interface(name="Head", type="PoseHead"),), libraries=libraries)
    return CodeEffects(analyze(doc, PATH)).of(doc.automata[0].transitions[0].trigger).answer


@pytest.mark.parametrize(
    ("guard", "expected"),
    [
        ("n > 3 and not m", Answer.SAME),
        ("abs(n) > 3", Answer.SAME),
        ("max(n, 3) > 3", Answer.SAME),
        ("self.distance > 3", Answer.SAME),
        ("self.near()", Answer.SAME),
        ("self.again()", Answer.SAME),
        ("return n", Answer.SAME),
        ("n in (1, 2)", Answer.SAME),
        ("self.calls > 3", Answer.UNKNOWN),
        ("self.clock.now() > 3", Answer.UNKNOWN),
        ("n.real > 3", Answer.UNKNOWN),
        ("self.Head.getPose()", Answer.OTHER),
        ("self.Head.getPose.latest()", Answer.OTHER),
        ("self.coin()", Answer.OTHER),
        ("np.random.rand() > 3", Answer.OTHER),
        ("next(items)", Answer.OTHER | Answer.CHANGES),
        ("(n := n + 1) > 3", Answer.OTHER | UNKNOWN),
        ("max(n)", UNKNOWN),
        ("n in items", UNKNOWN),
        ("self.count()", UNKNOWN),
        ("self.both()", UNKNOWN),
        ("f(n)", UNKNOWN),
        ("[each for each in n]", UNKNOWN),
        ("self.send('x')", UNKNOWN),
        ("def (", UNKNOWN),
    ],
)
def test_how_a_guard_answers_again(guard: str, expected: Answer) -> None:
    assert answer(guard) == expected


@pytest.mark.parametrize("variables", ["eval('1')", "class Number: pass", "setattr(n, m, 1)"])
def test_nothing_is_sure_to_stay_where_code_may_assign_or_define_anything(variables: str) -> None:
    assert Answer.UNKNOWN in answer("n > 3", variables)
    assert answer("1", variables) == Answer.SAME


def test_a_variable_that_a_function_assigns_may_change() -> None:
    assert Answer.UNKNOWN in answer("n > 3", "def go():\n    nonlocal n\n    n = 4")
