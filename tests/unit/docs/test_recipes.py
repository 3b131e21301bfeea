"""The recipes of docs/how-to: their documents compile without diagnostics, and their tests pass."""

from __future__ import annotations

import re
import shutil

import pytest
from typer.testing import CliRunner

from tests.support.pages import DOCS, blocks_of
from visualhfsm._commands.app import app

pytest_plugins = "pytester"

RECIPES = [
    *("how-to/see-a-ball", "how-to/walk-to-a-place", "how-to/wait", "how-to/combine"),
    pytest.param("how-to/localization", marks=[pytest.mark.sim, pytest.mark.gl]),
]


@pytest.mark.slow
@pytest.mark.parametrize("recipe", RECIPES)
def test_the_recipe_works(recipe: str, pytester: pytest.Pytester) -> None:
    page = (DOCS / f"{recipe}.md").read_text("utf-8")
    for imported in ("behaviors/follow_ball.xml", "shelf/look_for_a_ball.xml"):
        shutil.copy(DOCS.parent / imported, pytester.path)
    tests = ""
    for block in blocks_of(page):
        if block.name is not None:
            (pytester.path / block.name).write_text(block.text, "utf-8")
            done = CliRunner().invoke(app, ["check", str(pytester.path / block.name)])
            assert "nothing to report" in done.output
        elif block.language == "python":
            tests += block.text
    (pytester.path / "test_recipe.py").write_text(tests, "utf-8")
    result = pytester.runpytest_inprocess("-p", "no:cacheprovider", "-p", "no:anyio")
    result.assert_outcomes(passed=len(re.findall(r"^def test_", tests, re.M)))
    assert tests
