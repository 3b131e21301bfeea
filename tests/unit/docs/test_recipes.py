"""Pages whose documents compile without diagnostics, and whose tests pass."""

from __future__ import annotations

import re
import shutil
from inspect import isfunction

import pytest
from typer.testing import CliRunner

from codegen.hfsm._checks.component import STANDARD_OPTIONS
from tests.support.codegen_command import codegen
from tests.support.pages import DOCS, blocks_of
from tests.support.plugins import OF_THE_WHOLE, needs
from visualhfsm._commands.app import app
from visualhfsm.testing import MakeBehavior, strategies

pytest_plugins = "pytester"

RECIPES = [
    *("how-to/see-a-ball", "how-to/walk-to-a-place", "how-to/wait", "how-to/combine", "how-to/testing"),
    "how-to/what-if",
    "reference/components",
    pytest.param(
        "../plugins/match/docs/localization",
        id="localization",
        marks=[pytest.mark.sim, needs("visualhfsm_match")],
    ),
]
PRESUMED = ("behaviors/follow_ball.xml", "shelf/look_for_a_ball.xml")
TESTING = (DOCS / "how-to/testing.md").read_text("utf-8")
COMPONENTS = (DOCS / "reference/components.md").read_text("utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("recipe", RECIPES)
def test_the_recipe_works(recipe: str, pytester: pytest.Pytester) -> None:
    (pytester.path / "behaviors").symlink_to((DOCS.parent / "behaviors").resolve())
    for imported in PRESUMED:
        shutil.copy(DOCS.parent / imported, pytester.path)
    blocks = blocks_of((DOCS / f"{recipe}.md").read_text("utf-8"))
    tests = [block for block in blocks if "\ndef test_" in f"\n{block.text}"]
    for block in blocks:
        if block.name is not None:
            (pytester.path / block.name).write_text(block.text, "utf-8")
    for document in (block.name for block in blocks if block.name and block.language == "xml"):
        done = CliRunner().invoke(app, ["check", str(pytester.path / document)])
        assert "nothing to report" in done.output
        assert codegen(document, cwd=pytester.path).returncode == 0
    for number, test in enumerate(tests):
        (pytester.path / (test.name or f"test_recipe__{number}.py")).write_text(test.text, "utf-8")
    result = pytester.runpytest_inprocess("-p", "no:cacheprovider", "-p", "no:anyio")
    result.assert_outcomes(passed=sum(len(re.findall(r"^def test_", test.text, re.M)) for test in tests))
    assert tests


def test_what_the_tables_name_is_there(behavior: MakeBehavior) -> None:
    b = behavior(DOCS.parent / "behaviors" / "dance.xml", robot="fake")
    for name in re.findall(r"\bb\.(\w+)", TESTING):
        assert hasattr(type(b), name) or hasattr(b, name), name
    for name in re.findall(r"\bb\.robot\.(\w+)", TESTING):
        assert hasattr(b.robot, name), name
    section = TESTING.partition("The Hypothesis strategies")[2].partition("```")[0]
    assert set(re.findall(r"`(\w+)\(", section)) == {
        name
        for name, value in vars(strategies).items()
        if name[0] != "_" and isfunction(value) and value.__module__ == strategies.__name__
    }


def test_every_option_is_explained(pytester: pytest.Pytester) -> None:
    options = set(re.findall(r"--hfsm[\w-]+", str(pytester.runpytest("--help").stdout)))
    assert len(options) == 4
    assert [option for option in options if option not in TESTING] == []


@OF_THE_WHOLE
def test_the_table_has_every_standard_option() -> None:
    hooks = pytest.importorskip("docs.hooks", reason="needs the packages of visualhfsm[docs]")
    shown = "\n".join([hooks.component(), *hooks.shared_options(), "--help"])
    reported = set(re.findall(r"--([a-z-]+)", shown))
    assert "<!-- generated: component -->" in COMPONENTS
    assert {name.replace("_", "-") for name in STANDARD_OPTIONS} <= reported
