"""Commands that give an automaton a variable of one above it."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document
from codegen.hfsm.document import Document
from tests.support.documents import document, problems, state, sub, transition
from visualhfsm._base.errors import EditError
from visualhfsm._document.commands.base import Command
from visualhfsm._document.commands.variables import (
    ShareVariable,
    TakeOutput,
)
from visualhfsm._document.serialization import written

OUTPUT = "<output><name>hits</name><type>int</type><default>0</default></output>"
RESULT = '<result name="hits">hits</result>'


def tree(
    code: str = "hits += 1",
    variables: str = "hits = 0",
    middle: str = "",
    deepest: str = "",
    *,
    output: str = "",
    result: str = "",
) -> Document:
    """Return a document with an automaton in one in one."""
    play = state(1, "play", "print(f'{hits} hits')", initial=True, child=2)
    text = document(
        sub(
            1, 0, play.replace("</state>", f"{result}</state>"), state(2, "rest"),
            transition(1, 1, 2, "hits > 3 and 'hits' in dir()"), variables=variables,
        ),
        sub(2, 1, output, state(1, "look", code, initial=True, child=3), variables=middle),
        sub(3, 2, state(1, "deep", deepest, initial=True)),
    )  # fmt: skip
    found = parse_document(text, Path("walk.xml"), Diagnostics())
    assert found is not None
    return found


def code_of(found: Document, automaton: int) -> str:
    return found.automata[automaton - 1].states[0].code.text


def found_in(directory: Path, changed: Document) -> list[str]:
    return [each.split(": ", 2)[1] for each in problems(directory / "walk.xml", written(changed))]


def test_a_variable_is_shared_by_the_automaton_that_has_it_and_those_below(tmp_path: Path) -> None:
    before = tree(code="hits += 1  # hits\nf(hits=hits)", deepest="for hits in 1, 2: pass")
    assert "W542" in found_in(tmp_path, before)
    after = ShareVariable(automaton=2, name="hits").apply(before)
    root = after.automata[0]
    assert root.variables.text == "self.hits = 0"
    assert root.states[0].code.text == "print(f'{self.hits} hits')"
    assert root.transitions[0].trigger.text == "self.hits > 3 and 'hits' in dir()"
    assert code_of(after, 2) == "self.hits += 1  # hits\nf(hits=self.hits)"
    assert code_of(after, 3) == "for self.hits in 1, 2: pass"
    assert not {"W535", "W542"}.intersection(found_in(tmp_path, after))


def test_those_that_have_such_a_variable_themselves_keep_it() -> None:
    after = ShareVariable(automaton=3, name="hits").apply(tree(middle="hits = 2", deepest="hits += 1"))
    assert after.automata[0].variables.text == "hits = 0"
    assert [code_of(after, 2), code_of(after, 3)] == ["self.hits += 1", "self.hits += 1"]


def test_lines_and_letters_of_any_width_stay(tmp_path: Path) -> None:
    code = "\n    größe = 'ä'\n    x = größe + str(hits)\n\n    hits = f'''{x}\n  {hits!r:>3} {{hits}}'''\n"
    after = ShareVariable(automaton=2, name="hits").apply(tree(code=code))
    assert code_of(after, 2) == (
        "\n    größe = 'ä'\n    x = größe + str(self.hits)\n\n"
        "    self.hits = f'''{x}\n  {self.hits!r:>3} {{hits}}'''\n"
    )


def test_an_output_is_taken_into_a_variable_that_is_declared_with_its_default(tmp_path: Path) -> None:
    after = TakeOutput(automaton=1, state=1, name="hits").apply(tree(output=OUTPUT))
    root = after.automata[0]
    assert root.variables.text == "hits = 0\nhits_2 = 0"
    assert [each.variable.text for each in root.states[0].results] == ["hits_2"]
    assert not {"E528", "E529"}.intersection(found_in(tmp_path, after))


@pytest.mark.parametrize(
    ("command", "before", "why"),
    [
        (ShareVariable(automaton=2, name="hat"), tree(), "no automaton above has such a variable"),
        (ShareVariable(automaton=1, name="hits"), tree(), "no automaton above has such a variable"),
        (ShareVariable(automaton=2, name="hits"), tree(code="def f(hits): pass\nhits += 1"), "another way"),
        (ShareVariable(automaton=2, name="hits"), tree(code="[hits for hits in x]"), "another way"),
        (ShareVariable(automaton=2, name="hits"), tree(code="import a as hits"), "another way"),
        (
            ShareVariable(automaton=2, name="hits"),
            tree(output=OUTPUT, result=RESULT),
            "outputs of automata are taken into it",
        ),
    ],
)
def test_what_cannot_be_done_is_refused(command: Command, before: Document, why: str) -> None:
    with pytest.raises(EditError, match=why):
        command.apply(before)


USES = st.sampled_from(
    ["hits += 1", "x = [hits, (hits)]", "print(f'{hits + hits}{hits + 1:{hits}}')", "if hits:\n    y = 'hits'  # hits",
     "é = hits; é = -hits", "self.log.info('%s', hits)", "f = lambda: hits", "del hits", "with open('x') as hits: pass"]
)  # fmt: skip


@given(st.lists(USES, min_size=1, max_size=5))
def test_after_sharing_no_code_has_the_name_alone(uses: list[str]) -> None:
    after = ShareVariable(automaton=2, name="hits").apply(tree(code="\n".join(uses)))
    assert code_of(after, 2).count("self.hits") == sum(
        use.count("hits") - use.count("'hits'") - use.count("# hits") for use in uses
    )
