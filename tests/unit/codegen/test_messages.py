"""Messages are their English text, and keep what is needed to say them in other languages."""

from __future__ import annotations

import ast
import copy
import json
import pickle
import string
from gettext import NullTranslations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from codegen.messages import NO_MESSAGE, Message, Value, all_of, any_of, joined, number, template
from tests.support.any_text import any_text
from tests.support.processes import REPOSITORY

NAMES = st.sampled_from(("name", "state", "count2", "other"))
PLAIN = st.one_of(any_text(), st.integers(), st.floats(allow_nan=False))


class Spanish(NullTranslations):
    """A catalog of a few texts."""

    def __init__(self, **texts: str) -> None:
        super().__init__()
        self._texts = texts

    def gettext(self, message: str) -> str:
        return self._texts.get(message, message)

    def ngettext(self, one: str, many: str, n: int) -> str:
        return self._texts.get(one if n == 1 else many, one if n == 1 else many)


class Shouting(NullTranslations):
    """Changes every template."""

    def gettext(self, message: str) -> str:
        return f"¡{message}!"


@st.composite
def templates(draw: st.DrawFn) -> tuple[str, dict[str, Value]]:
    """Return a template with the values that it needs."""
    pieces: list[str] = []
    values: dict[str, Value] = {}
    for text, name in draw(st.lists(st.tuples(any_text(), st.none() | NAMES), max_size=6)):
        pieces.append(text.replace("{", "{{").replace("}", "}}"))
        if name is not None:
            pieces.append(f"{{{name}}}")
            values[name] = draw(PLAIN | st.builds(Message.verbatim, any_text()))
    return "".join(pieces), values


@st.composite
def messages(draw: st.DrawFn) -> Message:
    """Return a message, whose values may be messages."""
    template, values = draw(templates())
    if draw(st.booleans()) and values:
        values[draw(st.sampled_from(sorted(values)))] = draw(messages())
    return Message(template, **values)


@given(templates())
def test_a_message_is_its_template_with_its_values(made: tuple[str, dict[str, Value]]) -> None:
    template, values = made
    message = Message(template, **values)
    assert message == template.format(**values)
    assert message.said_in(NullTranslations()) == message


@given(messages())
def test_a_message_keeps_its_template_in_copies_in_pickles_and_in_json(message: Message) -> None:
    said = message.said_in(Shouting())
    for other in (
        copy.copy(message),
        copy.deepcopy(message),
        pickle.loads(pickle.dumps(message)),
        Message.from_data(json.loads(json.dumps(message.to_data()))),
    ):
        assert type(other) is Message
        assert other == message
        assert other.said_in(Shouting()) == said


def test_a_translation_may_use_the_values_in_another_order() -> None:
    message = Message("{child} below {parent}", child="a", parent="b")
    assert message == "a below b"
    assert (
        message.said_in(Spanish(**{"{child} below {parent}": "{parent} encima de {child}"}))
        == "b encima de a"
    )


def test_values_that_are_messages_are_translated_and_others_are_not() -> None:
    message = Message("{what} of {owner}", what=Message("code"), owner="code")
    assert (
        message.said_in(Spanish(**{"code": "código", "{what} of {owner}": "{what} de {owner}"}))
        == "código de code"
    )


COMMA = Spanish(**{"{whole}.{fraction}": "{whole},{fraction}"})


def test_numbers_have_the_decimal_point_or_comma_of_the_language() -> None:
    message = Message(
        "{short:g} s, {long:8.3f} s, {plain}, {whole:g}", short=0.5, long=-1.25, plain=2.5, whole=3.0
    )
    assert message == "0.5 s,   -1.250 s, 2.5, 3"
    assert message.said_in(COMMA) == "0,5 s,   -1,250 s, 2,5, 3"
    assert message.said_in(NullTranslations()) == message


@pytest.mark.parametrize(
    ("text", "said"), [("-0.5", "-0,5"), ("1.5e-07", "1,5e-07"), ("7", "7"), ("1.2.3", "1.2.3")]
)
def test_a_text_that_is_a_number_is_said_as_one(text: str, said: str) -> None:
    assert number(text) == text
    assert number(text).said_in(COMMA) == said


@pytest.mark.parametrize(("count", "text"), [(0, "0 estados"), (1, "1 estado"), (2, "2 estados")])
def test_the_number_decides_on_the_form(count: int, text: str) -> None:
    catalog = Spanish(**{"{count} state": "{count} estado", "{count} states": "{count} estados"})
    assert Message.counted("{count} state", "{count} states", count=count).said_in(catalog) == text


@pytest.mark.parametrize("wrong", ["{nombre} no existe", "{name", "{0}", "{name.x}", "{name:d}"])
def test_an_unusable_translation_leaves_the_text_english(wrong: str) -> None:
    message = Message("{name} does not exist", name="a")
    assert message.said_in(Spanish(**{"{name} does not exist": wrong})) == "a does not exist"


def test_a_text_from_elsewhere_is_the_same_in_every_language() -> None:
    braces = "{state} in code"
    assert Message.verbatim(braces).said_in(Spanish(**{braces: "wrong"})) == braces
    assert NO_MESSAGE.said_in(Spanish(**{"": "the head of the catalog"})) == ""


def test_a_message_is_not_wrapped_again() -> None:
    message = Message("code")
    assert Message.verbatim(message) is message


def test_a_missing_value_is_found_where_the_message_is_made() -> None:
    with pytest.raises(KeyError):
        Message("{name} does not exist", state="a")


def test_a_template_without_values_takes_them_later() -> None:
    found = template("{state} waits for {event}, {state} alone")
    assert found == "… waits for …, … alone"
    assert found.again({"state": "a", "event": "b"}) == "a waits for b, a alone"
    assert template("no values") == "no values"


@given(st.lists(st.text(string.ascii_letters), min_size=1, max_size=5))
def test_lists_end_with_their_word(items: list[str]) -> None:
    *others, last = items
    assert any_of(items) == (f"{', '.join(others)} or {last}" if others else last)
    assert all_of(items) == (f"{', '.join(others)} and {last}" if others else last)
    assert joined(", ", items) == ", ".join(items)


def test_lists_are_translated_with_their_items() -> None:
    catalog = Spanish(**{"{others} and {last}": "{others} y {last}", "code": "código", "exit code": "salida"})
    assert all_of([Message("code"), "x", Message("exit code")]).said_in(catalog) == "código, x y salida"


@pytest.mark.parametrize("data", [None, 3, [], {}, {"template": 3, "plural": None, "values": {}}])
def test_other_data_is_refused(data: object) -> None:
    with pytest.raises(ValueError, match="not a message"):
        Message.from_data(data)


PASSED_ON = (
    "Message(template, **values)",
    "cls.because(template, reason=reason(error), **values)",
    "Message(text)",
    "template(text)",
)
"""Calls in `because`, `in_place_of`, `EditError` and for catalogs; their own callers are looked at, here or there."""


@pytest.mark.slow
def test_templates_are_literals_so_that_they_are_found() -> None:
    computed = [
        f"{path.relative_to(REPOSITORY)}:{call.lineno}"
        for folder in ("codegen", "visualhfsm")
        for path in (REPOSITORY / folder).rglob("*.py")
        for call in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(call, ast.Call)
        for name in [ast.unparse(call.func).rpartition(".")[2]]
        if name in ("Message", "counted", "template", "because")
        if not all(isinstance(each, ast.Constant) and each.value for each in call.args)
        if ast.unparse(call) not in PASSED_ON
    ]
    assert computed == []
