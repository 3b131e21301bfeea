"""An H21, the H25 with hands that do not move, is asked for by name, and works by its own facts.

The tests of conformance run on it, too.
"""

import pytest

from hfsm_runtime import Automaton, Component, Proxy, State
from interfaces.jderobot import CameraPrx, InvalidValueException, Pose3DMotorsPrx
from interfaces.nao import ActionStatus, JointsPrx, ScenePrx, TouchPrx
from naoserver.bodies.nao import H21, H25
from naoserver.bodies.parts import Stance
from naoserver_sim.model import build_model
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from tests.support.camera_limits import PATIENT_CAMERAS
from tests.support.motion_rig import MotionRig
from tests.support.robot_server import HASTE, served_to_client, wait_for
from visualhfsm.testing import BehaviorFailed
from zenoh_ice import ObjectNotExistException, VirtualClock

pytestmark = pytest.mark.sim

FIXED = {"LWristYaw", "RWristYaw", "LHand", "RHand"}


@pytest.fixture(scope="module")
def nao():
    with served_to_client(SimulatedRobot(speed=4.0, body=H21, camera_limits=PATIENT_CAMERAS)) as nao:
        yield nao


def test_its_facts_are_those_of_the_h25_without_four_joints():
    assert set(H25.joint_names) - set(H21.joint_names) == FIXED
    assert [joint for joint in H25.joints if joint.name not in FIXED] == list(H21.joints)
    assert H21.links == H25.links
    assert all(posture.angles.keys() == set(H21.joint_names) for posture in H21.postures.values())
    assert len(H21.touch_sensors) == len(H25.touch_sensors) - 6


@pytest.mark.parametrize("skin", [True, False])
def test_it_weighs_and_looks_like_an_h25(skin):
    h21, h25 = (build_model(body=body, skin=skin).mj for body in (H21, H25))
    assert h21.nv == h25.nv - 4
    assert h21.nu == h25.nu - 4
    assert h21.ngeom == h25.ngeom
    assert h21.body_mass.sum() == pytest.approx(h25.body_mass.sum())
    hand = h21.body("l_wrist_hand")
    assert hand.jntnum[0] == 0
    assert hand.pos == pytest.approx(h25.body("l_wrist_hand").pos)


def test_what_moves_its_hands_is_refused(nao):
    with pytest.raises(InvalidValueException, match="LHand"):
        nao.proxy(JointsPrx, "Body").setJointPositions({"LHand": 0.5}, 0.5)
    name = "LeftWristMotors"
    assert not {name, "RightHandMotors"} & nao.assembly.servants.keys()
    with nao.client(timeout=HASTE) as hasty, pytest.raises(ObjectNotExistException):
        Pose3DMotorsPrx.checkedCast(hasty.communicator.stringToProxy(name))


def test_it_has_no_sensors_in_its_hands(nao):
    touch, scene = nao.proxy(TouchPrx, "Touch"), nao.proxy(ScenePrx, "Scene")
    scene.pressSensor("HeadFront", 5.0)
    wait_for(touch.getTouchReading, lambda state: "HeadFront" in state.touched)
    with pytest.raises(InvalidValueException, match="LHandBack"):
        scene.pressSensor("LHandBack", 1.0)


@pytest.mark.gl
def test_its_camera_knows_where_a_pixel_is_on_the_floor(nao):
    camera = nao.proxy(CameraPrx, "CameraBottom")
    camera.getImageData("RGB8")
    point = camera.getFloorPoint(160.0, 120.0, 0.0)
    assert 0.2 < point.x < 1.0
    assert point.y == pytest.approx(0.0, abs=0.1)


def test_it_gets_up():
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, skin=False, world=load_world("empty"), body=H21)
    rig = MotionRig(robot, clock)
    rig.let_go(0.8)
    rig.robot.stage.push((80.0, 0.0, 0.0), 0.15)
    rig.let_go(3.0)
    assert rig.stance is Stance.BELLY
    assert max(rig.robot.read().stiffnesses) == 0.0, "it let go in the fall"
    assert rig.go("Stand").status is ActionStatus.Done
    assert rig.posture == "Stand"
    assert min(rig.robot.read().stiffnesses) == 1.0


class Twist(Component):
    """Turns a wrist."""

    Wrist = Proxy("LeftWristMotors", Pose3DMotorsPrx)

    def automaton(self) -> Automaton:
        return Automaton(id=1, name="twist", states=(State("turn", initial=True, code=self.turn),))

    def turn(self) -> None:
        command = self.Wrist.getPose3DMotorsData()
        command.pan = 0.5
        self.Wrist.setPose3DMotorsData(command)


@pytest.mark.parametrize("robot", ["fake", "sim"])
def test_a_behavior_that_turns_a_wrist_says_that_there_is_none(behavior, robot):
    on_h25 = behavior(Twist, robot=robot)
    on_h25.advance(1.5)
    assert on_h25.robot.joint("LWristYaw") == pytest.approx(0.5, abs=0.05)
    on_h21 = behavior(Twist, robot=robot, body="H21")
    with pytest.raises(BehaviorFailed, match=r"no servant LeftWristMotors; there are LeftHipMotors, Left"):
        on_h21.advance(1.5)
