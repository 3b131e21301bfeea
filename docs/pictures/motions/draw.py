"""Draw the pictures of this folder: motions in the simulation's physics, a row of pictures each.

python docs/pictures/motions/draw.py
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Final

os.environ.setdefault("MUJOCO_GL", "egl")
sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

import mujoco
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from naoserver_sim.appearance import VISUAL_GROUP
from naoserver_sim.model import Model, build_model
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from tests.support.motion_rig import MOTIONS, MotionRig
from zenoh_ice import VirtualClock

FOLDER: Final = Path(__file__).parent
MOTIONS_SHOWN: Final = (
    "stand_up_from_belly",
    "sit_up",
    "stand_up_from_sit",
    "sit_down",
    "kick",
    "wave",
    "dance",
)
PICTURES: Final = 8
SIZE: Final = (220, 260)
VIEW: Final = {"azimuth": 235.0, "elevation": -14.0, "distance": 1.15}
HEIGHT: Final = 0.22
"""Height in m of what the camera looks at."""


class Pictures:
    """A camera that goes along with the robot."""

    def __init__(self, model: Model) -> None:
        self._model = model
        self._data = mujoco.MjData(model.mj)
        self._renderer = mujoco.Renderer(model.mj, SIZE[1], SIZE[0])
        self._options = mujoco.MjvOption()
        self._options.geomgroup[:] = 0
        self._options.geomgroup[[0, VISUAL_GROUP]] = 1
        self._camera = mujoco.MjvCamera()
        for name, value in VIEW.items():
            setattr(self._camera, name, value)

    def take(self, robot: SimulatedRobot) -> NDArray[np.uint8]:
        """Return a picture of the robot where it is."""
        torso, data, base = robot.stage.truth().torso, self._data, self._model.base.qpos
        data.qpos[base : base + 7] = (*torso.position, *torso.orientation)
        data.qpos[self._model.robot.qpos] = robot.read().positions
        mujoco.mj_forward(self._model.mj, data)
        self._camera.lookat = (torso.position[0], torso.position[1], HEIGHT)
        self._renderer.update_scene(data, self._camera, self._options)
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_HAZE):
            self._renderer.scene.flags[flag] = 0
        picture: NDArray[np.uint8] = self._renderer.render().copy()
        return picture


def row(pictures: Pictures, name: str) -> NDArray[np.uint8]:
    """Play a motion, and return pictures of it side by side."""
    clock, motion = VirtualClock(), MOTIONS[name]
    rig = MotionRig(SimulatedRobot(clock=clock, world=load_world("empty"), skin=False), clock)
    rig.let_go(0.5)
    if motion.start:
        rig.go(motion.start)
    rig.begin(name)
    begun, taken = clock.now(), []
    for number in range(PICTURES):
        while clock.now() - begun < motion.duration * number / (PICTURES - 1):
            rig.let_go(0.02)
        taken.append(pictures.take(rig.robot))
    return np.hstack(taken)


def main() -> None:
    """Write the pictures."""
    model = build_model(world=load_world("empty"))
    model.mj.vis.quality.offsamples = 4
    pictures = Pictures(model)
    for name in MOTIONS_SHOWN:
        Image.fromarray(row(pictures, name)).quantize(64).save(FOLDER / f"{name}.png", optimize=True)


if __name__ == "__main__":
    main()
