"""The recording of a trial: what failed, what its cameras saw, and that it is the same each time."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from visualhfsm._monitor.realm.run_log import RunLog
from visualhfsm._monitor.recordings import RecordedRun, open_recording
from visualhfsm.trials import Disturbance, Outcome, Plan, Spread, Success
from visualhfsm.trials._trial import run_trial

FAILURES = {
    "eye": Disturbance(at=0.7, fail=("Camera", "CameraBottom"), kind="frozen", seconds=0.5),
    "neck": Disturbance(at=1.0, fail="HeadYaw", kind="noisy", amount=Spread(lowest=0.01, highest=0.1)),
}


@dataclass
class Recorded:
    """A trial that was recorded."""

    outcome: Outcome
    run: RecordedRun

    @property
    def pixels(self) -> dict[str, list[bytes]]:
        """The pictures of each camera, in order."""
        found = self.run.pictures.spread(1000)
        return {camera: [jpeg for _, jpeg in each] for camera, each in found.items()}


def moments(log: RunLog) -> list[dict[str, Any]]:
    """Return all moments, without the wall times that differ from run to run."""
    import json

    found = [json.loads(moment) for _, moment in log.moments(1 << 30)]
    for each in found:
        del each["at"], each["component"]["startedAt"]
        for automaton in each["component"]["automata"]:
            del automaton["lastCycle"], automaton["longestCycle"], automaton["overruns"]
    return found


def record(path: Path, robot: str, **fields: Any) -> Recorded:
    plan = Plan(
        document="behaviors/follow_ball.xml",
        **{"robot": robot, "camera": "drawn", "limit": 2.0, "success": Success(), **fields},
    )
    return Recorded(run_trial(plan, 3, path), open_recording(path))


@pytest.mark.parametrize("robot", ["fake", pytest.param("sim", marks=pytest.mark.sim)])
def test_its_failures_are_in_it_and_are_those_of_the_trial_run_again(tmp_path: Path, robot: str) -> None:
    first, again = (record(tmp_path / f"{number}.mcap", robot, disturbances=FAILURES) for number in (1, 2))
    shown = [
        (str(span).partition(" from ")[0], span.start, span.end) for span in first.run.log.timeline().failures
    ]
    eye, amount = first.outcome.values["eye.fail"], float(first.outcome.values["neck.amount"])
    frozen, noisy = f"{eye} frozen", f"HeadYaw noisy {amount:g}"
    assert [what for what, _, _ in shown] == [frozen, f"{frozen}, {noisy}", noisy]
    assert [time for what in shown for time in what[1:]] == pytest.approx(
        [0.7, 1.0, 1.0, 1.2, 1.2, 2.0], abs=0.11
    )
    assert moments(again.run.log) == moments(first.run.log)
    assert again.run.log.timeline() == first.run.log.timeline()
    assert again.pixels == first.pixels
    assert again.outcome == first.outcome


def test_of_a_document_that_asks_for_no_picture_it_has_those_of_the_cameras(tmp_path: Path) -> None:
    found = record(tmp_path / "run.mcap", "fake")
    assert {camera: len(each) for camera, each in found.pixels.items()} == {"Camera": 5, "CameraBottom": 5}


def test_it_only_looks(tmp_path: Path) -> None:
    found = record(tmp_path / "run.mcap", "fake", disturbances=FAILURES)
    plan = Plan(
        document="behaviors/follow_ball.xml",
        robot="fake",
        limit=2.0,
        success=Success(),
        disturbances=FAILURES,
        camera="drawn",
    )
    assert run_trial(plan, 3) == found.outcome
