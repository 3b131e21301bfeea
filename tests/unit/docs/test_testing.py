"""The examples of docs/how-to/testing.md are tests that pass, and its tables name what exists."""

from __future__ import annotations

import re
from inspect import isfunction

import pytest

from tests.support.pages import DOCS
from visualhfsm.testing import MakeBehavior, strategies

pytest_plugins = "pytester"

PAGE = (DOCS / "how-to/testing.md").read_text("utf-8")
EXAMPLES = re.findall(r"^```python\n(.*?)^```", PAGE, re.M | re.S)


@pytest.mark.slow
def test_the_examples_pass(pytester: pytest.Pytester) -> None:
    (pytester.path / "behaviors").symlink_to((DOCS.parent / "behaviors").resolve())
    for number, example in enumerate(EXAMPLES):
        (pytester.path / f"test_example__{number}.py").write_text(example, encoding="utf-8")
    result = pytester.runpytest("-p", "no:cacheprovider", "-p", "no:anyio")
    result.assert_outcomes(passed=len(re.findall(r"^def test_", "".join(EXAMPLES), re.M)))


def test_what_the_tables_name_is_there(behavior: MakeBehavior) -> None:
    b = behavior(DOCS.parent / "behaviors" / "dance.xml", robot="fake")
    for name in re.findall(r"\bb\.(\w+)", PAGE):
        assert hasattr(type(b), name) or hasattr(b, name), name
    for name in re.findall(r"\bb\.robot\.(\w+)", PAGE):
        assert hasattr(b.robot, name), name
    section = PAGE.partition("The Hypothesis strategies")[2].partition("```")[0]
    assert set(re.findall(r"`(\w+)\(", section)) == {
        name
        for name, value in vars(strategies).items()
        if name[0] != "_" and isfunction(value) and value.__module__ == strategies.__name__
    }


def test_every_option_is_explained(pytester: pytest.Pytester) -> None:
    options = set(re.findall(r"--hfsm[\w-]+", str(pytester.runpytest("--help").stdout)))
    assert len(options) == 4
    assert [option for option in options if option not in PAGE] == []
