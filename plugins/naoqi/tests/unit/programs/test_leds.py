"""ALLeds over a fake robot, in virtual time."""

import pytest

pytest.importorskip("qi")

from naoserver.errors import HardwareFailure, InvalidCommand
from visualhfsm_naoqi.programs._leds import ALLeds


@pytest.fixture
def leds(rig):
    return rig.access.service(ALLeds)


@pytest.mark.parametrize(
    "color", [(1.0, 0.0, 0.0), (0xFF0000,), ("red",)], ids=["three parts", "a number", "a name"]
)
def test_a_fade_to_a_colour_ends_when_it_is_shown(rig, leds, color):
    assert rig.complete(leds.fadeRGB, "FaceLeds", *color, 0.5) == pytest.approx(0.5, abs=0.03)
    assert rig.robot.lights.colors()["LeftEye"] == pytest.approx((1.0, 0.0, 0.0))
    assert rig.robot.lights.colors()["RightEye"] == pytest.approx((1.0, 0.0, 0.0))


def test_one_part_of_a_colour(rig, leds):
    rig.complete(leds.fadeRGB, "ChestLeds", 0.2, 0.4, 0.6, 0.0)
    leds.setIntensity("ChestLedsGreen", 1.0)
    rig.advance(0.1)
    assert rig.robot.lights.colors()["Chest"] == pytest.approx((0.2, 1.0, 0.6))


@pytest.mark.parametrize(
    ("name", "lights"),
    [
        ("FaceLed3", ["LeftEye", "RightEye"]),
        ("FaceLedLeft0", ["LeftEye"]),
        ("FaceLedsRightTop", ["RightEye"]),
        ("LeftEarLedsOdd", ["LeftEar"]),
        ("RightFaceLed1", ["RightEye"]),
        ("LeftEarLed10", ["LeftEar"]),
        ("BrainLed0", ["Head"]),
        ("Face/Led/Red/Left/45Deg/Actuator/Value", ["LeftEye"]),
        ("RFoot/Led/Green/Actuator/Value", ["RightFoot"]),
        ("ChestBoard/Led/Blue/Actuator/Value", ["Chest"]),
    ],
)
def test_a_single_lamp_stands_for_its_group(leds, name, lights):
    assert leds.listGroup(name) == lights


def test_one_color_of_a_single_lamp(rig, leds):
    leds.off("ChestLeds")
    leds.setIntensity("ChestBoard/Led/Blue/Actuator/Value", 0.5)
    rig.advance(0.1)
    assert rig.robot.lights.colors()["Chest"] == pytest.approx((0.0, 0.0, 0.5))


def test_groups_of_ones_own(rig, leds):
    leds.createGroup("Mine", ["ChestLeds", "FeetLeds"])
    leds.off("AllLeds")
    leds.on("Mine")
    rig.advance(0.1)
    assert leds.listGroup("Mine") == ["Chest", "LeftFoot", "RightFoot"]
    assert leds.getIntensity("Mine") == [1.0, 1.0, 1.0]


def seen(rig, call, seconds):
    """Return the colours that the left eye shows until a call ends."""
    colors = set()
    for _ in range(round(seconds / 0.02)):
        rig.advance(0.02)
        colors.add(tuple(round(part, 1) for part in rig.robot.lights.colors()["LeftEye"]))
    call.join()
    return colors


@pytest.mark.parametrize(
    ("effect", "arguments", "shown"),
    [
        ("rasta", (3.0,), {(0.0, 1.0, 0.0), (1.0, 1.0, 0.0), (1.0, 0.0, 0.0)}),
        ("rotateEyes", (0xFF0000, 0.5, 2.0), {(1.0, 0.0, 0.0), (0.0, 0.0, 0.0)}),
        ("randomEyes", (2.0,), set()),
    ],
)
def test_an_effect_lasts_as_long_as_it_should(rig, leds, effect, arguments, shown):
    start = rig.clock.now()
    call = rig.begin(getattr(leds, effect), *arguments)
    colors = seen(rig, call, arguments[-1] + 0.2)
    assert shown <= colors
    assert len(colors) > 5
    assert rig.complete(getattr(leds, effect), *arguments) == pytest.approx(arguments[-1], abs=0.1)
    assert rig.clock.now() - start < 3 * arguments[-1]


def test_an_effect_can_be_stopped(rig, leds):
    call = rig.begin(leds.randomEyes, 60.0)
    call.call.stop()
    rig.advance(0.1)
    call.join()


def test_lights_that_are_none(rig, leds):
    with pytest.raises(InvalidCommand, match="no group of lights 'Nose'"):
        leds.on("Nose")
    rig.robot.lights = None
    with pytest.raises(HardwareFailure, match="no lights"):
        leds.on("FaceLeds")
