import threading
from contextlib import closing, contextmanager
from types import SimpleNamespace

import pytest

from naoserver.errors import HardwareFailure
from naoserver_sim import cameras
from naoserver_sim.robot import SimulatedRobot
from tests.support.camera_limits import PATIENT_CAMERAS
from tests.support.limits import FOREVER
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim


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


@pytest.mark.gl
@pytest.mark.parametrize(("wish", "said"), [("glfw", ["MUJOCO_GL=glfw is not obeyed"]), ("", [])])
def test_a_wish_for_windows_is_not_obeyed_without_a_word(monkeypatch, caplog, wish, said):
    monkeypatch.setenv("MUJOCO_GL", wish)
    cameras.create_context(32, 24).free()
    warned = [each.message for each in caplog.records if each.levelname == "WARNING"]
    assert [text.partition(":")[0] for text in warned] == said


def test_rendering_that_is_switched_off(monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "disable")
    with pytest.raises(
        HardwareFailure, match="rendering is switched off by MUJOCO_GL=disable: unset it"
    ) as caught:
        cameras.create_context(320, 240)
    assert "apt-get" not in str(caught.value)


def test_a_context_on_which_nothing_can_be_set_up_is_freed(monkeypatch):
    freed = []

    @contextmanager
    def current():
        yield

    def broken(*_):
        raise RuntimeError("no framebuffer")

    context = SimpleNamespace(as_current=current, free=lambda: freed.append("context"))
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setattr(cameras, "create_context", lambda *_: context)
    monkeypatch.setattr("mujoco.MjrContext", broken)
    with (
        closing(SimulatedRobot(clock=VirtualClock(), skin=False)) as robot,
        pytest.raises(HardwareFailure, match="the cameras are off: no framebuffer"),
    ):
        robot.capture("Camera", 320, 240)
    assert freed == ["context"]


def test_without_a_thread_there_are_no_images_and_the_next_one_tries_again(monkeypatch):
    def no_thread(thread):
        raise RuntimeError("can't start new thread")

    monkeypatch.setenv("MUJOCO_GL", "disable")
    with closing(SimulatedRobot(clock=VirtualClock(), skin=False)) as robot:
        with monkeypatch.context() as patch:
            patch.setattr(threading.Thread, "start", no_thread)
            with pytest.raises(HardwareFailure, match="the cameras are off: can't start new thread"):
                robot.capture("Camera", 320, 240)
        with pytest.raises(HardwareFailure, match="switched off by MUJOCO_GL"):
            robot.capture("Camera", 320, 240)


@pytest.mark.gl
def test_an_image_takes_no_longer_than_its_limit_whatever_waits_before_it(monkeypatch):
    with closing(SimulatedRobot(skin=False, camera_limits=PATIENT_CAMERAS)) as robot:
        robot.capture("Camera", 320, 240)
        moments = iter((0.0, FOREVER))  # before and after the wait for a place in the queue
        monkeypatch.setattr(cameras, "time", SimpleNamespace(monotonic=lambda: next(moments)))
        with pytest.raises(HardwareFailure, match="no image of 320x240"):
            robot.capture("Camera", 320, 240)


@pytest.mark.gl
def test_virtual_time_waits_for_an_image_that_takes_too_long_for_real_time():
    limits = cameras.CameraLimits(frame=0.001)  # a place in the queue is there at once
    with closing(SimulatedRobot(clock=VirtualClock(), skin=False, camera_limits=limits)) as robot:
        assert robot.capture("Camera", 320, 240).width == 320
