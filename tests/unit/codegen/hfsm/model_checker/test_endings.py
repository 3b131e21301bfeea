"""Code that may end the component: what is to come by then may never come."""

from __future__ import annotations

from dataclasses import replace

import pytest

from codegen.hfsm.document import Document, Library, Text
from codegen.hfsm.model_checker import Verdict, check_model
from tests.support.model_documents import PATH, after, automaton, document, state, stated

PROPERTIES = [stated("eventually", "b"), stated("eventually", "b", "500"), stated("never", "c")]


def ending(code: str, functions: str = "", *libraries: str) -> Document:
    """Return a document whose timer leads on, with code in its first state."""
    states = [state(1, "a", code=code), state(2, "b"), state(3, "c")]
    one = automaton(1, states, [after(300, 1, 2)], functions=Text(functions), variables=Text("tired = False"))
    made = document(one, properties=PROPERTIES)
    return replace(made, libraries=tuple(Library(name=Text(name)) for name in libraries))


@pytest.mark.parametrize(
    "made",
    [
        ending("if tired:\n    sys.exit()", "", "sys"),
        ending("import sys as s\ns.exit(0)"),
        ending("leave()", "", "from sys import exit as leave"),
        ending("from sys import exit\nexit()"),
        ending("raise SystemExit"),
        ending("quit()"),
        ending("exit(0)"),
        ending("import os\nos._exit(0)"),
        ending("s = sys\ns.exit()", "", "sys"),
        ending("self.s = sys\nself.s.exit()", "", "sys"),
        ending("getattr(sys, 'exit')()", "", "sys"),
        ending("operator.methodcaller('exit')(sys)", "", "operator", "sys"),
        ending("raise builtins.SystemExit", "", "builtins"),
        ending("raise Leaving", "", "from builtins import SystemExit as Leaving"),
        ending("self.s.exit()", "import sys as s\ndef f(self):\n    pass"),
        ending("self.exit()", "from sys import exit\ndef f(self):\n    pass"),
        ending("self.leave(sys)", "def leave(me, self):\n    self.exit()", "sys"),
        ending("x = [self.exit() for self in [sys]]", "", "sys"),
        ending("find = getattr\nfind(sys, 'exit')()", "", "sys"),
        ending("call('exit')(sys)", "", "from operator import methodcaller as call", "sys"),
        ending("raise BaseException.__subclasses__()[-1]"),
        ending("exit()", "def exit(self):\n    pass"),
        ending("self.leave()", "def exit(self):\n    pass\ndef leave(self):\n    exit()"),
        ending("self.leave()", "def leave(self):\n    raise SystemExit(0)"),
    ],
)
def test_code_that_may_end_the_component_leaves_open_what_is_to_come(made: Document) -> None:
    report = check_model(made, PATH)
    assert [each.verdict for each in report.properties] == [Verdict.UNDECIDED] * 2 + [Verdict.HOLDS]
    assert any(note.message.startswith("this code may") for note in report.doubtful)
    assert not report.complete


@pytest.mark.parametrize("code", ["exit = tired", "self.exit()"])
def test_other_code_leaves_it_proved(code: str) -> None:
    report = check_model(ending(code, "def exit(self):\n    pass", "sys"), PATH)
    assert [each.verdict for each in report.properties] == [Verdict.HOLDS] * 3
    assert report.complete


def test_a_variable_of_another_automaton_is_not_what_ends() -> None:
    above = automaton(1, [state(1, children=[2, 3])])
    ends = automaton(2, [state(1, code="exit()"), state(2, "b")], [after(300, 1, 2)], father=1)
    other = automaton(3, [state(1, code="exit = 2")], father=1, variables=Text("exit = 1"))
    made = document(above, ends, other, properties=[stated("eventually", "#2/b")])
    assert check_model(made, PATH).properties[0].verdict is Verdict.UNDECIDED


def test_what_ends_it_takes_no_time() -> None:
    late = after(400, 1, 3, id=2, priority=1)
    made = ending("if tired:\n    sys.exit()", "", "sys")
    one = replace(made.automata[0], transitions=(late, *made.automata[0].transitions))
    report = check_model(replace(made, automata=(one,)), PATH)
    assert [str(each.reachability) for each in report.transitions if each.transition == 2] == ["impossible"]
    assert "this code may end the component" in [note.message for note in report.doubtful]


def test_what_is_so_at_the_start_has_come() -> None:
    made = replace(ending("raise SystemExit"), properties=(stated("eventually", "a"),))
    assert check_model(made, PATH).properties[0].verdict is Verdict.HOLDS
