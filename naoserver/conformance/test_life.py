"""Life, from start to close."""

import pytest

from naoserver.conformance._plugin import MakeRobot
from naoserver.conformance._robot import CAMERA, needs
from naoserver.errors import HardwareFailure
from naoserver.protocol.robot import Robot


def test_close_may_be_called_again_and_ends_all_motion(closed: Robot) -> None:
    """`close` may be called any number of times; then `read` and `state` return the last snapshot."""
    last, state = closed.read(), closed.state()
    for _ in range(3):
        assert closed.read() == last, "a reading goes on after `close`"
        assert closed.state() == state, "the state goes on after `close`"


def test_commands_after_close_are_ignored(closed: Robot) -> None:
    """After `close` commands are ignored."""
    last = closed.read()
    names = [joint.name for joint in closed.joints]
    closed.command_positions(dict.fromkeys(names, 0.0), dict.fromkeys(names, 0.1))
    closed.command_velocities(dict.fromkeys(names, 0.1))
    closed.command_stiffnesses(dict.fromkeys(names, 0.0), 0.0)
    assert closed.read() == last, "a command has changed the reading after `close`"


@needs(CAMERA)
def test_no_image_is_taken_after_close(closed: Robot) -> None:
    """After `close`, `capture` raises HardwareFailure."""
    camera = closed.cameras[0]
    with pytest.raises(HardwareFailure):
        closed.capture(camera.name, *camera.sizes[0])


def test_a_robot_that_was_never_started_can_be_closed(closed: Robot, make: MakeRobot) -> None:
    """`close` does no harm without `start`."""
    with make() as robot:
        robot.close()
        robot.close()
