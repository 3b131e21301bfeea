"""An H21, the H25 with hands that do not move, is built and served from its own facts."""

import pytest

from interfaces.jderobot import CameraPrx, InvalidValueException, Pose3DMotorsPrx
from interfaces.nao import (
    ActionStatus,
    BatteryPrx,
    JointsPrx,
    MotionsPrx,
    PosturesPrx,
    ScenePrx,
    TouchPrx,
    WalkPrx,
)
from naoserver.body import H21, H25
from naoserver_sim.model import build_model
from naoserver_sim.robot import SimulatedRobot
from tests.support.robot_server import eventually, served_to_client, wait_for
from zenoh_ice import ObjectNotExistException

pytestmark = pytest.mark.sim

FIXED = {"LWristYaw", "RWristYaw", "LHand", "RHand"}


@pytest.fixture(scope="module")
def nao():
    with served_to_client(SimulatedRobot(body=H21, speed=3.0)) as nao:
        yield nao


def test_its_facts_are_those_of_the_h25_without_four_joints():
    assert set(H25.joint_names) - set(H21.joint_names) == FIXED
    assert [joint for joint in H25.joints if joint.name not in FIXED] == list(H21.joints)
    assert H21.links == H25.links
    assert all(angles.keys() == set(H21.joint_names) for angles in H21.postures.values())
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


def test_its_joints_are_served_and_move_and_others_are_refused(nao):
    body = nao.proxy(JointsPrx, "Body")
    assert body.getJointNames() == list(H21.joint_names)
    body.setJointPositions({"RElbowRoll": 0.8}, 0.5)
    place = H21.joint_names.index("RElbowRoll")
    wait_for(body.getJointState, lambda state: abs(state.positions[place] - 0.8) < 0.1)
    with pytest.raises(InvalidValueException, match="LHand"):
        body.setJointPositions({"LHand": 0.5}, 0.5)


def test_hinges_that_it_lacks_are_not_served(nao):
    nao.proxy(Pose3DMotorsPrx, "LeftElbowMotors")
    for name in ("LeftWristMotors", "RightHandMotors"):
        assert name not in nao.assembly.servants
        with pytest.raises(ObjectNotExistException):
            Pose3DMotorsPrx.checkedCast(nao.communicator.stringToProxy(name))


def test_it_waves_and_goes_into_postures(nao):
    motions, postures = nao.proxy(MotionsPrx, "Motions"), nao.proxy(PosturesPrx, "Postures")
    motions.play("wave", 1.0)  # its hand opens, on an H25
    wait_for(motions.getMotionState, lambda state: state.status is ActionStatus.Done)
    for posture in ("Crouch", "Stand", "StandInit"):
        postures.goToPosture(posture, 1.0)
        wait_for(
            postures.getPostureState,
            lambda state: (state.name, state.status) == (posture, ActionStatus.Done),  # noqa: B023
        )
        assert postures.getPosture() == posture
    assert not nao.robot.state().fallen


def test_it_walks(nao):
    def x() -> float:
        return float(nao.robot.stage.truth().torso.position[0])

    begin, walk = x(), nao.proxy(WalkPrx, "Walk")
    walk.walkTo(0.3, 0.0, 0.0)
    eventually(lambda: x() > begin + 0.2)
    walk.stop()
    assert not nao.robot.state().fallen


def test_it_has_no_sensors_in_its_hands(nao):
    touch, scene = nao.proxy(TouchPrx, "Touch"), nao.proxy(ScenePrx, "Scene")
    assert touch.getTouchNames() == list(H21.touch_sensors)
    scene.pressSensor("HeadFront", 5.0)
    wait_for(touch.getTouchReading, lambda state: "HeadFront" in state.touched)
    with pytest.raises(InvalidValueException, match="LHandBack"):
        scene.pressSensor("LHandBack", 1.0)
    assert nao.proxy(BatteryPrx, "Battery").getBatteryReading().charge > 0.9


@pytest.mark.gl
def test_its_camera_knows_where_a_pixel_is_on_the_floor(nao):
    camera = nao.proxy(CameraPrx, "CameraBottom")
    camera.getImageData("RGB8")
    point = camera.getFloorPoint(160.0, 120.0, 0.0)
    assert 0.2 < point.x < 1.0
    assert point.y == pytest.approx(0.0, abs=0.1)
