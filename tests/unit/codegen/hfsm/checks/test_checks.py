"""All errors in a document are reported with their lines in one run."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tests.support.documents import document, problems, state, sub, transition

A = state(1, "a", initial=True)
B = state(2, "b")
HEAD = (
    "<iceinterface><nameinterface>{name}</nameinterface><nameproxy>{identity}</nameproxy>"
    "<interface>{type}</interface></iceinterface>\n"
)

IN_ANNOTATION = (
    "'named expression' can not be used"
    if sys.version_info < (3, 12)
    else "named expression cannot be used within an annotation"
)


def head(name: str = "head", identity: str = "Head", type: str = "PoseHead") -> str:
    return HEAD.format(name=name, identity=identity, type=type)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "behavior.xml"


def errors(path: Path, text: str) -> list[str]:
    """Return what is wrong with a document, without what is only doubtful."""
    return [problem for problem in problems(path, text) if problem.split(": ")[1].startswith("E")]


def one(found: list[str]) -> str:
    assert len(found) == 1, found
    return found[0]


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
    ("parts", "expected"),
    [
        ((), "1:1: E511: there is no automaton"),
        ((sub(1, 0, A), sub(2, 0, A)), "8:1: E511: automaton 2 is a second root"),
        ((sub(1, 0, A), sub(1, 0, A)), "E517: a second automaton has the id 1"),
        ((sub(1, 0, A), sub(2, 1, A)), "8:1: E512: no state owns automaton 2"),
        ((sub(1, 0, state(1, "a", initial=True, child=7)),), "3:1: W512: `a` owns automaton 7, which"),
        (
            (sub(1, 0, state(1, "a", initial=True, child=2), state(2, "b", child=2)), sub(2, 1, A)),
            "4:1: E512: automaton 2 already has an owner",
        ),
        (
            (sub(1, 0, state(1, "a", initial=True, child=2)), sub(2, 3, A)),
            "8:1: E512: automaton 2 says that its father is 3",
        ),
        (
            (
                sub(1, 0, A),
                sub(2, 3, state(1, "a", initial=True, child=3)),
                sub(3, 2, state(1, "a", initial=True, child=2)),
            ),
            "E512: automaton 2 is its own ancestor",
        ),
        (
            tuple(sub(n, n - 1, state(1, "a", initial=True, child=n % 66 and n + 1)) for n in range(1, 67)),
            "E512: automaton 65 is nested deeper than 64",
        ),
        ((sub(1, 0),), "2:1: E513: automaton 1 has no state"),
        ((sub(1, 0, B),), "2:1: W513: automaton 1 has no initial state"),
        ((sub(1, 0, A, state(2, "b", initial=True)),), "4:1: W513: `b` is a second initial state"),
        ((sub(1, 0, A, state(1, "b")),), "4:1: E517: a second state has the id 1"),
        ((sub(1, 0, A, state(0, "b")),), "4:1: E517: the id of a state is at least 1"),
        ((sub(1, 0, A, B, transition(1, 1, 9, "True")),), "5:1: E514: transition 1 enters state 9, which"),
        ((sub(1, 0, A, B, transition(1, 8, 2, "True")),), "5:1: E514: transition 1 leaves state 8, which"),
        ((sub(1, 0, A, B, transition(1, 1, 2, "1", type="never")),), "E515: transition 1 has the type `never`"),
        ((sub(1, 0, A, period="soon"),), "E516: `iteration_time` must be a positive number of milliseconds, not `soon`"),
        ((sub(1, 0, A, period="0"),), "E516: `iteration_time`"),
        ((sub(1, 0, A, period="nan"),), "E516: `iteration_time`"),
    ],
)  # fmt: skip
def test_faults_of_the_structure(path: Path, parts: tuple[str, ...], expected: str) -> None:
    found = problems(path, document(*parts))
    assert any(expected in problem for problem in found), found


@pytest.mark.parametrize("time", ["", "soon", "-5", "inf", "nan", "1_000", "1e300", "-1e-300"])
def test_a_time_that_is_no_positive_number(path: Path, time: str) -> None:
    text = document(sub(1, 0, A, B, transition(1, 1, 2, time, type="time", name="tired")))
    assert "E515: the time of transition `tired` must be a positive number of milliseconds" in one(
        errors(path, text)
    )


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
    found = problems(path, text)
    assert [problem.split(": ", 1)[1] for problem in found] == [
        "E520: `return` is not allowed in the variables",
        "E520: not valid Python: expected an indented block after function definition on line 1",
        "E523: a second function has the name `g`",
    ]


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        ("from math import *", "18: E520: not valid Python: import * only allowed at module level"),
        ("from __future__ import division", "1: E520: `from __future__` is not allowed here"),
        ("nonlocal zz", "1: E520: not valid Python: no binding for nonlocal 'zz' found"),
        ("def f(self, a: (b := 1)): pass", f"17: E520: not valid Python: {IN_ANNOTATION}"),
    ],
)
def test_functions_that_cannot_stand_in_a_class(path: Path, code: str, expected: str) -> None:
    text = document(sub(1, 0, A, functions=f"def g(self): pass\n{code}"))
    assert one(errors(path, text)).startswith(f"7:{expected}")


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        ("nonlocal zz", "E520: `nonlocal` is not allowed in the variables"),
        ("def f(): nonlocal q", "E520: not valid Python: no binding for nonlocal 'q' found"),
        ("from __future__ import annotations", "E520: `from __future__` is not allowed here"),
        ("a: (b := 1) = 2", f"E520: not valid Python: {IN_ANNOTATION}"),
        ("global zz; zz = 1", "E520: `global zz` makes `zz` global in the file"),
    ],
)
def test_variables_that_cannot_stand_in_a_function(path: Path, code: str, expected: str) -> None:
    text = document(sub(1, 0, state(1, "a", "zz = 2", initial=True), variables=f"y = 1\n{code}"))
    found = one(errors(path, text))
    assert found.startswith("6:")
    assert expected in found


@pytest.mark.parametrize("name", ["send", "sleep"])
def test_variables_that_send_or_sleep(path: Path, name: str) -> None:
    variables = f"later = lambda: self.{name}(1)\nself.{name}(2)"
    expected = f"6:1: E520: `self.{name}` is for entry code: no automaton runs yet when variables are set"
    assert errors(path, document(sub(1, 0, A, variables=variables))) == [expected]
    functions = f"def {name}(self, x): pass"
    assert errors(path, document(sub(1, 0, A, variables=variables, functions=functions))) == []


def test_a_global_of_all_code_is_no_variable(path: Path) -> None:
    a = state(1, "a", "global zz\nzz = 2", initial=True)
    assert errors(path, document(sub(1, 0, a, variables="global zz\nzz = 1"))) == []


def test_code_that_does_not_agree_with_what_stands_around_it(path: Path) -> None:
    go = transition(1, 1, 2, "go", type="event", code="y = 1\nnonlocal event")
    b = state(2, "b", "# behavior.xml:99\nself.log.info(y)")
    text = document(sub(1, 0, A, b, go, variables="y = 0\n# behavior.xml:6"))
    assert one(errors(path, text)) == "7:1: E520: not valid Python: name 'event' is parameter and nonlocal"


def test_functions_that_collide(path: Path) -> None:
    text = document(
        sub(
            1,
            0,
            state(1, "a", initial=True, child=2),
            functions="def f(self): pass\ndef automaton(self): pass",
        ),
        sub(2, 1, A, functions="def f(self): pass\ndef head(self): pass"),
        config=head(),
    )
    found = problems(path, text)
    assert any(
        "`self.automaton` belongs to every component: rename the function" in problem for problem in found
    )
    assert any(problem.startswith("13:1: E523: a second function has the name `f`") for problem in found)
    assert any("`head` is both an interface and a function" in problem for problem in found)


@pytest.mark.parametrize(
    ("interface", "expected"),
    [
        (head(type="PoseHed"), "E532: there is no proxy for an interface `PoseHed`"),
        (head(type="jderobot::PoseHead"), "E532: there is no proxy"),
        (head(type=""), "E532: the interface `head` has no type"),
        (head(name="the head"), "E530: `the head` cannot be an attribute"),
        (head(name="class"), "E530: `class` cannot be an attribute"),
        (
            head(name="\N{FULLWIDTH LATIN SMALL LETTER C}lock"),
            "E530: `\N{FULLWIDTH LATIN SMALL LETTER C}lock` cannot",
        ),
        (head(name="sleep"), "E530: `self.sleep` belongs to every component"),
        (head() + head(), "E530: a second interface has the name `head`"),
        (head(identity="He/ad"), "E531: `He/ad` is not a valid identity of a servant"),
    ],
)
def test_interfaces_that_cannot_be_connected(path: Path, interface: str, expected: str) -> None:
    assert expected in one(problems(path, document(sub(1, 0, A), config=interface)))


@pytest.mark.parametrize("type", ["PoseHead", "nao::PoseHead", "::nao::PoseHead", "nao.PoseHead"])
def test_an_interface_may_be_named_with_its_scope(path: Path, type: str) -> None:
    assert problems(path, document(sub(1, 0, A), config=head(type=type))) == []


def test_an_interface_that_two_packages_have_needs_its_scope(path: Path, tmp_path: Path) -> None:
    (tmp_path / "lab").mkdir()
    (tmp_path / "lab" / "__init__.py").write_text("class PoseHeadPrx(object):\n    pass\n")
    found = one(problems(path, document(sub(1, 0, A), config=head()), include=(tmp_path,)))
    assert "`PoseHead` is ambiguous: write `nao::PoseHead` or `lab::PoseHead`" in found


def test_a_folder_that_python_cannot_import_is_no_package(path: Path, tmp_path: Path) -> None:
    (tmp_path / "my-lab").mkdir()
    (tmp_path / "my-lab" / "__init__.py").write_text("class PoseHeadPrx(object):\n    pass\n")
    assert problems(path, document(sub(1, 0, A), config=head()), include=(tmp_path,)) == []


def test_libraries_that_are_none(path: Path) -> None:
    future = "from __future__ import annotations"
    text = document(sub(1, 0, A), libraries=("import", "a; b", "State", "numpy as np", future))
    found = problems(path, text)
    assert [problem.split(": ", 1)[1][:30] for problem in found] == [
        "E520: `import` is not a librar", "E520: `a; b` is not a library:", "E521: `State` is a reserved na",
        "E520: `__future__` is not a li",
    ]  # fmt: skip


@pytest.mark.parametrize("library", ["random", "signal", "numpy", "hfsm_runtime"])
def test_a_component_that_would_hide_a_library(tmp_path: Path, library: str) -> None:
    (found,) = problems(tmp_path / f"{library}.xml", document(sub(1, 0, state(1, "only", initial=True))))
    assert found.endswith(
        f"W540: its component {library}.py would shadow the library `{library}`: rename the document"
    )


def test_an_unknown_policy(path: Path) -> None:
    found = one(problems(path, document(sub(1, 0, A), head="<onerror>explode</onerror>")))
    assert found.startswith("1:22: E510: `onerror` must be `stop` or `continue`, not `explode`")


def test_names_that_are_empty_or_repeated_are_warned_of(path: Path) -> None:
    there_and_back = [
        transition(number, *ends, "100", type="time")
        for number, ends in enumerate(((1, 2), (2, 3), (3, 1)), 1)
    ]
    found = problems(path, document(sub(1, 0, A, state(2, "a"), state(3, " "), *there_and_back)))
    assert [problem.split(": ")[1] for problem in found] == ["W511", "W510"]


def test_everything_is_reported_in_one_run(path: Path) -> None:
    text = document(
        sub(1, 0, state(1, "a", "x = (", initial=True), transition(1, 1, 9, "1 +"), period="x"),
        config=head(type="Nothing"),
    )
    assert [problem.split(": ")[1] for problem in problems(path, text)] == [
        "E520", "E514", "E520", "E516", "E532"
    ]  # fmt: skip


def test_a_hundred_thousand_blank_lines_in_broken_code_are_read_once(path: Path) -> None:
    code = "x x" + "\n" * 100_000 + "y"
    text = document(sub(1, 0, state(1, "a", code, initial=True)))
    assert "E520: not valid Python" in one(problems(path, text))


def test_a_file_that_a_person_wrote_is_not_overwritten(path: Path) -> None:
    path.with_suffix(".py").write_text("print('mine')\n")
    assert "behavior.py was not generated by codegen" in one(problems(path, document(sub(1, 0, A))))


@pytest.mark.parametrize("other", ["my_dance", "my dance", "my-dance"])
def test_two_documents_with_one_component_are_an_error(tmp_path: Path, other: str) -> None:
    text = document(sub(1, 0, A))
    (tmp_path / f"{other}.xml").write_text(text)
    (tmp_path / "my_dance_too.xml").write_text(text)
    found = problems(tmp_path / "my.dance.xml", text)
    assert found == [f"0:1: E542: {other}.xml has the same component, my_dance.py: rename one of them"]


def test_a_file_that_is_no_document_has_no_component(tmp_path: Path) -> None:
    (tmp_path / "my_dance.xml").write_text("<worlds/>")
    (tmp_path / "my dance.xml").mkdir()
    assert problems(tmp_path / "my-dance.xml", document(sub(1, 0, A))) == []
