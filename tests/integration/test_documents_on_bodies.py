"""Every document of ours on every body: it runs, or an error of ours says what the robot lacks."""

from __future__ import annotations

from pathlib import Path

import pytest

from hfsm_runtime.virtual import BehaviorFailed
from naoserver.bodies import BODY_NAMES
from naoserver.errors import RobotError
from tests.support.processes import REPOSITORY
from visualhfsm.testing import MakeBehavior
from zenoh_ice import ZenohIceError

DOCUMENTS = sorted(
    path
    for pattern in ("behaviors/*.xml", "examples/*/*.xml", "exercises/**/*.xml", "shelf/*.xml")
    for path in REPOSITORY.glob(pattern)
)
LONG_ENOUGH = 5.0  # s


@pytest.mark.parametrize("body", BODY_NAMES)
@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(REPOSITORY)))
def test_it_runs_or_says_what_the_robot_lacks(behavior: MakeBehavior, document: Path, body: str) -> None:
    b = behavior(document, robot="fake", body=body)
    reason = None
    try:
        b.advance(LONG_ENOUGH)
    except BehaviorFailed as failure:
        reason = failure.__cause__
    assert reason is None or isinstance(reason, ZenohIceError | RobotError)


@pytest.mark.parametrize("body", BODY_NAMES)
@pytest.mark.parametrize(
    "document", sorted(REPOSITORY.glob("exercises/goal/**/*.xml")), ids=lambda path: path.stem
)
def test_looking_for_a_ball_can_be_tried_on_robots_with_one_camera(
    behavior: MakeBehavior, caplog: pytest.LogCaptureFixture, document: Path, body: str
) -> None:
    b = behavior(document, robot="fake", body=body, stand_ins=True)
    b.advance(LONG_ENOUGH)
    lacking = [line for line in caplog.messages if line.startswith("self.CameraBottom ")]
    expected = "self.CameraBottom is a stand-in, whose pictures are black; this robot does not serve "
    assert lacking == ([] if body in ("H25", "H21") else [f"{expected}CameraBottom (Camera)"])


def test_football_says_that_a_robot_without_kicks_cannot_play_it(behavior: MakeBehavior) -> None:
    b = behavior("behaviors/score.xml", robot="fake", body="Cart")
    with pytest.raises(BehaviorFailed, match="RobotError: Cart cannot play football: its body has no kicks"):
        b.advance(1.0)
