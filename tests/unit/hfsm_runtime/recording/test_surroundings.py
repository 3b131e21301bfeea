"""Where the robot and the things around it are, as a recording holds it: what comes from whom, and once."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, cast

import pytest

from hfsm_runtime._recording.recorder import Recorder
from hfsm_runtime._recording.surroundings import recorded_failures, recorded_surroundings
from hfsm_runtime.component import Component, Proxy
from hfsm_runtime.recording_file.messages import Description, Failing, Fault, RobotPose, World
from hfsm_runtime.recording_file.writer import Entry
from interfaces.nao import FaultsPrx, PoseHeadPrx
from naoserver.bodies.description import write_looks
from naoserver.body import write_body
from naoserver.fake import FakeRobot
from naoserver.robot import Robot
from tests.support.robot_server import eventually, served, served_to_client


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


class Unfailing:
    """A robot that fails by itself only, as a real one does."""

    faults = None

    def __init__(self) -> None:
        self._robot = FakeRobot()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._robot, name)


class TwoHeads(Component):
    """A component that commands a robot of another realm, too."""

    near = Proxy("Head", PoseHeadPrx)
    far = Proxy("Head@far", PoseHeadPrx)


@pytest.mark.slow
def test_what_is_made_to_fail_of_its_robots_is_recorded_until_it_is_healed(written: Written) -> None:
    near, far = FakeRobot(), FakeRobot()
    reminders: list[object] = []
    with (
        served(near) as home,
        served(far, realm="far") as other,
        home.client(connect=[home.endpoint, other.endpoint]) as client,
        recorded_failures(client.communicator, written.recorder, TwoHeads),
        client.proxy(FaultsPrx, "Faults").getFaults.subscribe(reminders.append),
    ):
        written.until(lambda: len(reminders) >= 2)
        assert not written.of(Failing)
        near.faults.inject("LKneePitch", "stuck")
        written.until(lambda: written.of(Failing))
        far.faults.inject("Camera", "late", 0.5)
        written.until(lambda: len(written.of(Failing)) == 2)
        near.faults.heal()
        written.until(lambda: len(written.of(Failing)) == 3)
    knee, camera = Fault("LKneePitch", "stuck"), Fault("Camera@far", "late", 0.5)
    assert [each.faults for each in written.of(Failing)] == [(knee,), (knee, camera), (camera,)]
    assert {entry.topic for entry in written.entries} == {"/faults"}


@pytest.mark.slow
def test_where_nobody_serves_failures_nothing_of_them_is_recorded(written: Written) -> None:
    with (
        served_to_client(cast("Robot", Unfailing())) as nao,
        recorded_surroundings(nao.communicator, written.recorder),
        recorded_failures(nao.communicator, written.recorder, Component),
    ):
        written.until(lambda: [pose for pose in written.of(RobotPose) if pose.joints])
    assert not written.of(Failing)


@pytest.mark.slow
def test_a_robot_that_is_gone_is_recorded_as_unknown(written: Written) -> None:
    with (
        served_to_client(FakeRobot()) as nao,
        recorded_surroundings(nao.communicator, written.recorder),
    ):
        written.until(lambda: [pose for pose in written.of(RobotPose) if pose.joints])
        nao.serving.close()
        written.until(lambda: written.of(RobotPose)[-1] == RobotPose({}))
