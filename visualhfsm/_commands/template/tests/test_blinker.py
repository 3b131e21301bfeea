"""Tests of behaviors/blinker.xml, in virtual time with a fake robot."""

from lamp import LampI


def test_the_lamp_is_on_while_it_looks_left(behavior):
    lamp = LampI()
    b = behavior("behaviors/blinker.xml", robot="fake", stubs={"Lamp": lamp})
    b.advance(1.5)
    assert b.is_active("left")
    assert lamp.on
    assert b.robot.joint("HeadYaw") > 0.3
    b.run_until("right")
    b.advance(1.5)
    assert not lamp.on
    assert b.robot.joint("HeadYaw") < -0.3
