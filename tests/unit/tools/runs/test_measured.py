"""A command that is measured ends as it does alone."""

from __future__ import annotations

import re
import sys

import pytest

from tools.runs.measured import main


def test_it_says_what_the_command_cost_and_ends_like_it(capfd: pytest.CaptureFixture[str]) -> None:
    assert main("90", "61", sys.executable, "-c", "print('done'); raise SystemExit(3)") == 3
    done, took = capfd.readouterr().out.splitlines()
    assert done == "done"
    assert re.fullmatch(r"took \d+:\d\d min of 1:30, processor time \d+:\d\d min of 1:01", took)
