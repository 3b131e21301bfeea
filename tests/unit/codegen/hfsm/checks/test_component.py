"""The declarations of a component: its interfaces, libraries, functions, policies and file."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.checked_documents import IN_ANNOTATION, A, errors, head, one, with_code
from tests.support.documents import compile_to, document, problems, state, sub


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
    ("attributes", "expected"),
    [
        ('part="Camera" kind="black"', []),
        ('part="Camera" kind="late" amount="0.5" after="1.5" must="succeed"', []),
        ('part="Camera"', ["E506: `survives` needs the attribute `kind`"]),
        (
            'part="Camera" kind=" "',
            ["E537: `survives` needs the part of the robot that fails, and how: Camera, black"],
        ),
        (
            'part="Camera" kind="late" amount="much"',
            ["E537: `amount` is `much`: write a number, such as 0.5"],
        ),
        ('part="Camera" kind="late" after="-1"', ["E537: `after` is `-1`: write seconds from 0 to 3600"]),
        ('part="Camera" kind="late" must="win"', ["E537: `must` is `win`: write `succeed`, or nothing"]),
    ],
)
def test_a_failure_to_survive_says_what_fails_and_how(
    path: Path, attributes: str, expected: list[str]
) -> None:
    text = document(sub(1, 0, A), head=f"\n<survives {attributes}/>")
    assert problems(path, text) == [f"2:1: {each}" for each in expected]


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
        "`self.automaton` belongs to every component: choose another name" in problem for problem in found
    )
    assert any(problem.startswith("13:1: E523: a second function has the name `f`") for problem in found)
    assert any("`head` is both an interface and a function" in problem for problem in found)


@pytest.mark.parametrize("name", ["automaton", "_hfsm_send"])
@pytest.mark.parametrize(
    "code", ["def {}(self): pass", "{} = 3", "import math as {}", "for {} in (1, 2): pass"]
)
def test_nothing_among_functions_takes_what_makes_the_component(path: Path, name: str, code: str) -> None:
    found = problems(path, with_code("pass", functions=f"def f(self): pass\n{code.format(name)}"))
    place = f"7:{code.index('{') + 1}"
    assert found == [f"{place}: E523: `self.{name}` belongs to every component: choose another name"]


@pytest.mark.parametrize("name", ["clock", "log", "mark", "send", "sleep"])
@pytest.mark.parametrize("code", ["def {}(self, n): pass", "{} = 3", "import math as {}", "class {}: pass"])
def test_names_among_functions_that_hide_those_of_every_component(path: Path, name: str, code: str) -> None:
    found = problems(path, with_code("pass", functions=f"def f(self): pass\n{code.format(name)}"))
    said = f"W543: this takes the place of the `self.{name}` of every component: rename it"
    assert found == [f"7:{code.index('{') + 1}: {said}"]


def test_an_assignment_that_hides_a_part_of_the_component(path: Path) -> None:
    found = problems(path, with_code("x = 1\nself.log = x"))
    assert found == ["4:6: W543: this takes the place of the `self.log` of every component: rename it"]


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
        f"E544: its component {library}.py would shadow the library `{library}`: rename the document"
    )


def test_an_unknown_policy(path: Path) -> None:
    found = one(problems(path, document(sub(1, 0, A), head="<onerror>explode</onerror>")))
    assert found.startswith("1:22: E510: `onerror` must be `stop` or `continue`, not `explode`")


def test_a_file_that_a_person_wrote_is_not_overwritten(path: Path) -> None:
    path.with_suffix(".py").write_text("print('mine')\n")
    assert "behavior.py was not generated by codegen" in one(problems(path, document(sub(1, 0, A))))


@pytest.mark.parametrize(
    ("before", "added"),
    [
        ("\nclass Behavior", "\ndef mine():\n    pass\n"),
        ("    def automaton(", "    def mine(self):\n        pass\n\n"),
        ("\nif __name__", "\nclass mine:\n    pass\n"),
        ("\nif __name__", "\nasync def mine():\n    pass\n"),
    ],
)
@pytest.mark.parametrize("functions", ["", "def theirs(self):\n    pass"])
def test_what_a_person_added_to_a_component_is_not_overwritten(
    path: Path, before: str, added: str, functions: str
) -> None:
    text = document(sub(1, 0, A, functions=functions))
    component = compile_to(path.parent, text)
    generated = component.read_text()
    assert problems(path, text) == []
    component.write_text(generated.replace(before, added + before, 1))
    line = next(number for number, line in enumerate(component.read_text().split("\n"), 1) if "mine" in line)
    assert one(problems(path, text)).endswith(
        f"behavior.py:{line} was added by hand: move it into the document"
    )


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
