"""The command that replaces text."""

from __future__ import annotations

import pytest

from codegen.hfsm.document import Argument, Document, Text
from tests.support.editing import automaton, texted, tree
from visualhfsm._base.errors import EditError
from visualhfsm._document.commands.states import RenameState
from visualhfsm._document.commands.text import ReplaceText, SetArguments
from visualhfsm._document.places import Place


def with_balls() -> Document:
    """A document with a word in all kinds of code, and in names."""
    document = texted(tree(), "ball", kind="state", id=2, part="argument", name="ball", child=3)
    for part in ("entry", "code", "exit"):
        text = "Ball = ball\nfootball += ball"
        document = texted(document, text, kind="state", id=1, part=part)
    for where in ("trigger", "guard", "fired"):
        document = texted(document, "ball", kind="transition", id=1, part=where)
    for which in ("variables", "functions"):
        document = texted(document, "ball", kind="automaton", automaton=4, part=which)
    return RenameState(automaton=3, state=1, name="ball").apply(document)


def test_a_word_is_replaced_in_all_code_and_in_nothing_else() -> None:
    command = ReplaceText(text="ball", by=r"\1 b", whole=True)
    before = with_balls()
    assert command.title(before) == r"Replace “ball” by “\1 b” (12 times)"
    document = command.apply(before)
    first, second = automaton(document).states
    assert {first.entry.text, first.code.text, first.exit.text} == {"Ball = \\1 b\nfootball += \\1 b"}
    assert second.arguments == (Argument(name="ball", child=3, value=Text(r"\1 b")),)
    go = automaton(document).transitions[0]
    deep = automaton(document, 4)
    texts = {go.trigger.text, go.guard.text, go.code.text, deep.variables.text, deep.functions.text}
    assert texts == {r"\1 b"}
    assert automaton(document, 3) is automaton(before, 3)


def test_a_text_is_replaced_in_one_line_of_one_place_in_any_case() -> None:
    place = Place(kind="state", automaton=1, id=1, part="exit")
    command = ReplaceText(text="BALL", by="it", place=place, line=2)
    assert command.title(with_balls()) == "Replace “BALL” by “it” (2 times)"
    document = command.apply(with_balls())
    assert automaton(document).states[0].exit.text == "Ball = ball\nfootit += it"
    rest = texted(document, "Ball = ball\nfootball += ball", kind="state", id=1, part="exit")
    assert rest == with_balls()


@pytest.mark.parametrize(
    ("text", "by", "why"),
    [
        ("", "x", "no code has"),
        ("nowhere", "x", "no code has “nowhere”"),
        ("a", "x" * 1000, "more than 12 MiB"),
    ],
)
def test_a_replacement_of_nothing_or_of_too_much_is_refused(text: str, by: str, why: str) -> None:
    document = texted(tree(), "a" * 20_000, kind="automaton", part="functions")
    with pytest.raises(EditError, match=why):
        ReplaceText(text=text, by=by).apply(document)


def test_the_arguments_of_a_place_are_set_in_one_step_beside_others() -> None:
    command = SetArguments(automaton=1, state=2, child=3, values={"ball": "1.0", "left": "0.5"})
    assert command.title(with_balls()) == "Set the arguments of “work”"
    state = automaton(command.apply(with_balls())).states[1]
    assert [(each.name, each.child, each.value.text) for each in state.arguments] == [
        ("ball", 3, "1.0"),
        ("left", 3, "0.5"),
    ]
    with pytest.raises(EditError):
        SetArguments(automaton=1, state=99, values={"left": "1"}).apply(with_balls())
