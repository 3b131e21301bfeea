"""What a component says of errors in its code, in words of the document."""

from __future__ import annotations

from pathlib import Path

import pytest

from hfsm_runtime import VirtualRun
from hfsm_runtime.virtual import BehaviorFailed, Execution
from tests.support.documents import document, generate, load, state, sub


def said(directory: Path, *automata: str) -> str:
    """Run a document for a moment, and return what it says of its first error."""
    path = directory / "walk.xml"
    path.write_text(document(*automata))
    run = VirtualRun(load(generate(path, directory)))
    run.advance(0.5)
    return run.errors[0].message


def nested(code: str, variables: str = "hits = 0") -> tuple[str, str]:
    """Return an automaton with a variable, and one below it with code."""
    return (
        sub(1, 0, state(1, "watch", "hits += 0", initial=True, child=2), variables=variables),
        sub(2, 1, state(1, "count", code, initial=True)),
    )


@pytest.mark.parametrize(
    ("code", "advice"),
    [
        ("hits += 1", "make it an output of watch, or write `self.hits` in both"),
        ("if hits > 2:\n    hits = 0", "make it an output of watch, or write `self.hits` in both"),
        ("print(hits)", "pass it to watch as an input, or write `self.hits` in both"),
    ],
)
def test_a_variable_of_the_automaton_above_is_said_to_be_its_own(
    tmp_path: Path, code: str, advice: str
) -> None:
    expected = f"NameError: `hits` is a variable of walk, and watch has its own; {advice}"
    assert said(tmp_path, *nested(code)) == expected


def test_one_that_no_code_of_the_automaton_above_uses_is_its_own_too(tmp_path: Path) -> None:
    above, below = nested("hits += 1")
    message = said(tmp_path, above.replace("hits += 0", "pass"), below)
    assert message.startswith("NameError: `hits` is a variable of walk, and watch has its own;")


def test_one_of_two_levels_above_is_found(tmp_path: Path) -> None:
    message = said(
        tmp_path,
        sub(1, 0, state(1, "play", initial=True, child=2), variables="hits = 0"),
        sub(2, 1, state(1, "watch", initial=True, child=3)),
        sub(3, 2, state(1, "count", "print(hits)", initial=True)),
    )
    assert message.startswith(
        "NameError: `hits` is a variable of walk, and watch has its own; pass it to watch"
    )


def test_one_that_no_automaton_above_has_lacks_a_value(tmp_path: Path) -> None:
    above, below = nested("hits += 1", variables="")
    message = said(tmp_path, above.replace("hits += 0", "pass"), below)
    assert message == "NameError: `hits` has no value yet; give it one in the variables of watch"


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        (
            "self.Head.stop()",
            "`self.Head` is not declared; declare an interface, function or parameter, or assign",
        ),
        ("self.slep(1)", "`self.slep` is not declared; did you mean `self.sleep`?"),
        ("''.Head", "'str' object has no attribute 'Head'"),
    ],
)
def test_an_attribute_that_nothing_declares_is_called_so(tmp_path: Path, code: str, expected: str) -> None:
    message = said(tmp_path, sub(1, 0, state(1, "go", code, initial=True)))
    assert message.startswith(f"AttributeError: {expected}")


def test_a_test_that_fails_says_the_same(tmp_path: Path) -> None:
    path = tmp_path / "walk.xml"
    path.write_text(document(sub(1, 0, state(1, "go", "self.slep(1)", initial=True))))
    expected = (
        r"the code of walk raised AttributeError: `self.slep` is not declared; did you mean `self.sleep`\?\n"
    )
    with Execution(load(generate(path, tmp_path))) as run, pytest.raises(BehaviorFailed, match=expected):
        run.advance(0.5)


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        ("unknown", "NameError: name 'unknown' is not defined"),
        ("1 / 0", "ZeroDivisionError: division by zero"),
        ("import no_such", "ModuleNotFoundError: No module named 'no_such': try `pip install no_such`"),
    ],
)
def test_other_errors_are_in_the_words_of_python(tmp_path: Path, code: str, expected: str) -> None:
    assert said(tmp_path, sub(1, 0, state(1, "go", code, initial=True))) == expected
