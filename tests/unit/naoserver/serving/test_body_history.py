"""Where the head was at the time of a picture, of a fake robot in virtual time."""

from __future__ import annotations

import pytest

from naoserver.fake import FakeRobot
from naoserver.serving.camera import BodyHistory
from zenoh_ice import VirtualClock

HEAD_YAW = 3
"""Its place in a situation, behind the time, roll and pitch."""


def test_between_two_situations_the_head_has_turned_in_proportion() -> None:
    clock = VirtualClock()
    robot = FakeRobot(clock)
    history = BodyHistory(robot, lambda: None)
    robot.command_velocities({"HeadYaw": 1.0})
    noted = []
    for _ in range(2):
        clock.advance(0.1)
        noted.append(history.note())
    first, second = noted
    middle = history.at((first[0] + second[0]) / 2)
    assert middle[HEAD_YAW] == pytest.approx((first[HEAD_YAW] + second[HEAD_YAW]) / 2)
    assert history.at(0.0)[HEAD_YAW] == pytest.approx(first[HEAD_YAW]), "older than all that is known"
    assert history.at(1e9)[HEAD_YAW] == pytest.approx(second[HEAD_YAW])


def test_it_notes_only_while_pictures_are_taken() -> None:
    clock = VirtualClock()
    begun: list[float] = []
    history = BodyHistory(FakeRobot(clock), lambda: begun.append(clock.now()))
    clock.advance(5.0)
    history.note()
    history.at(5.0)
    clock.advance(0.5)
    history.at(5.5)
    assert begun == [5.0]
    clock.advance(5.0)
    history.at(10.5)
    assert begun == [5.0, 10.5]
