"""Warnings about code and their places, the effect of extensions, and unusual code."""

from __future__ import annotations

from pathlib import Path

import pytest

from hfsm_runtime import run
from tests.support.documents import compile_to, document, load, problems, state, sub, transition


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "behavior.xml"


def with_code(code: str, functions: str = "", variables: str = "") -> str:
    return document(sub(1, 0, state(1, "a", code, initial=True), functions=functions, variables=variables))


@pytest.mark.parametrize(
    "code",
    [
        "distance",
        "\n        if True:\n            distance\n    ",
        '\n    text = """\nno\n  indentation"""; distance\n    print(text)',
        "print('ñandú', distance)",
    ],
)
def test_the_place_is_that_in_the_document(path: Path, code: str) -> None:
    text = with_code(code)
    before = text[: text.index("distance")]
    line, column = before.count("\n") + 1, len(before) - before.rfind("\n")
    assert problems(path, text) == [f"{line}:{column}: W520: `distance` is not defined"]


def test_a_condition_that_is_no_expression_is_reported_once(path: Path) -> None:
    there_and_back = (transition(1, 1, 2, "seen, near"), transition(2, 2, 1, "100", type="time"))
    text = document(sub(1, 0, state(1, "a", initial=True), state(2, "b"), *there_and_back))
    assert [problem.split(": ")[1] for problem in problems(path, text)] == ["E520"]


def test_a_statement_that_returns_is_a_condition(path: Path) -> None:
    there_and_back = (
        transition(1, 1, 2, "limit = 3\nreturn self.clock.now() &gt; limit".replace("&gt;", ">")),
        transition(2, 2, 1, "100", type="time"),
    )
    text = document(sub(1, 0, state(1, "a", initial=True), state(2, "b"), *there_and_back))
    assert problems(path, text) == []


def test_the_extension_gives_attributes(path: Path) -> None:
    text = with_code("self.wave(self.speed)")
    assert len(problems(path, text)) == 2
    path.with_name("behavior_ext.py").write_text(
        "class BehaviorExtension:\n    speed = 3\n\n    def wave(self, speed):\n        self.last = speed\n"
    )
    assert problems(path, text) == []


def test_an_extension_with_a_base_may_give_any_attribute(path: Path) -> None:
    path.with_name("behavior_ext.py").write_text(
        "from lab import Base\n\n\nclass BehaviorExtension(Base):\n    pass\n"
    )
    assert problems(path, with_code("self.wave()")) == []


def test_an_extension_may_send_events(path: Path) -> None:
    there_and_back = (transition(1, 1, 2, "clap", type="event"), transition(2, 2, 1, "100", type="time"))
    text = document(sub(1, 0, state(1, "a", initial=True), state(2, "b"), *there_and_back))
    assert len(problems(path, text)) == 1
    path.with_name("behavior_ext.py").write_text("class BehaviorExtension:\n    pass\n")
    assert problems(path, text) == []


def test_the_component_by_the_names_of_visualstates(path: Path) -> None:
    code = "self.globalNamespace.speed = 3\nself.rosNode.go(self.namespace.speed)\nself.interfaces.stop()"
    found = problems(path, with_code(code, functions="def go(self, speed):\n    pass"))
    assert [problem.split(": ", 1)[1][:30] for problem in found] == ["W524: `self.stop` is not an in"]


def test_a_sleep_is_reported_for_the_shortest_period_that_calls_it(path: Path) -> None:
    functions = "def rest(self):\n    self.nap()\n\ndef nap(self):\n    self.sleep(0.5)"
    fast = sub(2, 1, state(1, "b", "self.rest()", initial=True), period="200")
    text = document(
        sub(1, 0, state(1, "a", "self.rest()", initial=True, child=2), period="1000", functions=functions),
        fast,
    )
    (found,) = problems(path, text)
    assert "W523: `self.sleep` waits for 0.5 s, longer than the period" in found
    assert problems(path, text.replace(">200<", ">600<")) == []


def test_automata_that_own_one_another_are_reported_and_end_the_checks(path: Path) -> None:
    def restarting(id: int, father: int, child: int) -> str:
        timed = transition(id, 1, 1, "100", type="time")
        owner = state(1, "a", initial=True, child=child)
        return sub(id, father, owner.replace("<code>", "<history>restart</history><code>"), timed)

    text = document(sub(1, 0, state(1, "a", initial=True)), restarting(2, 3, 3), restarting(3, 2, 2))
    assert any("is its own ancestor" in problem for problem in problems(path, text))


def test_code_may_be_nested_as_deeply_as_python_allows(path: Path) -> None:
    loops = "\n".join(f"{'  ' * level}for i{level} in range(2):" for level in range(19))
    assert problems(path, with_code(f"{loops}\n{'  ' * 19}self.log.info(str(i18))")) == []


@pytest.mark.parametrize(
    "code", [" + ".join(["1"] * 5000), "x = " + "-" * 300 + "1", "if 0: pass\n" + "elif 0: pass\n" * 400]
)
def test_code_that_is_too_deep_to_look_into_is_left_alone(path: Path, code: str) -> None:
    assert [problem for problem in problems(path, with_code(code)) if "W5" in problem] == []


def test_a_name_that_a_base_class_assigns_is_defined(path: Path) -> None:
    a = state(1, "a", "class A((base := object)): pass\nprint(A)", initial=True)
    text = document(sub(1, 0, a, state(2, "b", "print(base)"), transition(1, 1, 2, "100", type="time")))
    assert [problem for problem in problems(path, text) if "base" in problem] == []


def family(**code: str) -> str:
    """Return a document in which the automaton 2 waits for `go`: it is below `a`, like 3, and 4 is below `b`."""
    made = {key: code.get(key, "pass") for key in ("entry", "code", "guard", "fired", "beside", "elsewhere")}
    return """<VisualHFSM>
<SubAutomata id="1" idFather="0">
<state id="1" initial="true"><name>a</name><idSubautomataSon>2</idSubautomataSon><child>3</child>
<entry>{entry}</entry><code>{code}</code></state>
<state id="2"><name>b</name><idSubautomataSon>4</idSubautomataSon></state>
<transition id="1"><origin>1</origin><destiny>2</destiny><trans type="time">500</trans><guard>{guard} or self.clock.now() &gt; 1</guard></transition>
<transition id="2"><origin>2</origin><destiny>1</destiny><trans type="time">500</trans><transcode>{fired}</transcode></transition>
</SubAutomata>
<SubAutomata id="2" idFather="1"><state id="1" initial="true"><name>x</name></state><state id="2"><name>y</name></state>
<transition id="1"><origin>1</origin><destiny>2</destiny><trans type="event">go</trans></transition></SubAutomata>
<SubAutomata id="3" idFather="1"><state id="1" initial="true"><name>c</name><code>{beside}</code></state></SubAutomata>
<SubAutomata id="4" idFather="1"><state id="1" initial="true"><name>d</name><code>{elsewhere}</code></state></SubAutomata>
</VisualHFSM>""".format(**(made | {"guard": code.get("guard", "False")}))


@pytest.mark.parametrize(
    ("where", "arrives"),
    [
        ("code", True),
        ("guard", True),
        ("beside", True),
        ("entry", False),
        ("fired", False),
        ("elsewhere", False),
    ],
)
def test_an_event_that_only_ghosts_wait_for_is_reported(path: Path, where: str, arrives: bool) -> None:
    text = family(**{where: 'self.send("go")'})
    unheard = "W526: the event `go` is sent only while the automaton of transition 1 is a ghost"
    assert (unheard in [line.partition(" ")[2] for line in problems(path, text)]) != arrives
    virtual = run(load(compile_to(path.parent, text)), 3)
    assert ("y" in [change.state for change in virtual.trace]) == arrives


@pytest.mark.parametrize("what", ['self.later = lambda: self.send("go")', 'x = "go"; self.send("go")'])
def test_an_event_that_may_be_sent_later_is_not_called_unheard(path: Path, what: str) -> None:
    assert not any("W526" in line for line in problems(path, family(entry=what)))


@pytest.mark.parametrize(
    "code", ['self.send("come")', 'send = self.send; send("come")', 'x = "come"; self.send(x)']
)
def test_an_event_that_nothing_waits_for_is_reported_where_it_is_sent(path: Path, code: str) -> None:
    text = family(code=code, beside='self.send("go")')
    (line,) = [number for number, line in enumerate(text.split("\n"), 1) if code in line]
    (found,) = [line for line in problems(path, text) if "W527" in line]
    assert "no transition waits for the event `come`" in found
    assert found.startswith(f"{line}:")
