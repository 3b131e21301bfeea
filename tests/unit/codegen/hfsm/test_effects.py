"""The verdicts of the model checker and the checks against the runtime, for code with aliases and state.

Documents are compiled and run in virtual time: what is called impossible or proved never happens otherwise.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from codegen.diagnostics import Diagnostics
from codegen.hfsm import write_document
from codegen.hfsm.document import Document, Interface, Library, Text
from codegen.hfsm.loading import check_document
from codegen.hfsm.model_checker import (
    ModelReport,
    Reachability,
    Verdict,
    WhyNever,
    check_model,
    report_model,
)
from tests.support.coded_documents import Visits, commanded, run
from tests.support.examples import examples
from tests.support.model_documents import PATH, after, automaton, document, on, state, stated, when

FUNCTIONS = {
    "coin": """def coin(self):
    return random.random() < 0.5
""",
    "often": """def often(self):
    return self.coin() or self.coin()
""",
    "fixed": """def fixed(self):
    return math.hypot(3.0, 4.0) > 4
""",
    "tick": """def tick(self):
    self.ticks = getattr(self, "ticks", 0) + 1
    return self.ticks % 2 == 0
""",
    "turn": """def turn(self, counts=[0]):
    counts[0] += 1
    return counts[0] % 3 == 0
""",
    "take": """def take(self):
    if not hasattr(self, "left"):
        self.left = iter([True, False, False, True] * 99)
    return next(self.left)
""",
    "emit": """def emit(self, who, name):
    who.send(name)
""",
    "say": """def say(self):
    super().send("x")
""",
    "Holder": """class Holder:
    def __init__(self, component):
        self.component = component

    def notify(self):
        self.component.send("x")
""",
    "Toggle": """class Toggle:
    def __init__(self):
        self.calls = 0

    def __bool__(self):
        self.calls += 1
        return self.calls % 2 == 0

    @property
    def value(self):
        return bool(self)
""",
}
VARIABLES = {
    "toggle": "toggle = self.Toggle()",
    "items": "items = [True, False] * 99",
    "draw": "draw = iter([True, False] * 99)",
    "n": "n = 0",
}

SENDS = [
    'self.send("x")',
    'me = self\nme.send("x")',
    'send = self.send\nsend("x")',
    "self.Holder(self).notify()",
    'self.emit(self, "x")',
    '(lambda c: c.send("x"))(self)',
    'def notify(c):\n    c.send("x")\nnotify(self)',
    'type(self).send(self, "x")',
    'getattr(self, "send")("x")',
    'getattr(self, "se" + "nd")("x")',
    'operator.methodcaller("send", "x")(self)',
    'operator.methodcaller("".join(["se", "nd"]), "x")(self)',
    'functools.partial(self.send, "x")()',
    '[c.send("x") for c in (self,)]',
    'eval("c.s" + "end(chr(120))", {"c": self})',
    'self._hfsm_send("x", None)',
    'name = "y"\nname, other = "x", "y"\nself.send(name)',
    'name = "y" if self is None else "".join("x")\nself.send(name)',
    "self.say()",
    'getattr(self, "s" + "".join("ay"))()  # say',
    "self.send.__self__.send(name='x')",
    '{"me": self}["me"].send(name="x")',
    'match self:\n    case object(send=notify):\n        notify("x")',
]
GUARDS = [
    "self.coin()", "not self.coin()", "self.often()", "self.tick()", "not self.tick()", "self.turn()",
    "not self.turn()", "self.take()", "not self.take()", "self.fixed()", "not self.fixed()", "bool(toggle)",
    "toggle", "not toggle", "toggle.value", "items.pop()", "not items.pop()", "next(draw)", "not next(draw)",
    "True in draw", "not (True in draw)", "(n := n + 1) % 3 == 0", "n % 3 == 0", "not (n % 3 == 0)",
    "random.random() < 0.5", "not (random.random() < 0.5)", "any(draw)", "len(items) % 2", "not len(items) % 2",
    "self.coin() and not self.coin()", '"a" == b"a"', "return self.tick()", "self.ticks > 3",
]  # fmt: skip
LIBRARIES = tuple(Library(name=Text(name)) for name in ("random", "math", "operator", "functools"))


def coded(*outgoing: str, code: str = "", event: bool = False) -> Document:
    """Return a document with a state `s1`, which guards leave to others, and properties of it."""
    ways = [when(guard, 1, number + 2, id=number + 1) for number, guard in enumerate(outgoing)]
    if event:
        ways.append(on("x", 1, len(ways) + 2, id=len(ways) + 1))
    states = [state(1, code=code), *(state(number + 2) for number in range(len(ways)))]
    others = [f"s{number + 2}" for number in range(len(ways))]
    text = "\n".join([*outgoing, code])
    variables = "\n".join(_mentioned(VARIABLES, text))
    functions = "\n".join(_mentioned(FUNCTIONS, f"{text}\n{variables}"))
    properties = [stated("never", other) for other in others]
    properties += [stated("eventually", " or ".join(others), within) for within in ("100", "200", "500")]
    return document(
        automaton(1, states, ways, functions=Text(functions), variables=Text(variables)),
        properties=properties,
        libraries=LIBRARIES,
    )


def _mentioned(definitions: dict[str, str], text: str) -> list[str]:
    """Return the definitions that a text mentions, and those that they mention."""
    found: dict[str, str] = {}
    for _ in definitions:
        words = set(re.findall(r"\w+", "\n".join([text, *found.values()])))
        found = {name: code for name, code in definitions.items() if name in words}
    return list(found.values())


def assert_agrees(report: ModelReport, diagnostics: Diagnostics, seen: Visits) -> None:
    for transition in report.transitions:
        assert not (
            transition.reachability is Reachability.IMPOSSIBLE and transition.transition in seen.fired_
        ), transition
    for result in report.properties:
        if result.verdict is not Verdict.HOLDS:
            continue
        wanted = {int(name[1:]) for name in result.property.expression.text.split(" or ")}
        times = [at for number, at in seen.first.items() if number in wanted]
        if result.property.kind == "never":
            assert not times, result.property
        else:
            assert times, result.property
            assert min(times) <= float(result.property.within.text) * 1e6, result.property
    for found in diagnostics:
        if found.code == "W516":
            number = int(found.message.split()[1])
            assert number not in seen.fired_, found.message


def checked(doc: Document, directory: Path) -> tuple[ModelReport, Diagnostics, Path]:
    path = directory / "coded.xml"
    path.write_text(write_document(doc), encoding="utf-8")
    diagnostics = Diagnostics()
    report = check_document(path, diagnostics)
    assert report is not None, diagnostics.render()
    return report, diagnostics, path


@pytest.mark.parametrize("code", SENDS)
def test_an_event_that_code_sends_by_any_name_is_not_called_impossible(code: str, tmp_path: Path) -> None:
    report, diagnostics, path = checked(coded(code=code, event=True), tmp_path)
    assert 2 in run(path, 0).first
    assert report.properties[0].verdict is not Verdict.HOLDS
    assert "W526" not in {found.code for found in diagnostics}


def test_what_only_code_that_cannot_be_followed_may_send_is_undecided_and_said(tmp_path: Path) -> None:
    report, diagnostics, _ = checked(coded(code='getattr(self, "".join("foo"))', event=True), tmp_path)
    assert report.properties[0].verdict is Verdict.UNDECIDED
    assert not report.complete
    assert "this code may send any event" in "".join(f.message for f in diagnostics if f.code == "N606")


def test_without_such_code_an_event_that_nothing_sends_is_impossible(tmp_path: Path) -> None:
    report, diagnostics, _ = checked(coded(code='getattr(self, f"{n}Motors", None)', event=True), tmp_path)
    assert report.properties[0].verdict is Verdict.HOLDS
    assert "W526" in {found.code for found in diagnostics}


@pytest.mark.parametrize("guard", ["self.coin()", "self.often()", "random.random() < 0.5", "self.take()"])
def test_guards_that_draw_lots_make_no_proof_and_may_fail(guard: str) -> None:
    verdicts = {
        each.property.within.text: each.verdict
        for each in check_model(coded(guard, f"not {guard}"), PATH).properties
    }
    assert verdicts["200"] is Verdict.VIOLATED


@pytest.mark.parametrize("guard", ["self.tick()", "self.turn()", "toggle.value"])
def test_guards_with_state_are_undecided_and_said(guard: str) -> None:
    report = check_model(coded(guard, f"not ({guard})"), PATH)
    assert report.properties[-1].verdict is Verdict.UNDECIDED
    diagnostics = Diagnostics()
    report_model(report, diagnostics)
    assert "N606" in {found.code for found in diagnostics}


def test_an_object_may_be_true_when_it_is_asked_again(tmp_path: Path) -> None:
    report, diagnostics, path = checked(coded("toggle", "toggle"), tmp_path)
    seen = run(path, 0)
    assert 2 in seen.fired_, "the second of two guards that read the same"
    assert_agrees(report, diagnostics, seen)


@pytest.mark.parametrize("guard", ["self.fixed()", "n > 3", "math.sin(n) > 0.5", "n is None"])
def test_guards_without_state_still_prove(guard: str) -> None:
    doc = coded(guard, f"not ({guard})")
    assert check_model(doc, PATH).properties[-1].verdict is Verdict.HOLDS


def test_a_comparison_of_constants_has_one_truth() -> None:
    report = check_model(coded('"a" == b"a"'), PATH)
    assert report.properties[0].verdict is Verdict.HOLDS
    assert report.transitions[0].why is WhyNever.GUARD


def test_a_read_of_a_sensor_is_another_each_time() -> None:
    doc = coded("self.Head.getPose().pan > 0", "not (self.Head.getPose().pan > 0)")
    head = Interface(name="Head", type="PoseHead")
    doc = document(*doc.automata, properties=doc.properties, interfaces=(head,))
    assert check_model(doc, PATH).properties[-1].verdict is not Verdict.HOLDS


@settings(
    max_examples=examples(6),
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
@given(
    guards=st.lists(st.sampled_from(GUARDS), min_size=1, max_size=4),
    code=st.sampled_from(["", "n += 1", *SENDS]),
    event=st.booleans(),
)
def test_no_verdict_is_wrong_for_code_with_aliases_and_state(
    guards: list[str], code: str, event: bool, tmp_path: Path
) -> None:
    report, diagnostics, path = checked(coded(*guards, code=code, event=event), tmp_path)
    for seed in range(3):
        assert_agrees(report, diagnostics, run(path, seed))


HELPERS = """
HELPERS = True

def nod(self, who, *others):
    who.setSpeed(0.1, 0.0)
    for other in others:
        other.stop()

def turn(self, side):
    getattr(self, side).setPose(0.0, 0.0, 0.5)

def keep(self):
    global kept
    kept = self.Head

def store(self, head):
    global kept
    kept = head

def kept(self):
    kept.stop()

def toggle(self):
    self.count = getattr(self, "count", 0) + 1
    (self.Head if self.count % 2 else self.Neck).stop()

def choose(self):
    return self.Neck if self.sides else self.Head

class Holder:
    def __init__(self, component):
        self.component = component

    def move(self):
        self.component.Head.stop()

def inside(self):
    eval("self.Neck.stop()")

@property
def late(self):
    self.Head.stop()

@staticmethod
def still(proxy):
    proxy.stop()

if HELPERS:
    def hidden(self):
        self.Neck.stop()
"""
START = """
self.mine = self.Head
self.sides = ["Head", "Neck"]
shared = self.Neck
"""
COMMANDS = [
    "self.Head.setPose(0.0, 0.0, 0.2)", "self.Neck.stop()", "self.Head.getPose()", "head = self.Head\nhead.stop()",
    "turn = self.Neck.setSpeed\nturn(0.1, 0.0)", "me = self\nme.Head.stop()", "self.mine.stop()", "shared.stop()",
    "self.nod(self.Head)", "self.nod(who=self.Neck)", "self.nod(self.Head, self.Neck)", 'self.turn("Neck")',
    "self.nod(*[self.Neck])", 'self.turn(random.choice(["Head"]))', "self.toggle()", "self.choose().stop()",
    "self.Holder(self).move()", "(lambda head: head.stop())(self.Head)", "[each.stop() for each in (self.Head, self.Neck)]",
    'side = "He"\nself.turn(f"{side}ad")', 'for side in self.sides:\n    getattr(self, side).stop()',
    "{1: self.Head}[1].stop()", "functools.partial(self.Neck.stop)()", 'vars(self)["mine"].stop()',
    "first, second = self.Head, self.Neck\nsecond.stop()", "def go(h):\n    h.stop()\ngo(self.Neck)",
    'operator.methodcaller("stop")(self.Head)', 'operator.attrgetter("Head")(self).stop()', "",
    'setattr(self, "late", self.Neck)\nself.late.stop()', "head = None\nhead = head or self.Head\nhead.stop()",
    "with contextlib.nullcontext(self.Head) as head:\n    head.stop()", "self.Head.__class__.stop(self.Head)",
    "self.keep()\nself.kept()", "self.store(head := self.Neck)\nself.kept()",
    "for self.each in (self.Head, self.Neck):\n    self.each.stop()", "global h\nh = self.Head\nh.stop()",
]  # fmt: skip


LEFT_BEHIND = [
    ("def turn():\n    self.Head.stop()", "turn()"),
    ("turn = lambda: self.Head.stop()", "turn()"),
    ("turn = self.Head.stop", "turn()"),
    ("self.turn = lambda: self.Head.stop()", "self.turn()"),
    ("helpers = [self.Head]", "helpers[0].stop()"),
    ("helper = self.Holder(self)", "helper.move()"),
    ("global kept\nkept = self.Head", "self.kept()"),
    ("global go\ndef go():\n    self.Head.stop()", "go()"),
    ("class Helper:\n    def move(me):\n        self.Head.stop()\nhelper = Helper()", "helper.move()"),
    ('name = "Head"', "getattr(self, name).stop()"),
]
"""What code of one state leaves to that of another, which commands the head."""


def siblings(first: str, second: str, *, guard: bool) -> Document:
    """Return two parallel automata; the code of the first may be in a guard instead."""
    heads = [Interface(name=name, type="PoseHead") for name in ("Head", "Neck")]
    ways = [when(f"{first}\nreturn False", 1, 2)] if guard else []
    states = [state(1, code="" if guard else first), *([state(2)] if guard else [])]
    return document(
        automaton(1, [state(1, children=[2, 3])], functions=Text(HELPERS), variables=Text(START)),
        automaton(2, states, ways, father=1, variables=Text("shared = self.Neck")),
        automaton(3, [state(1, code=second)], father=1, variables=Text("shared = self.Neck")),
        interfaces=heads,
        libraries=(*LIBRARIES, Library(name=Text("contextlib"))),
    )


@settings(
    max_examples=examples(6),
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
@given(first=st.sampled_from(COMMANDS), second=st.sampled_from(COMMANDS), guard=st.booleans())
def test_no_conflict_of_code_with_aliases_and_helpers_is_denied_or_made_up(
    first: str, second: str, guard: bool, tmp_path: Path
) -> None:
    report = check_model(siblings(first, second, guard=guard), PATH)
    of_first = commanded(siblings(first, "", guard=guard), tmp_path)
    of_second = commanded(siblings("", second, guard=False), tmp_path)
    found = {conflict.first.command.identity: conflict.certain for conflict in report.conflicts}
    if report.complete:
        assert of_first & of_second <= found.keys()
    else:
        assert report.doubtful or not all(found.values())
    assert {identity for identity, certain in found.items() if certain} <= of_first & of_second


@pytest.mark.parametrize(("first", "then"), LEFT_BEHIND)
def test_what_a_state_leaves_to_another_is_followed_or_undecided(
    first: str, then: str, tmp_path: Path
) -> None:
    below = [
        automaton(2, [state(1, code=first), state(2, code=then)], [after(200, 1, 2)], father=1),
        automaton(3, [state(1), state(2, code="self.Head.stop()")], [after(200, 1, 2)], father=1),
    ]
    root = automaton(1, [state(1, children=[2, 3])], functions=Text(HELPERS))
    doc = document(root, *below, interfaces=(Interface(name="Head", type="PoseHead"),))
    still = replace(below[1], states=(state(1), state(2)))
    assert commanded(replace(doc, automata=(root, below[0], still)), tmp_path) == {"Head"}
    report = check_model(doc, PATH)
    assert report.conflicts or not report.complete
