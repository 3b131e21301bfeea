"""All errors in a document are reported with their lines in one run."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.support.checked_documents import IN_ANNOTATION, A, B, errors, head, one, with_code
from tests.support.documents import document, problems, state, sub, transition
from tests.support.editing import find_problems


def test_a_complete_document_has_no_problem(path: Path) -> None:
    text = document(
        sub(
            1,
            0,
            state(1, "a", "x += 1", initial=True, child=2),
            state(2, "b"),
            transition(1, 1, 2, "x > 9"),
            transition(2, 2, 1, "500", type="time"),
            variables="x = 0",
        ),
        sub(2, 1, state(1, "c", initial=True), period="50"),
        libraries=("math", "numpy as np", "from math import pi"),
        config=head(),
        head="<onerror>continue</onerror>",
    )
    assert problems(path, text) == []


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        ("x = = 1", "3:"),
        ("x = 1\n\ty = 2", "4:"),
        ("print 'x'", "E520: not valid Python: Missing parentheses in call to 'print'"),
        ("int x = 3;", "E520: not valid Python: invalid syntax"),
        ("motors->setV(3);", "E520: not valid Python"),
        ("std::cout << x;", "E520: not valid Python"),
        ("// nothing\nx", "E520: not valid Python"),
        ("break", "E520: not valid Python: 'break' outside loop"),
        ("yield 3", "E520: `yield` is not allowed here"),
        ("await x", "E520: `await` is not allowed here"),
        ("x = 1\nfrom __future__ import annotations", "4:1: E520: `from __future__` is not allowed here"),
        ("def f():\n    from math import *", "E520: not valid Python: import * only allowed at module level"),
        ("def f(a: (b := 1)): pass", f"E520: not valid Python: {IN_ANNOTATION}"),
        ("def f(): nonlocal q", "3:97: E520: not valid Python: no binding for nonlocal 'q' found"),
        ("def f(k=(yield)): pass", "E520: `yield` is not allowed here"),
        ("from math import *", "E520: `import *` is not allowed here"),
        ("self = 3", "E520: `self` is the component"),
        ("x: int = 3", "E520: `x` is shared by all code of the automaton: annotate it in the variables"),
        ("State = 3", "E521: `State` is a reserved name"),
        ("(" * 300 + ")" * 300, "E520"),
    ],
)
def test_code_of_a_state_that_cannot_run(path: Path, code: str, expected: str) -> None:
    text = document(sub(1, 0, state(1, "a", code, initial=True)))
    assert expected in one(errors(path, text))


@pytest.mark.parametrize("name", ["State", "self"])
@pytest.mark.parametrize(
    "line",
    [
        "? = 5",
        "x = y, (? ) = 1, 2",
        "é = 'ü'; [?, z] = 1, 2",
        "import math as ?",
        "from math import sin, cos as ?",
        "for ? in (1, 2): pass",
        "for i, ? in enumerate('a'): pass",
        "def ?(): pass",
        "class ?: pass",
        "with open('/dev/null') as ?: pass",
        "(? := 3)",
        "del ?",
        "? += 1",
    ],
)
def test_a_name_that_must_not_be_assigned_is_marked_where_it_stands(path: Path, name: str, line: str) -> None:
    code = f"x = [self for self in 'ab']\n\nif x:\n    {line.replace('?', name)}\n"
    text = document(sub(1, 0, state(1, "a", code, initial=True)))
    row, column = map(int, one(errors(path, text)).split(":")[:2])
    written = text.split("\n")[row - 1]
    assert written.strip() == line.replace("?", name)
    assert re.match(rf"{name}\b", written[column - 1 :])


@pytest.mark.parametrize(
    ("condition", "expected"),
    [
        ("x = 1", "E520: not valid Python"),
        ("a, b", "E520: a condition must be one expression"),
        ("a) or (b", "E520: a condition must be one expression"),
        ("return", "E520: a condition is one expression, or statements that return"),
        ("a && b", "E520: not valid Python"),
        ("# only a remark", "E520: a condition must be one expression"),
        ("(yield)", "E520: `yield` is not allowed here"),
        ("(self := 1)", "E520: `self` is the component"),
    ],
)
def test_conditions_that_are_none(path: Path, condition: str, expected: str) -> None:
    assert expected in one(errors(path, document(sub(1, 0, A, B, transition(1, 1, 2, condition)))))


def test_the_place_of_an_error_in_code_is_that_in_the_document(path: Path) -> None:
    code = "\n      first = 1\n      second = = 2\n    "
    found = one(problems(path, document(sub(1, 0, state(1, "a", code, initial=True)))))
    assert found.startswith("5:16: E520: not valid Python")


def test_variables_and_functions_are_checked(path: Path) -> None:
    text = document(
        sub(1, 0, state(1, "a", initial=True, child=2), variables="return 3", functions="def f(self):\npass"),
        sub(2, 1, A, functions="def sleep(self): pass\ndef g(self): pass\ndef g(self): pass"),
    )
    found = errors(path, text)
    assert [problem.split(": ", 1)[1] for problem in found] == [
        "E520: `return` is not allowed in the variables",
        "E520: not valid Python: expected an indented block after function definition on line 1",
        "E523: a second function has the name `g`",
    ]


def test_code_that_does_not_agree_with_what_stands_around_it(path: Path) -> None:
    go = transition(1, 1, 2, "go", type="event", code="y = 1\nnonlocal event")
    b = state(2, "b", "# behavior.xml:99\nself.log.info(y)")
    text = document(sub(1, 0, A, b, go, variables="y = 0\n# behavior.xml:6"))
    assert one(errors(path, text)) == "7:1: E520: not valid Python: name 'event' is parameter and nonlocal"


def test_everything_is_reported_in_one_run(path: Path) -> None:
    text = document(
        sub(1, 0, state(1, "a", "x = (", initial=True), transition(1, 1, 9, "1 +"), period="x"),
        config=head(type="Nothing"),
    )
    assert [problem.split(": ")[1] for problem in problems(path, text)] == [
        "E520", "E514", "E520", "E516", "E532"
    ]  # fmt: skip


@pytest.mark.slow
def test_a_hundred_thousand_blank_lines_in_broken_code_are_read_once(path: Path) -> None:
    code = "x x" + "\n" * 100_000 + "y"
    text = document(sub(1, 0, state(1, "a", code, initial=True)))
    assert "E520: not valid Python" in one(problems(path, text))


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


@pytest.mark.parametrize(("name", "meant"), [("pritn", ["print"]), ("lento", [])])
def test_a_name_of_python_is_meant_only_where_a_slip_explains_another(
    path: Path, name: str, meant: list[str]
) -> None:
    (found,) = [each for each in find_problems(with_code(name), path) if each.code == "W520"]
    assert [each.meant for each in [found.misspelt] if each] == meant


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


def test_code_may_be_nested_as_deeply_as_python_allows(path: Path) -> None:
    loops = "\n".join(f"{'  ' * level}for i{level} in range(2):" for level in range(19))
    assert problems(path, with_code(f"{loops}\n{'  ' * 19}self.log.info(str(i18))")) == []


@pytest.mark.parametrize(
    "code", [" + ".join(["1"] * 5000), "x = " + "-" * 300 + "1", "if 0: pass\n" + "elif 0: pass\n" * 400]
)
def test_code_that_is_too_deep_to_look_into_is_left_alone(path: Path, code: str) -> None:
    assert [problem for problem in problems(path, with_code(code)) if "W5" in problem] == []
