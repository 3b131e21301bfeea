"""Outputs in generated components: their errors at the line that is wrong, imports, and another version while they run."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import pytest

from hfsm_runtime import VirtualRun
from hfsm_runtime.virtual import Execution
from tests.support.documents import compile_to, document, load, state, sub, transition


def two(code: str, *, root: str = "", output: str = "bool", default: str = "False", entry: str = "") -> str:
    """Return a document whose root takes `found` into `seen`; the code below begins in line 9."""
    owner = state(1, "search", root, initial=True, child=2)
    owner = owner.replace("</state>", '<result name="found">seen</result></state>')
    below = state(1, "look", code, initial=True).replace("</state>", f"<entry>{entry}</entry></state>")
    declared = f"<output><name>found</name><type>{output}</type><default>{default}</default></output>\n"
    return document(
        sub(1, 0, owner, variables="seen = None"), sub(2, 1, declared, below, transition(1, 1, 1, "False"))
    )


@pytest.mark.parametrize(
    ("code", "line"),
    [
        ('found = "yes"', 0),
        ("found = True\nif self.clock.now() >= 0:\n    found = 1", 2),
    ],
)
def test_a_value_of_another_type_is_reported_where_it_was_assigned(
    tmp_path: Path, code: str, line: int, caplog: pytest.LogCaptureFixture
) -> None:
    text = two(code)
    first = next(number for number, each in enumerate(text.split("\n"), 1) if "found =" in each)
    with caplog.at_level(logging.ERROR):
        virtual = VirtualRun(load(compile_to(tmp_path, text)))
        virtual.advance(0.2)
    (error,) = virtual.errors
    assert error.location.endswith(f"(behavior.xml:{first + line})")
    assert "the output 'found' of automaton 2 ('search') is bool, not" in error.message
    assert error.location in caplog.text  # from where the page takes it


def test_the_last_assignment_of_the_state_is_meant(tmp_path: Path) -> None:
    text = two("found = found\nfound = 2", entry="found = True")
    virtual = VirtualRun(load(compile_to(tmp_path, text)))
    virtual.advance(0.2)
    first = next(number for number, each in enumerate(text.split("\n"), 1) if "found = found" in each)
    assert virtual.errors[0].location.endswith(f"(behavior.xml:{first + 1})")


def seen_by(virtual: VirtualRun | Execution) -> list[Any]:
    found: list[Any] = vars(virtual.component)["all"]
    return found


NOTED = "if not hasattr(self, 'all'): self.all = []\nself.all.append(seen)"


def test_two_automata_of_one_file_each_hand_up_their_own(tmp_path: Path) -> None:
    below = two("pass").split("<SubAutomata")[2].partition("</SubAutomata>")[0]
    content = f"<SubAutomata{below}</SubAutomata>".replace('id="2" idFather="1"', 'id="1" idFather="0"')
    content = content.replace("<code>pass</code>", "<code>found = self.clock.now() &gt;= start</code>")
    content = content.replace(
        "<output>", "<input><name>start</name><type>float</type><default>0.2</default></input><output>"
    )
    (tmp_path / "below.xml").write_text(f"<VisualHFSM>{content}</VisualHFSM>")
    owner = state(1, "search", f"{NOTED}\nself.all[-1] = seen, other", initial=True, child=2).replace(
        "</state>",
        '<child>3</child><argument name="start" child="3">0.1</argument>'
        '<result name="found" child="2">seen</result><result name="found" child="3">other</result></state>',
    )
    stub = '<SubAutomata id="2" idFather="1"><import>below.xml</import></SubAutomata>'
    text = document(sub(1, 0, owner, variables="seen = other = None"), stub, stub.replace('"2"', '"3"'))
    virtual = VirtualRun(load(compile_to(tmp_path, text)))
    virtual.advance(0.3)
    assert seen_by(virtual) == [(False, False), (False, False), (False, True), (True, True)]


def test_another_version_while_it_runs_keeps_the_outputs(tmp_path: Path) -> None:
    before = two("found += 1", root=NOTED, output="int", default="0")
    run = Execution(load(compile_to(tmp_path, before)))
    with run:
        run.advance(0.25)
        assert seen_by(run) == [0, 1, 2]
        run.exchange(load(compile_to(tmp_path, before.replace("found += 1", "found += 10"), "behavior2")))
        run.advance(0.2)
        assert seen_by(run) == [0, 1, 2, 3, 13]


def test_an_output_of_another_type_begins_again_in_another_version(tmp_path: Path) -> None:
    before = two("found += 1", root=NOTED, output="int", default="0")
    after = two("pass", root=NOTED, output="str", default='"none"')
    with Execution(load(compile_to(tmp_path, before))) as run:
        run.advance(0.25)
        report = run.exchange(load(compile_to(tmp_path, after, "behavior2")))
        run.advance(0.1)
        assert seen_by(run)[-1] == "none"
        assert report == ("the output found of automaton 2 (search) is str now and has its default again",)
