"""Names in code: those of variables, of functions and of the component."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.checked_documents import IN_ANNOTATION, A, errors, one, with_code
from tests.support.documents import document, problems, state, sub, transition


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


def test_the_component_by_the_names_of_visualstates(path: Path) -> None:
    code = "self.globalNamespace.speed = 3\nself.rosNode.go(self.namespace.speed)\nself.interfaces.stop()"
    found = problems(path, with_code(code, functions="def go(self, speed):\n    pass"))
    assert [problem.split(": ", 1)[1][:30] for problem in found] == ["W524: `self.stop` is not an in"]


def test_a_name_that_a_base_class_assigns_is_defined(path: Path) -> None:
    a = state(1, "a", "class A((base := object)): pass\nprint(A)", initial=True)
    text = document(sub(1, 0, a, state(2, "b", "print(base)"), transition(1, 1, 2, "100", type="time")))
    assert [problem for problem in problems(path, text) if "base" in problem] == []
