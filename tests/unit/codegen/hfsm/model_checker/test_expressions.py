from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from codegen.hfsm.document import Document
from codegen.hfsm.model_checker import ExpressionError
from codegen.hfsm.model_checker.expressions import parse
from codegen.hfsm.model_checker.model import read_model
from codegen.hfsm.model_checker.transition_system import ACTIVE, FINISHED, Configuration
from tests.support.model_documents import PATH, automaton, document, state


def ball() -> Document:
    return document(
        automaton(
            1, [state(1, "followBall", children=[2, 3]), state(2, "dance", children=[4]), state(3, "in")]
        ),
        automaton(2, [state(1, "red"), state(2, "look around")], father=1),
        automaton(3, [state(1, "left"), state(2, "right"), state(3, "red")], father=1),
        automaton(4, [state(1, "up"), state(2, "down")], father=1),
    )


# root, two automata below followBall, one below dance
FOLLOWING: Configuration = ((0, ACTIVE, 0), (1, ACTIVE, 0), (0, ACTIVE, 0), (1, FINISHED, 0))
DANCING: Configuration = ((1, ACTIVE, 0), (0, 0, 0), (0, FINISHED, 0), (0, ACTIVE, 0))


@pytest.mark.parametrize(
    ("expression", "following", "dancing"),
    [
        ("followBall", True, False),
        ("in dance", False, True),
        ('followBall/"look around"', True, False),
        ("followBall/red", False, False),
        ("dance/up", False, True),
        ("#4/up", False, True),
        ("#3/left", True, False),
        ("active(dance)", False, True),
        ("active(#2) and active(#3)", True, False),
        ("ghost(dance)", True, False),
        ("finished(#3)", False, True),
        ("finished(dance)", True, False),
        ('"in"', False, False),
        ("true", True, True),
        ("not false", True, True),
        ("not not dance", False, True),
        ("followBall or dance", True, True),
        ("not (followBall or dance)", False, False),
        ("dance -> dance/up", True, True),
        ("followBall -> followBall/red", False, True),
        ("false -> false -> false", True, True),
        ("followBall or dance and false", True, False),
        ("not followBall and dance", False, True),
        ("dance->dance/down", True, False),
    ],
)
def test_what_an_expression_says(expression: str, following: bool, dancing: bool) -> None:
    holds = parse(expression, read_model(ball(), PATH)).bind({0: 0, 1: 1, 2: 2, 3: 3})
    assert holds(FOLLOWING) is following
    assert holds(DANCING) is dancing


@pytest.mark.parametrize(
    ("expression", "offset", "length", "message"),
    [
        ("", 0, 1, "the expression ends where the path of a state is expected"),
        ("dance and", 9, 1, "the expression ends where the path of a state is expected"),
        ("dance dance", 6, 5, "`dance` stands where `and`, `or`, `->` or the end is expected"),
        ("(dance", 6, 1, "the expression ends where `)` is expected"),
        ("dance or )", 9, 1, "`)` stands where the path of a state is expected"),
        ("not danse", 4, 5, "the root automaton has no state `danse`"),
        ("red", 0, 3, "the root automaton has no state `red`"),
        ("dance/left", 6, 4, "the automaton below `dance` has no state `left`"),
        ("dance/up/x", 0, 8, "the state `up` owns no automaton"),
        ('dance and "look', 10, 5, "this quote is not closed"),
        ("#9/up", 1, 1, "there is no automaton with the id `9`"),
        ("#x/up", 1, 1, "there is no automaton with the id `x`"),
        ("#4", 2, 1, "the expression ends where `/` is expected"),
        ("active(followBall)", 7, 10, "several automata are meant: write `#2` or `#3`"),
        ("ghost(dance/up)", 6, 8, "this state owns no automaton"),
        ("active dance", 7, 5, "`dance` stands where `(` is expected"),
        ("(" * 200, 100, 1, "this is nested deeper than 100"),
    ],
)
def test_an_error_says_where(expression: str, offset: int, length: int, message: str) -> None:
    with pytest.raises(ExpressionError) as caught:
        parse(expression, read_model(ball(), PATH))
    assert (caught.value.message, caught.value.offset, caught.value.length) == (message, offset, length)


def test_an_unknown_state_comes_with_hints() -> None:
    with pytest.raises(ExpressionError) as caught:
        parse("red", read_model(ball(), PATH))
    assert "there is `followBall/red`" in caught.value.hints


def test_a_name_of_several_words_needs_quotes() -> None:
    model = read_model(document(automaton(1, [state(1, "rush hour")])), PATH)
    with pytest.raises(ExpressionError) as caught:
        parse("not rush hour", model)
    assert 'write `"rush hour"`' in caught.value.hints


@given(st.text(alphabet=' ()#/"->notandori dance1', max_size=40))
def test_any_text_is_understood_or_refused_with_a_place_in_it(text: str) -> None:
    try:
        parse(text, read_model(ball(), PATH))
    except ExpressionError as error:
        offset = error.offset
    else:
        offset = 0
    assert 0 <= offset <= len(text)
