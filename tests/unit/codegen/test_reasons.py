"""What Python and the runtime say is known by its template, and said without a changed letter."""

from __future__ import annotations

from gettext import NullTranslations

import pytest
from hypothesis import given

from codegen.messages import Message, template
from codegen.parsing import parse_python
from codegen.reasons import known_text, reason
from tests.support.any_text import any_text


class Marked(NullTranslations):
    """Marks each template that it is asked for."""

    def gettext(self, message: str) -> str:
        return f"<{message}>"


@pytest.mark.parametrize(
    "code",
    [
        "if x\n    pass",
        "print(1",
        "x = )",
        "  x = 1",
        "if x:\npass",
        "if x:\n        a = 1\n    b = 2",
        "x = 'a",
        "f() = 1",
        "1 = x",
        "x = 1 2",
        "x = [1 2]",
        "x = [1)",
        "x = 2nd",
        "x = 5\N{EURO SIGN}",
        "if x:\n    f() = 1",
    ],
)
def test_what_python_says_of_the_code_of_beginners_is_known(code: str) -> None:
    with pytest.raises(SyntaxError) as caught:
        compile(parse_python(code), "code", "exec")
    found = reason(caught.value)
    assert found == caught.value.msg
    assert found.said_in(Marked()).startswith("<"), found


@pytest.mark.parametrize(
    ("code", "what"), [("if x:\npass", "<'if' statement>"), ("f() = 1", "<function call>")]
)
def test_the_part_of_code_that_python_names_is_known_too(code: str, what: str) -> None:
    with pytest.raises(SyntaxError) as caught:
        compile(code, "code", "exec")
    found = reason(caught.value).values["what"]
    assert isinstance(found, Message)
    assert found.said_in(Marked()) == what


def test_what_python_says_of_failing_code_is_known() -> None:
    for code in (
        "1 / 0",
        "1.0 / 0",
        "missing",
        "lenn([])",
        "[].size",
        "[].appendd(1)",
        "[][0]",
        "[1]['a']",
        "1 + 'a'",
        "3()",
        "(lambda a: 1)()",
        "__import__('missing')",
    ):
        with pytest.raises(Exception) as caught:  # noqa: PT011 - of any kind
            eval(code)
        text = f"{type(caught.value).__name__}: {caught.value}"
        said = known_text(text).said_in(Marked())
        assert said.count("<") >= 2, text
        within = known_text(f"it failed: {text}", (template("it failed: {error}"),)).said_in(Marked())
        assert said in within


@given(any_text())
def test_no_text_is_changed(text: str) -> None:
    assert known_text(text) == text
    assert known_text(f"ValueError: {text}") == f"ValueError: {text}"
    assert known_text(f"name '{text}' is not defined") == f"name '{text}' is not defined"


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (FileNotFoundError(2, "No such file or directory", "/secret"), "No such file or directory"),
        (OSError("odd"), "odd"),
        (ValueError("3 is too much"), "3 is too much"),
    ],
)
def test_the_reason_of_an_exception_is_its_text(error: Exception, text: str) -> None:
    assert reason(error) == text


def test_the_reason_of_our_exceptions_is_their_message() -> None:
    class OwnError(Exception):
        message = Message("it is ours")

    assert reason(OwnError()) is OwnError.message
