"""Every document of ours on every body: it runs, or an error of ours says what the robot lacks.

In `make test` on the body that has most and the one that has least, and on all of them in `make soak`.
"""

from __future__ import annotations

import re
from contextlib import closing
from functools import cache
from pathlib import Path

import pytest

from hfsm_runtime.virtual import BehaviorFailed
from naoserver.assembly import Assembly
from naoserver.bodies import BODY_NAMES, find_body
from naoserver.errors import RobotError
from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from tests.support.processes import REPOSITORY
from tests.support.soak import cases, repeated
from visualhfsm.testing import MakeBehavior
from zenoh_ice import VirtualClock, ZenohIceError

DOCUMENTS = sorted(
    path
    for pattern in ("behaviors/*.xml", "examples/*/*.xml", "exercises/**/*.xml", "shelf/*.xml")
    for path in REPOSITORY.glob(pattern)
)
GOAL = REPOSITORY / "exercises/goal"
LONG_ENOUGH = repeated(3.0, 5.0)
"""Seconds in which a document calls all that it calls; score.xml and wave_a_hand.xml, later, have tests of their own."""
MOST, ONE_CAMERA, LEAST = "H25", "T1", "Cart"
OTHERS = [body for body in BODY_NAMES if body not in (MOST, LEAST)]


WRONG_ON_EVERY_BODY = {
    "exercises/walk/mistakes/degrees.xml": "heading is 180: it must be from -6.28319 to 6.28319"
}
"""What a document does wrong that is a mistake by design, and no lack of a robot."""
KICKS = "Cart cannot play football: its body has no kicks"
THERE_IS_NO = re.compile(
    r"there is no (servant|light|motion|posture) '?(\w+)'?; there are ([\w, ]+?)( \(field='name'\))?"
)


@cache
def parts_of(body: str) -> dict[str, set[str]]:
    """Return what a fake robot with a body has, by kind and name."""
    clock = VirtualClock()
    with closing(FakeRobot(clock, body=find_body(body))) as robot:
        assembly = Assembly(robot, ServerOptions(), clock)
        return {
            "servant": {*assembly.servants},
            "light": {*robot.body.lights},
            "motion": {*assembly.player.motions},
            "posture": {*robot.body.postures},
        }


def names_a_lack(message: str, body: str) -> bool:
    """Return whether an error names something that the robot lacks, and lists what it has instead."""
    if message == KICKS:
        return not find_body(body).kicks
    said = THERE_IS_NO.fullmatch(message)
    if said is None:
        return False
    kind, name, listed, _ = said.groups()
    there_is = parts_of(body)[kind]
    return name not in there_is and {*listed.split(", ")} == there_is


@pytest.mark.parametrize("body", cases([MOST, LEAST], OTHERS))
@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(REPOSITORY)))
def test_it_runs_or_says_what_the_robot_lacks(behavior: MakeBehavior, document: Path, body: str) -> None:
    wrong = WRONG_ON_EVERY_BODY.get(str(document.relative_to(REPOSITORY)))
    b = behavior(document, robot="fake", body=body)
    reason = None
    try:
        b.advance(LONG_ENOUGH)
    except BehaviorFailed as failure:
        reason = failure.__cause__
    assert reason is None or isinstance(reason, ZenohIceError | RobotError)
    message = "" if reason is None else str(reason)
    if wrong is None:
        assert message == "" or names_a_lack(message, body), message
    else:
        assert message.startswith(wrong)


@pytest.mark.parametrize(
    "body", cases([MOST, ONE_CAMERA], [body for body in BODY_NAMES if body not in (MOST, ONE_CAMERA)])
)
@pytest.mark.parametrize(
    "document",
    cases(
        [GOAL / "solution/solution.xml"],
        sorted({*GOAL.glob("**/*.xml")} - {GOAL / "solution/solution.xml"}),
    ),
    ids=lambda path: path.stem,
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
