"""Where the robot and the things around it are, as a recording holds it: what comes from whom, and once."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import pytest

from hfsm_runtime._recording.recorder import Recorder
from hfsm_runtime._recording.surroundings import recorded_surroundings
from hfsm_runtime.recording_file.messages import Description, RobotPose, World
from hfsm_runtime.recording_file.writer import Entry
from naoserver.bodies.description import write_looks
from naoserver.body import write_body
from naoserver.fake import FakeRobot
from tests.support.robot_server import eventually, served_to_client


class Written:
    """What a recorder writes."""

    def __init__(self) -> None:
        self.entries: list[Entry] = []
        self.recorder = Recorder(self.entries.append, time.time_ns())

    def of(self, kind: type[Any]) -> list[Any]:
        return [entry.message for entry in self.entries if isinstance(entry.message, kind)]

    def until(self, holds: Callable[[], object]) -> None:
        eventually(lambda: bool(holds()))


@pytest.fixture
def written() -> Written:
    return Written()


@pytest.mark.slow
def test_a_robot_without_a_world_is_recorded_by_its_joints(written: Written) -> None:
    with (
        served_to_client(FakeRobot()) as nao,
        recorded_surroundings(nao.communicator, written.recorder),
    ):
        written.until(lambda: [pose for pose in written.of(RobotPose) if pose.joints])
        written.until(lambda: written.of(Description))
    pose = written.of(RobotPose)[-1]
    assert {"HeadYaw", "LKneePitch"} <= pose.joints.keys()
    assert (pose.torso, pose.objects) == (None, {})
    assert not written.of(World)
    (description,) = written.of(Description)
    assert description == Description(write_body(nao.robot.body), write_looks(nao.robot.body))
    assert {entry.topic for entry in written.entries} == {"/description", "/robot"}


@pytest.mark.sim
def test_a_simulation_is_recorded_with_its_world_and_a_thing_where_it_was_put(written: Written) -> None:
    from naoserver_sim.robot import SimulatedRobot
    from naoserver_sim.world import load_world

    robot = SimulatedRobot(skin=False, world=load_world("room"))
    with (
        served_to_client(robot) as nao,
        recorded_surroundings(nao.communicator, written.recorder),
    ):
        written.until(lambda: [pose for pose in written.of(RobotPose) if "Ball" in pose.objects])
        robot.stage.place_object("Ball", (0.5, -1.0, 0.05))
        written.until(
            lambda: written.of(RobotPose)[-1].objects["Ball"][:2] == pytest.approx([0.5, -1.0], abs=0.01)
        )
        written.until(lambda: written.of(World))
    (world,) = written.of(World)
    assert {shape.object for shape in world.shapes} == {"", "Ball", "CubeBlue", "CubeYellow"}
    assert world.shapes[0].kind == "plane"
    assert written.of(RobotPose)[-1].torso == pytest.approx([0, 0, 0.32, 0, 0, 0, 1], abs=0.1)


@pytest.mark.slow
def test_a_robot_that_is_gone_is_recorded_as_unknown(written: Written) -> None:
    with (
        served_to_client(FakeRobot()) as nao,
        recorded_surroundings(nao.communicator, written.recorder),
    ):
        written.until(lambda: [pose for pose in written.of(RobotPose) if pose.joints])
        nao.serving.close()
        written.until(lambda: written.of(RobotPose)[-1] == RobotPose({}))
