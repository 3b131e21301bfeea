"""Tests of the paper's behaviors enter every state, fire every transition, and see every guard both ways."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy  # noqa: F401 - a process loads it once, and pytester lets go of what its runs load
import pytest

from tests.support.places import ROOT

pytest_plugins = "pytester"

FEW = ("again", "turns_of_ten")
"""Parts of the names of tests that are enough: all of them would take longer, and cover no more."""
BEHAVIORS = ("dance", "dance_and_follow", "follow_ball")


@pytest.mark.slow
def test_the_behaviors_are_covered_whole(pytester: pytest.Pytester) -> None:
    (pytester.path / "behaviors").mkdir()
    for name in BEHAVIORS:
        shutil.copy(ROOT / "behaviors" / f"{name}.xml", pytester.path / "behaviors")
        shutil.copy(Path(__file__).with_name(f"test_{name}.py"), pytester.path)
    pytester.makeini(
        "[pytest]\nmarkers =\n    gl\n    sim\n    slow\n    soak\naddopts = -p no:anyio -p no:hypothesispytest"
    )
    documents = [f"--hfsm-cov=behaviors/{name}.xml" for name in BEHAVIORS]
    run = pytester.runpytest("-q", "-k", " or ".join(FEW), *documents, "--hfsm-cov-fail-under=100")
    assert run.ret == pytest.ExitCode.OK
    assert re.findall(r"^(\S+\.xml|total) .* (\d+) %$", run.stdout.str(), re.MULTILINE) == [
        *((f"behaviors/{name}.xml", "100") for name in BEHAVIORS),
        ("total", "100"),
    ]
