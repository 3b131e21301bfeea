"""What Python and the runtime say is known by its template, and said without a changed letter."""

from __future__ import annotations

import ast
from gettext import NullTranslations

import pytest
from hypothesis import given
from pyflakes.checker import Checker

from codegen.hfsm.code.text import parse_python
from codegen.messages import Message
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
        "x = (1]",
        "  x = 1",
        "if x:\npass",
        "if x:\n        a = 1\n    b = 2",
        "x = 'a",
        "f() = 1",
        "print 1",
        "x = 1 2",
        "x = 1a",
        "x = “a”",
        "f(a=1, 2)",
        "try:\n    pass\n",
        "return 1",
        "break",
        "if x:\n    f() = 1",
        "x = 1 if 2",
        "x = '''a",
        "x = f'{'",
        "x = f'{}'",
        "f(a=1, a=2)",
        "f(a=1, **b, 2)",
        "f(x + 1=2)",
        "def f(a=1, b): pass",
        "def f(a, a): pass",
        "def f():\n    from a import *",
        "def f(a):\n    global a",
        "def f():\n    b = 1\n    global b",
        "x = 012",
        "x = 0b2",
        "x = 0xg",
        "x = {1: }",
        "x = {1: 2, 3}",
        "del f()",
        "yield 1",
        "await x",
        "x\\ y",
        "f(a for a in b, c)",
        "try:\n    pass\nexcept a, b:\n    pass",
        "try:\n    pass\nexcept:\n    pass\nexcept a:\n    pass",
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


@pytest.mark.parametrize(
    "code",
    [
        "assert (x, 'y')",
        "if (x, 1): pass",
        "print >> x",
        "x is 'a'",
        "{'a': 1, 'a': 2}",
        "raise NotImplemented",
        "'{}'.format(1, 2)",
        "'{a}'.format(a=1, b=2)",
        "'{}'.format()",
        "'{} {1}'.format(1, 2)",
        "'{'.format(1)",
        "'%(a' % 1",
        "'%(a)s %s' % (1, 2)",
        "'%y' % 1",
        "'%s' % (1, 2)",
        "'%(a)s' % {'a': 1, 'b': 2}",
        "'%(a)s' % {'b': 2}",
        "'%(a)s' % (1,)",
        "'%s %s' % {'a': 1}",
        "'%(a)*s' % {'a': 1}",
    ],
)
def test_what_pyflakes_doubts_is_known(code: str) -> None:
    found = [each.message % each.message_args for each in Checker(ast.parse(f"x = 1\n{code}")).messages]
    doubts = [text[:1].lower() + text[1:] for text in found if "is not" not in text]
    assert doubts
    for text in doubts:
        assert known_text(text) == text
        assert known_text(text).said_in(Marked()).startswith("<"), text


def test_what_python_says_of_failing_code_is_known() -> None:
    for code in (
        "1 / 0",
        "1.0 / 0",
        "1 // 0",
        "missing",
        "lenn([])",
        "[].size",
        "[].appendd(1)",
        "[][0]",
        "''[0]",
        "1 + 'a'",
        "'a' + 1",
        "'a' < 1",
        "3()",
        "3[0]",
        "list(3)",
        "int('x')",
        "float('x')",
        "(lambda a: 1)()",
        "(lambda: 1)(2)",
        "(lambda: 1)(a=2)",
        "__import__('missing')",
        "__import__('math').sqr(2)",
        "__import__('math').sqrt(-1)",
    ):
        with pytest.raises(Exception) as caught:  # noqa: PT011 - of any kind
            eval(code)
        text = f"{type(caught.value).__name__}: {caught.value}"
        said = known_text(text).said_in(Marked())
        assert said.count("<") >= 2, text


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
