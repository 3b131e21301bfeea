from contextlib import closing

import pytest

from naoserver.errors import HardwareFailure
from naoserver_sim import cameras
from naoserver_sim.robot import SimulatedRobot
from zenoh_ice import VirtualClock


def no_library(name):
    raise OSError(f"{name}: cannot open shared object file")


def test_without_any_gl_library_the_error_names_the_packages(monkeypatch):
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setattr("ctypes.CDLL", no_library)
    with pytest.raises(HardwareFailure, match=r"apt-get install libegl1 .*libosmesa6.*libEGL\.so\.1"):
        cameras.create_context(320, 240)


def test_a_chosen_library_leaves_no_other(monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "osmesa")
    monkeypatch.setattr("ctypes.CDLL", no_library)
    with pytest.raises(HardwareFailure, match="libOSMesa") as caught:
        cameras.create_context(320, 240)
    assert "libEGL" not in str(caught.value)


def test_rendering_that_is_switched_off(monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "disable")
    with pytest.raises(HardwareFailure, match="MUJOCO_GL=disable"):
        cameras.create_context(320, 240)


@pytest.mark.gl
def test_virtual_time_waits_for_an_image_that_takes_too_long_for_real_time(monkeypatch):
    monkeypatch.setattr(cameras, "_FRAME_TIMEOUT", 0.0)
    with closing(SimulatedRobot(clock=VirtualClock(), skin=False)) as robot:
        assert robot.capture("Camera", 320, 240).width == 320
