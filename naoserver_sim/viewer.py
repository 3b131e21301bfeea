"""MuJoCo's own window on the running simulation."""

from __future__ import annotations

import importlib
import os
from collections.abc import Callable
from typing import Final

import mujoco

from naoserver.errors import HardwareFailure
from naoserver_sim.cameras import put_cameras
from naoserver_sim.simulator import Snapshot

_FRAME_INTERVAL: Final = 1 / 30


def check_display() -> None:
    """Raise HardwareFailure when there is no display to open a window on."""
    if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise HardwareFailure(
            "there is no display to open a window on: run with --headless and watch the stream of"
            " CameraOutside, or set DISPLAY"
        )


def show(
    mj: mujoco.MjModel,
    newest: Callable[[], Snapshot],
    shine: Callable[[], None],
    ended: Callable[[float], bool],
) -> None:
    """Show the newest snapshots in a window until it is closed or `ended` says so.

    `shine` lets the lamps look as they are now. `ended` waits at most the given seconds for the end and
    returns whether it has come. To be called from the main thread. The window shows a copy: what is pushed
    about in it does not reach the simulation.

    Raises HardwareFailure when the window cannot be opened.
    """
    check_display()
    data = mujoco.MjData(mj)
    try:
        window = importlib.import_module("mujoco.viewer").launch_passive(
            mj, data, show_left_ui=False, show_right_ui=False
        )
    except (ImportError, RuntimeError, mujoco.FatalError) as error:
        raise HardwareFailure(f"the window cannot be opened: {error}") from error
    with window:
        # From the front and the right, on the robot and the space in which the balls move.
        window.cam.lookat[:] = (0.4, 0.0, 0.3)
        window.cam.distance, window.cam.azimuth, window.cam.elevation = 2.2, 135.0, -15.0
        while window.is_running() and not ended(_FRAME_INTERVAL):
            snapshot = newest()
            with window.lock():
                shine()
                data.time = snapshot.time
                put_cameras(mj, data, snapshot.qpos)
            window.sync()
