"""ALTouch, ALSonar and ALSystem over a fake robot, in virtual time."""

import pytest

pytest.importorskip("qi")

from naoserver.bodies.capabilities import SonarReading
from naoserver.bodies.nao import H21, H25
from naoserver.errors import HardwareFailure
from naoserver.fake import FakeRobot
from plugins.naoqi.tests.support.rig import Rig
from visualhfsm_naoqi.programs._sensors import ALRobotModel, ALSonar, ALSystem, ALTouch


@pytest.mark.parametrize(("body", "hands"), [(H25, True), (H21, False)], ids=["H25", "H21"])
def test_the_model_says_whether_there_are_hands(body, hands):
    rig = Rig(lambda clock: FakeRobot(clock, body=body))
    model = rig.access.service(ALRobotModel)
    assert (model.getRobotType(), model.hasArms(), model.hasHands()) == ("Nao", True, hands)
    rig.close()


def test_touch_lists_its_sensors(rig):
    touch = rig.access.service(ALTouch)
    rig.robot.senses.feel(touched=frozenset({"LHandBack"}))
    assert [name for name, touched, _ in touch.getStatus() if touched] == ["LHand/Touch/Back"]
    assert [name for name, _, _ in touch.getStatus()] == touch.getSensorList()
    rig.robot.senses = None
    with pytest.raises(HardwareFailure, match="feels no touch"):
        touch.getStatus()


def test_the_sonar_stands_still_unless_somebody_wants_it(rig, memory):
    rig.robot.senses.feel(sonar=SonarReading(0.5))
    sonar = rig.access.service(ALSonar)
    keys = ["Device/SubDeviceList/US/Left/Sensor/Value", "Device/SubDeviceList/US/Right/Sensor/Value"]
    assert memory.getListData(keys) == [0.0, 0.0]
    sonar.subscribe("me")
    assert memory.getListData(keys) == [0.5, 5.0]
    rig.robot.senses.feel(sonar=SonarReading(0.7))
    sonar.unsubscribe("me")
    rig.robot.senses.feel(sonar=SonarReading(0.9))
    assert memory.getListData(keys) == [0.7, 5.0]


def test_the_system_says_what_it_is(rig):
    assert ["body", "H25"] in rig.access.service(ALSystem).systemInfo()
