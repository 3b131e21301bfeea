"""Events that nothing sends, and events that nothing waits for."""

from __future__ import annotations

from pathlib import Path

import pytest

from hfsm_runtime import run
from tests.support.documents import compile_to, document, load, problems, state, sub, transition


def test_an_extension_may_send_events(path: Path) -> None:
    there_and_back = (transition(1, 1, 2, "clap", type="event"), transition(2, 2, 1, "100", type="time"))
    text = document(sub(1, 0, state(1, "a", initial=True), state(2, "b"), *there_and_back))
    assert len(problems(path, text)) == 1
    path.with_name("behavior_ext.py").write_text("class BehaviorExtension:\n    pass\n")
    assert problems(path, text) == []


def test_the_runtime_sends_the_event_that_something_was_refused(path: Path) -> None:
    refused = transition(1, 1, 2, "refused", type="event")
    assert problems(path, document(sub(1, 0, state(1, "a", initial=True), state(2, "b"), refused))) == []


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
