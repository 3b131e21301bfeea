"""The names of visualhfsm, which are imported when they are first used."""

from __future__ import annotations

import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

import visualhfsm
from tests.support.limits import RUN_LIMIT
from visualhfsm._document.commands import COMMANDS


def test_what_type_checkers_see_is_what_programs_get() -> None:
    text = Path(visualhfsm.__file__).read_text("utf-8")
    declared = {
        name: module for module, name in re.findall(r"^    from (\.[\w.]+) import (\w+) as \2$", text, re.M)
    }
    assert len(declared) > 80
    assert {*declared} <= {*dir(visualhfsm)}
    for name, module in declared.items():
        found = getattr(visualhfsm, name)
        assert found is getattr(importlib.import_module(f"visualhfsm{module}"), name)


@pytest.mark.parametrize("name", ["Abandoned", "Added", "CounterexampleView", "Step", "StepView"])
def test_the_parts_of_answers_can_be_imported(name: str) -> None:
    assert name in dir(visualhfsm)


def test_all_commands_can_be_imported() -> None:
    assert {command.__name__ for command in COMMANDS} <= {*dir(visualhfsm)}
    assert [getattr(visualhfsm, command.__name__) for command in COMMANDS] == [*COMMANDS]


def test_shells_can_complete_the_names() -> None:
    assert {"AddState", "Project"} <= {*dir(visualhfsm)}


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="module 'visualhfsm' has no attribute 'Projekt'"):
        getattr(visualhfsm, "Projekt")  # noqa: B009


@pytest.mark.slow
def test_the_beginning_of_a_command_loads_no_project() -> None:
    code = "import sys, visualhfsm; print([name for name in sys.modules if name.startswith('visualhfsm')])"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=RUN_LIMIT, check=True
    )
    assert done.stdout == "['visualhfsm']\n"
