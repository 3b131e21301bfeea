"""Tests of the paper's behaviors enter every state, fire every transition, and see every guard both ways."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.limits import RUN_LIMIT
from tests.support.places import ROOT

FEW = ("again", "searched_and_found", "whose_turn", "turns_of_ten", "ten_positions")
"""Parts of the names of tests that are enough: all of them would take longer, and cover no more."""
TESTS = sorted(Path(__file__).parent.glob("test_[df]*.py"))


@pytest.mark.slow
def test_the_behaviors_are_covered_whole() -> None:
    tests = [
        sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-k", " or ".join(FEW), *map(str, TESTS),
        *(f"--hfsm-cov=behaviors/{name}.xml" for name in ("dance", "dance_and_follow", "follow_ball")),
        "--hfsm-cov-fail-under=100",
    ]  # fmt: skip
    run = subprocess.run(tests, cwd=ROOT, capture_output=True, text=True, timeout=RUN_LIMIT, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    assert re.findall(r"^(\S+\.xml|total) .* (\d+) %$", run.stdout, re.MULTILINE) == [
        ("behaviors/dance.xml", "100"),
        ("behaviors/dance_and_follow.xml", "100"),
        ("behaviors/follow_ball.xml", "100"),
        ("total", "100"),
    ]
