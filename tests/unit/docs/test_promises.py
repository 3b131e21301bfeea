"""README.md promises what tests/doors holds: a door for each bullet of *What it does*, and a promise for each door."""

from __future__ import annotations

import ast
import re
from pathlib import Path

from tests.support.places import ROOT

README = " ".join((ROOT / "README.md").read_text("utf-8").split())


def promises() -> dict[str, list[str]]:
    """Return the words of the README that each door says to hold, by its file and name."""
    found = {}
    for path in sorted(Path(ROOT, "tests/doors").glob("test_*.py")):
        for node in ast.parse(path.read_text("utf-8")).body:
            if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
                marks = [each for each in node.decorator_list if "mark.promise" in ast.unparse(each)]
                found[f"{path.name}::{node.name}"] = [ast.literal_eval(each.args[0]) for each in marks]  # type: ignore[attr-defined]
    return found


def test_each_door_holds_what_the_readme_promises() -> None:
    assert {door: held for door, held in promises().items() if not held} == {}
    said = {door: [each for each in held if each not in README] for door, held in promises().items()}
    assert {door: others for door, others in said.items() if others} == {}


def test_each_bullet_of_the_readme_has_a_door() -> None:
    bullets = re.findall(r"- (\*\*.+?) →", README.partition("## What it does")[2].partition("```")[0])
    held = [promise for each in promises().values() for promise in each]
    assert len(bullets) > 5, "they are not found any more"
    assert [bullet for bullet in bullets if not any(promise in bullet for promise in held)] == []
