"""Draw the pictures of this folder: the robot's shell beside its bare blocks, and the worlds that come along.

python docs/pictures/nao/draw.py
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

os.environ.setdefault("MUJOCO_GL", "egl")

import mujoco
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from naoserver.bodies.nao import H25
from naoserver_sim.appearance import VISUAL_GROUP
from naoserver_sim.model import Model, build_model
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.standing import standing
from naoserver_sim.world import load_world
from zenoh_ice import VirtualClock

FOLDER: Final = Path(__file__).parent
SIZE: Final = (400, 560)
BODY: Final = (0.0, 0.0, 0.28)
HEAD: Final = (0.0, 0.0, 0.47)
SIDES: Final = ((180, -8, 1.0, BODY), (218, -10, 1.0, BODY), (95, -6, 1.0, BODY), (325, -10, 1.0, BODY))
PORTRAITS: Final = ((212, -8, 0.42, HEAD), (150, 12, 0.42, HEAD))

Picture = NDArray[np.uint8]


def views(
    model: Model, posture: str, sides: tuple[tuple[float, float, float, tuple[float, ...]], ...]
) -> Picture:
    """Return pictures of the robot side by side, from azimuths, elevations and distances."""
    data = standing(model, H25.postures[posture].angles)
    model.mj.vis.quality.offsamples = 4
    options = mujoco.MjvOption()
    options.geomgroup[:] = 0
    options.geomgroup[[0, VISUAL_GROUP]] = 1
    camera = mujoco.MjvCamera()
    pictures = []
    with mujoco.Renderer(model.mj, SIZE[1], SIZE[0]) as renderer:
        for camera.azimuth, camera.elevation, camera.distance, camera.lookat in sides:
            renderer.update_scene(data, camera, options)
            for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_HAZE):
                renderer.scene.flags[flag] = 0
            pictures.append(renderer.render().copy())
    return np.hstack(pictures)


def world(name: str) -> Picture:
    """Return what the spectator and the robot see of a world."""
    robot = SimulatedRobot(clock=VirtualClock(), world=load_world(name))
    try:
        frames = [robot.capture(camera, 640, 480) for camera in ("CameraOutside", "Camera")]
    finally:
        robot.close()
    return np.hstack([np.asarray(frame.pixels).reshape(480, 640, 3) for frame in frames])


def main() -> None:
    """Write the pictures."""
    empty = load_world("empty")
    shell, blocks = build_model(world=empty), build_model(world=empty, skin=False)
    pictures = {
        "shell.png": views(shell, "StandInit", SIDES),
        "blocks.png": views(blocks, "StandInit", SIDES),
        "head.png": views(shell, "Stand", PORTRAITS),
        "soccer.png": world("soccer"),
        "room.png": world("room"),
    }
    for name, picture in pictures.items():
        Image.fromarray(picture).quantize(256).save(FOLDER / name, optimize=True)


if __name__ == "__main__":
    main()
