"""`nao faults`: parts of a robot that fail, on a robot that is served."""

from __future__ import annotations

import json
from collections.abc import Iterator

import pytest

from naoserver.fake import FakeRobot
from tests.support.nao_command import at, nao
from tests.support.robot_server import served


@pytest.fixture(scope="module")
def served_robot() -> Iterator[FakeRobot]:
    robot = FakeRobot()
    with served(robot) as server, at(server.endpoint, server.realm):
        yield robot


@pytest.fixture
def robot(served_robot: FakeRobot) -> Iterator[FakeRobot]:
    yield served_robot
    served_robot.faults.heal()


def test_what_is_injected_is_listed_until_all_is_healed(robot: FakeRobot) -> None:
    assert "nothing was made to fail" in nao("faults").out
    assert nao("faults", "HeadYaw", "stuck").out == "HeadYaw fails: stuck, until it is healed\n"
    injected = nao("faults", "HeadPitch", "offset", "-0.2", "--seconds", "60").out
    assert injected.startswith("HeadPitch fails: offset -0.2, for ")
    listed = json.loads(nao("faults", "--json").out)
    assert [(fault["part"], fault["kind"]) for fault in listed["faults"]] == [
        ("HeadYaw", "stuck"),
        ("HeadPitch", "offset"),
    ]
    assert nao("faults", "HeadYaw", "--heal").out == "HeadYaw works again\n"
    assert [part for part, _ in robot.faults.current()] == ["HeadPitch"]
    assert nao("faults", "--heal").out == "all works again\n"
    assert not robot.faults.current()


@pytest.mark.usefixtures("robot")
def test_a_part_says_how_it_can_fail_and_how_much() -> None:
    said = nao("faults", "Camera").out
    assert "late" in said
    assert "0 to 10 s, 0.5 usually" in said
    assert "HeadYaw" not in said


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["Knee"], 1, "there is no part 'Knee' that can fail; there are HeadYaw"),
        (["HeadYaw", "bent"], 1, "HeadYaw cannot be 'bent': it can be stuck"),
        (["HeadYaw", "offset", "9"], 1, "must be from -0.5 to 0.5 rad"),
        (["HeadYaw", "--seconds", "3"], 2, "--seconds needs a PART and a KIND"),
        (["HeadYaw", "stuck", "--heal"], 2, "--heal takes nothing but a PART"),
        (["--bent"], 2, "there is no option --bent"),
    ],
)
def test_what_cannot_be_is_refused(robot: FakeRobot, words: list[str], code: int, said: str) -> None:
    result = nao("faults", *words)
    assert result.code == code
    assert said in " ".join(result.err.replace("│", " ").split())
    assert not robot.faults.current()
