"""Code that may take longer than a period leaves the order of timers open."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import pytest

from codegen.diagnostics import Note
from codegen.hfsm._effects import CodeEffects
from codegen.hfsm.analysis import analyze
from codegen.hfsm.document import Document, Functions, Interface, Library, Text
from codegen.hfsm.model_checker import Reachability, Verdict, check_model
from codegen.hfsm.model_checker._durations import slow_code as find_slow_code
from tests.support.duration_forms import QUICK, SLOW, variables_for
from tests.support.model_documents import PATH, after, automaton, document, finished, on, state, stated, when

LATE = after(800, 1, 2, priority=1, id=1)
EARLY = after(500, 1, 3, id=2)


HEAD = tuple(Interface(name=name, type="PoseHead") for name in ("Head", "LeftMotors", "RightMotors"))


def timed(code: str, functions: str = "", libraries: tuple[str, ...] = (), **others: str) -> Document:
    """Return a document in which one timer expires long before another one of a higher priority."""
    states = [state(1, code=code), state(2, "b"), state(3, "c")]
    variables = Text(others.get("variables", ""))
    made = document(
        automaton(1, states, [LATE, EARLY], functions=Text(functions), variables=variables),
        properties=[stated("never", "b"), stated("eventually", "c", "1000")],
        interfaces=HEAD,
    )
    return replace(made, libraries=tuple(Library(name=Text(name)) for name in libraries))


def slow_code(made: Document, path: Path = PATH) -> tuple[Note, ...]:
    return find_slow_code(CodeEffects(analyze(made, path)))[0]


@pytest.mark.parametrize("code", SLOW)
def test_code_that_may_wait_leaves_the_order_of_timers_open(code: str) -> None:
    report = check_model(timed(code, variables=variables_for(code)), PATH)
    assert [each.reachability for each in report.transitions if each.transition == LATE.id] == [
        Reachability.UNDECIDED
    ]
    assert [each.verdict for each in report.properties] == [Verdict.UNDECIDED] * 2
    assert not report.complete
    assert any("longer than a period" in note.message for note in report.doubtful)


@pytest.mark.parametrize("code", QUICK)
def test_other_code_leaves_proofs_as_they_are(code: str) -> None:
    report = check_model(timed(code, variables=variables_for(code)), PATH)
    assert [each.verdict for each in report.properties] == [Verdict.HOLDS] * 2
    assert report.complete


@pytest.mark.parametrize("form", ["open('x').read()", "with open('x') as file:\n    x = file.readlines()"])
def test_a_regular_file_that_is_there_is_read_at_once(form: str, tmp_path: Path) -> None:
    made, path = timed(form), tmp_path / "robot.xml"
    assert slow_code(made, path), "there is no such file"
    (tmp_path / "x").write_text("1")
    assert not slow_code(made, path)
    assert slow_code(timed(form.replace("'x'", "'x', 'a+'")), path), "it is written, too"
    assert slow_code(timed(form.replace("'x'", "name"), variables="name = 'x'"), path)
    (tmp_path / "x").unlink()
    os.mkfifo(tmp_path / "x")
    assert slow_code(made, path)


def test_a_module_beside_the_document_takes_the_place_of_a_library(tmp_path: Path) -> None:
    made, path = timed("x = math.sin(1.0)", libraries=("math",)), tmp_path / "robot.xml"
    assert not slow_code(made, path)
    (tmp_path / "math.py").write_text("")
    assert slow_code(made, path)


@pytest.mark.parametrize(
    ("code", "functions"),
    [
        ("self.f()", "def f(self):\n    self.g()\ndef g(self):\n    self.f()"),
        ("x = self.f", "@property\ndef f(self):\n    return self.f"),
        ("self.f()", "def f(self):\n    getattr(self, 'f')"),
        ("self.f(self.f)", "def f(self, g):\n    g(self.f)"),
        ("self.f()", "f = lambda self: self.f()"),
        ("for x in self.xs:\n    self.put(x)", "xs = [1]\ndef put(self, x):\n    self.xs.append(x)"),
        ("for x in self.more():\n    self.xs.append(x)", "xs = [1]\ndef more(self):\n    yield from self.xs"),
        ("self.x = self.two()", "x = 1\ndef two(self):\n    return self.x, self.x"),
        ("self.x = self.two(self.x)", "x = 1\ndef two(self, y):\n    return [y, [y]]"),
        ("self.n = self.twice(self.n)", "n = 2\ndef twice(self, n):\n    return n * n"),
        ("x = self.p", "@mylib.done\ndef p(self):\n    return 1"),
        (
            "for x in self.xs:\n    getattr(self, 'more')",
            "xs = [1]\n@property\ndef more(self):\n    self.xs.append(1)",
        ),
        (
            "x = self.p",
            "import threading\na = threading.Lock()\n@property\ndef p(self):\n    with self.a:\n        return getattr(self, 'p')",
        ),
        ("x = self == 1", "def __eq__(self, other):\n    return self == other"),
    ],
)
def test_functions_that_go_in_circles_or_grow_what_they_take_are_slow(code: str, functions: str) -> None:
    assert slow_code(timed(code, functions))


@pytest.mark.parametrize(
    "made",
    [
        timed("self.nap()", functions="def nap(self):\n    self.sleep(1)"),
        timed("nap()", variables="import time\nnap = lambda: time.sleep(1)"),
        timed("nap(1)", libraries=("from time import sleep as nap",)),
        timed("wait_long(1)", libraries=("from mylib import *",)),
        timed("camera.read()", libraries=("from mylib import *",)),
        timed("x = max(count())", libraries=("from itertools import *",)),
        timed("x = stdin.read()", libraries=("from sys import *",)),
        timed("get('x')", libraries=("from requests import *", "from math import *")),
        timed("open('x')", libraries=("from os import *",)),
        timed("self.camera.read()", functions="from mylib import camera\ndef f(self):\n    pass"),
        timed("lib.camera.read()", variables="import mylib as lib"),
        replace(timed("self.nap()"), functions=(Functions(text=Text("def nap(me):\n    me.sleep(1)")),)),
    ],
    ids=[
        *("function", "variables", "library", "import *", "import * of an object"),
        *("import * of numbers", "import * of an input", "two import *", "import * of what Python has"),
        *("import among functions", "import in variables", "function of the component"),
    ],
)
def test_functions_and_libraries_are_followed(made: Document) -> None:
    assert [each.verdict for each in check_model(made, PATH).properties] == [Verdict.UNDECIDED] * 2


def test_a_function_of_the_document_may_be_called_sleep() -> None:
    made = timed("self.sleep()", functions="def sleep(self):\n    pass")
    assert [each.verdict for each in check_model(made, PATH).properties] == [Verdict.HOLDS] * 2


@pytest.mark.parametrize("part", ["entry", "code", "exit", "guard", "fired"])
def test_a_parent_that_may_wait_leaves_the_timers_below_it_open(part: str) -> None:
    slow = {"entry": "", "code": "", "exit": "", "guard": "", "fired": "", part: "self.sleep(3)"}
    way = after(1000, 1, 2, slow["guard"], code=slow["fired"])
    parts = {key: slow[key] for key in ("entry", "code", "exit")}
    outer = automaton(1, [state(1, "P", children=[2], **parts), state(2, "Q")], [way])
    inner = automaton(2, [state(1, "a"), state(2, "c")], [after(2000, 1, 2)], father=1)
    (result,) = check_model(document(outer, inner, properties=[stated("never", "P/c")]), PATH).properties
    assert result.verdict is not Verdict.HOLDS


def test_a_cycle_may_be_missed_in_which_a_guard_would_have_fired() -> None:
    outer = automaton(
        1,
        [state(1, "P", children=[2, 3]), state(2, "Q")],
        [finished(1, 2)],
    )
    ends = automaton(
        2, [state(1, code="self.sleep(1)"), state(2, final=True)], [when("True", 1, 2)], father=1
    )
    goes_on = automaton(3, [state(1, "a"), state(2, final=True), state(3, "c")],
                        [when("True", 1, 2), after(100, 1, 3, priority=1)], father=1)  # fmt: skip
    made = document(outer, ends, goes_on, properties=[stated("never", "P/c")])
    assert check_model(made, PATH).properties[0].verdict is Verdict.UNDECIDED


@pytest.mark.parametrize(
    ("part", "expression"),
    [
        ("exit", "a -> active(a)"),
        ("fired", "b -> active(b)"),
        ("entry", "b -> active(b)"),
        ("entry", "ghost(a) and ghost(b) -> c"),
        ("final", "c -> finished(#1)"),
    ],
)
def test_others_see_a_change_that_lasts_before_its_end(part: str, expression: str) -> None:
    slow = {"exit": "", "fired": "", "entry": "", "final": "", part: "self.sleep(3)"}
    states = [
        state(1, "a", children=[2], exit=slow["exit"]),
        state(2, "b", children=[3], entry=slow["entry"]),
        state(3, "c", final=True, entry=slow["final"]),
    ]
    outer = automaton(1, states, [after(200, 1, 2, code=slow["fired"]), after(300, 2, 3)])
    inner = [automaton(2, [state(1)], father=1), automaton(3, [state(1)], father=1)]
    made = document(outer, *inner, properties=[stated("always", expression)])
    assert check_model(made, PATH).properties[0].verdict is Verdict.UNDECIDED


@pytest.mark.parametrize("within", ["100", ""])
def test_an_entry_may_last(within: str) -> None:
    outer = automaton(1, [state(1, "a", children=[2], entry="while not self.found:\n    self.sleep(1)")])
    inner = automaton(2, [state(1, final=True)], father=1)
    coming = [stated("eventually", f"{what}(#2)", within) for what in ("active", "finished")]
    made = document(outer, inner, properties=[*coming, stated("eventually", "a", within)])
    expected = [Verdict.UNDECIDED, Verdict.UNDECIDED, Verdict.HOLDS]
    assert [each.verdict for each in check_model(made, PATH).properties] == expected


def test_what_no_timer_decides_is_still_proved() -> None:
    states = [state(1, code="self.sleep(1)"), state(2, "b"), state(3, "c")]
    made = document(
        automaton(1, states, [on("go", 1, 2), after(100, 2, 1), when("False", 1, 3)]),
        properties=[stated("never", "c")],
    )
    report = check_model(made, PATH)
    assert [each.verdict for each in report.properties] == [Verdict.HOLDS]


@pytest.mark.parametrize("body", ["def nap(self) -> None:\n        self.sleep(1)", "pass"])
def test_hand_written_code_may_do_anything(body: str, tmp_path: Path) -> None:
    (tmp_path / "robot_ext.py").write_text(
        f"from hfsm_runtime import Component\n\n\nclass RobotExtension(Component):\n    {body}\n"
    )
    assert slow_code(timed("self.log.info('x')"), tmp_path / "robot.xml")
