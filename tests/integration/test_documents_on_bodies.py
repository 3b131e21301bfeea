"""Every document of ours on every body: it runs, or an error of ours says what the robot lacks.

In `make test` each document is run on one body, in turn on the one that has most and the one that has least, and in
`make soak` on all of them.
"""

from __future__ import annotations

import re
from contextlib import closing
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from hfsm_runtime.virtual import BehaviorFailed
from naoserver.bodies import BODY_NAMES, find_body
from naoserver.errors import RobotError
from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from tests.support.present import present
from tests.support.processes import REPOSITORY
from tests.support.soak import cases, repeated
from visualhfsm.testing import Behavior, MakeBehavior
from zenoh_ice import VirtualClock, ZenohIceError

DOCUMENTS = sorted(
    path
    for pattern in ("behaviors/*.xml", "examples/*/*.xml", "exercises/**/*.xml", "shelf/*.xml")
    for path in REPOSITORY.glob(pattern)
)
LONG_ENOUGH = repeated(3.0, 5.0)
"""Seconds in which a document calls all that it calls; score.xml and wave_a_hand.xml, later, have tests of their own."""
MOST, ONE_CAMERA, LEAST = "H25", "T1", "Cart"


WRONG_ON_EVERY_BODY = {
    "exercises/walk/mistakes/degrees.xml": "heading is 180: it must be from -6.28319 to 6.28319"
}
"""What a document does wrong that is a mistake by design, and no lack of a robot."""
KICKS = "Cart cannot play football: its body has no kicks"
THERE_IS_NO = re.compile(
    r"there is no (servant|light|motion|posture) '?(\w+)'?; there are ([\w, ]+?)( and \d+ more)?( \(field='name'\))?"
)
LIES = re.compile(
    r"the robot cannot walk: it lies, or it falls; .*"
    r"|\w+ begins standing, in \w+, but the robot is lying on its [\w ]+ now"
    r"|it is lying on its [\w ]+, and no motions lead from there to \w+"
)
THREE = ["H25", "T1", "G1"]
PUSH = {"H25": 60.0, "T1": 600.0, "G1": 600.0}
"""The force in N that pushes each of them over, in 0.1 s."""
SHELF = [document for document in DOCUMENTS if document.parent.name == "shelf"]
MOVE = ["kick", "play_a_motion", "sit", "stand", "turn", "walk_to", "wave_a_hand"]
"""The ready states that a robot which lies may refuse."""


def on_bodies(documents: list[Path], *few: str) -> list[Any]:
    """Return documents with bodies: each with one of a few in turn, and all others for `make soak`."""
    chosen = [(document, few[number % len(few)]) for number, document in enumerate(documents)]
    every = [(document, body) for document in documents for body in BODY_NAMES]
    parameters = {
        (document, body): pytest.param(document, body, id=f"{document.relative_to(REPOSITORY)} on {body}")
        for document, body in every
    }
    return cases(
        [parameters[each] for each in chosen], [parameters[each] for each in every if each not in chosen]
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
    kind, name, listed, more, _ = said.groups()
    there_is, named = parts_of(body)[kind], {*listed.split(", ")}
    return name not in there_is and (named < there_is if more or kind == "servant" else named == there_is)


def run(b: Behavior) -> str:
    """Run a document for a while, and return the error of ours that halted it, if any."""
    try:
        b.advance(LONG_ENOUGH)
    except BehaviorFailed as failure:
        if isinstance(failure.__cause__, ZenohIceError | RobotError):
            return str(failure.__cause__)
        raise
    return ""


@pytest.mark.parametrize(
    ("document", "body"), on_bodies([each for each in DOCUMENTS if each not in SHELF], MOST, LEAST)
)
def test_it_runs_or_says_what_the_robot_lacks(behavior: MakeBehavior, document: Path, body: str) -> None:
    name = str(document.relative_to(REPOSITORY))
    if "turtlebot" in name:
        pytest.importorskip("visualhfsm_ros2", reason="the document uses ROS")
    if "score" in name:
        pytest.importorskip("visualhfsm_match", reason="the document plays football")
    message = run(behavior(document, robot="fake", body=body))
    if name in WRONG_ON_EVERY_BODY:
        assert message.startswith(WRONG_ON_EVERY_BODY[name])
    else:
        lacks = body not in THREE or not name.startswith("exercises/")
        assert message == "" or (lacks and names_a_lack(message, body)), message


@pytest.mark.parametrize(("document", "body"), on_bodies(SHELF, MOST, ONE_CAMERA, LEAST))
def test_a_ready_state_ends_with_what_the_robot_lacks(
    behavior: MakeBehavior, document: Path, body: str
) -> None:
    b = behavior(document, robot="fake", body=body)
    assert run(b) == ""
    reason = b.variables(document.stem)["reason"]
    assert (b.active == "failed") == bool(reason)
    assert reason == "" or names_a_lack(reason, body)


@pytest.mark.sim
@pytest.mark.parametrize(
    ("name", "body"),
    cases(
        [("stand", "T1"), ("walk_to", "H25"), ("kick", "G1")],
        [pytest.param(name, body) for name in MOVE for body in THREE],
    ),
)
def test_a_ready_state_of_a_robot_that_lies_does_it_or_ends_with_a_reason(
    behavior: MakeBehavior, name: str, body: str
) -> None:
    b = lying(behavior, SHELF[0].with_stem(name), body)
    assert run(b) == ""
    reason = b.variables(name)["reason"]
    assert (b.active == "failed") == bool(reason)
    assert reason == "" or LIES.fullmatch(reason) or names_a_lack(reason, body)


@pytest.mark.sim
@pytest.mark.parametrize("body", cases(["H25"], ["T1", "G1"]))
@pytest.mark.parametrize(
    "document",
    cases(
        [REPOSITORY / "exercises/walk/solution/solution.xml"],
        [document for document in DOCUMENTS if document.is_relative_to(REPOSITORY / "exercises")],
    ),
    ids=lambda path: str(path.relative_to(REPOSITORY)),
)
def test_an_exercise_of_a_robot_that_lies_runs_or_says_that_it_lies(
    behavior: MakeBehavior, document: Path, body: str
) -> None:
    message = run(lying(behavior, document, body))
    wrong = WRONG_ON_EVERY_BODY.get(str(document.relative_to(REPOSITORY)), "-")
    assert message == "" or LIES.match(message) or message.startswith(wrong), message


def lying(behavior: MakeBehavior, document: Path, body: str) -> Behavior:
    """Return a behavior before its first cycle, whose robot has been pushed over."""
    b = behavior(document, robot="sim", body=body, camera="drawn", world="empty")
    present(b.robot.device.stage).push((PUSH[body], 0.0, 0.0), 0.1)
    b.world.clock.advance(3.0)
    assert b.robot.state.fallen
    return b
