"""Tests of the paper's behaviors enter every state, fire every transition, and see every guard both ways."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
FEW = ("again", "searched_and_found", "whose_turn", "turns_of_ten", "ten_positions")
"""Parts of the names of tests that are enough: all of them would take longer, and cover no more."""
TESTS = sorted(Path(__file__).parent.glob("test_behaviors_[df]*.py"))


def test_the_behaviors_are_covered_whole(tmp_path: Path) -> None:
    report = tmp_path / "coverage.json"
    tests = [
        sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-k", " or ".join(FEW), *map(str, TESTS),
        "--hfsm-cov=behaviors", "--hfsm-cov-report=term", f"--hfsm-cov-report=json:{report}", "--hfsm-cov-fail-under=100",
    ]  # fmt: skip
    run = subprocess.run(tests, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    found = json.loads(report.read_text("utf-8"))
    assert [document["file"] for document in found["documents"]] == [
        "behaviors/dance.xml", "behaviors/dance_and_follow.xml", "behaviors/follow_ball.xml",
    ]  # fmt: skip
    assert found["percent"] == 100
