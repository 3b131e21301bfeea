"""The names of zenoh_ice, which are imported when they are first used."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

import zenoh_ice
from tests.support.limits import RUN_LIMIT


def test_what_type_checkers_see_is_what_programs_get() -> None:
    text = Path(zenoh_ice.__file__).read_text("utf-8")
    declared = {
        name: module for module, name in re.findall(r"^    from (\.[\w.]+) import (\w+) as \2$", text, re.M)
    }
    assert {"Communicator", "Subscription"} < {*declared} <= {*dir(zenoh_ice)}
    for name, module in declared.items():
        assert getattr(zenoh_ice, name).__module__ == f"zenoh_ice{module}"


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="module 'zenoh_ice' has no attribute 'Communicater'"):
        getattr(zenoh_ice, "Communicater")  # noqa: B009


@pytest.mark.slow
def test_the_beginning_of_a_command_loads_next_to_nothing() -> None:
    code = "import sys, zenoh_ice.application; print({'zenoh', 'msgspec', 'typer'} & sys.modules.keys())"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=RUN_LIMIT, check=True
    )
    assert done.stdout == "set()\n"
