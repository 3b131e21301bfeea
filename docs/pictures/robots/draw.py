"""Draw the pictures of this folder: robots from several sides and in motion, side by side on one scale, and
while they run a behavior.

python docs/pictures/robots/draw.py
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final, NamedTuple

os.environ.setdefault("MUJOCO_GL", "egl")

import mujoco
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from naoserver.bodies import find_body
from naoserver.body import Body
from naoserver.parts import Axis
from naoserver_sim.appearance import VISUAL_GROUP
from naoserver_sim.model import Model, build_model, standing
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from visualhfsm.simulation import simulate

FOLDER: Final = Path(__file__).parent
DOCUMENTS: Final = FOLDER.parents[2] / "behaviors"
SIZE: Final = (160, 300)
"""Width and height in pixels of a view."""
SCALE: Final = 2
"""Pixels drawn for each pixel of a picture, along a side."""

Pose = Mapping[tuple[str, Axis], float]
"""Angles in rad of some axes of hinges; the others rest."""
WAVE: Final[Pose] = {
    ("LeftShoulder", Axis.TILT): -1.2,
    ("LeftShoulder", Axis.ROLL): 0.4,
    ("LeftElbow", Axis.ROLL): -0.7,
    ("Neck", Axis.PAN): 0.4,
}
LOOK: Final[Pose] = {("Neck", Axis.PAN): -0.6, ("Neck", Axis.TILT): 0.3}


class Side(NamedTuple):
    """Where a robot is seen from, in degrees."""

    azimuth: float
    elevation: float


class Frame(NamedTuple):
    """What is in the picture, in m."""

    height: float
    """Height of the place at which the camera looks."""
    distance: float


class Picture(NamedTuple):
    """What is drawn of a robot: at rest from three sides, and then in a pose."""

    body: str
    frame: Frame
    pose: Pose


class Scene(NamedTuple):
    """A robot that runs a behavior: its picture is the one after some seconds."""

    body: str
    document: str
    seconds: float
    frame: Frame


PICTURES: Final = {
    "booster_t1": Picture("T1", Frame(0.62, 2.1), WAVE),
    "unitree_g1": Picture("G1", Frame(0.69, 2.3), WAVE),
    "cart": Picture("Cart", Frame(0.2, 0.95), LOOK),
}
SCENES: Final = (
    Scene("H25", "dance_and_follow", 15.0, Frame(0.3, 1.5)),
    Scene("T1", "dance_and_follow", 15.0, Frame(0.6, 2.6)),
    Scene("G1", "dance_and_follow", 15.0, Frame(0.64, 2.8)),
    Scene("Cart", "follow_ball", 6.0, Frame(0.25, 1.2)),
)
FROM_BALLS: Final = Side(162.0, -10.0)
FRONT: Final = Side(180.0, -8.0)
HALF_LEFT: Final = Side(218.0, -10.0)
BEHIND: Final = Side(325.0, -10.0)
FAMILY: Final = ("Cart", "H25", "T1", "G1")
FAMILY_FRAME: Final = Frame(0.6, 2.2)


def angles(body: Body, pose: Pose) -> dict[str, float]:
    """Return the angles of all joints in a pose."""
    posed = dict(body.resting_angles)
    for (hinge, axis), angle in pose.items():
        known = body.hinge(hinge)
        if known is not None and axis in known.axes:
            posed[known.axes[axis].joint] = known.axes[axis].joint_angle(angle)
    return posed


def scene(shown: Scene) -> NDArray[np.uint8]:
    """Return a robot while it runs a behavior, as it stands then."""
    run = simulate(DOCUMENTS / f"{shown.document}.xml", robot="sim", body=shown.body)
    try:
        run.advance(shown.seconds)
        assert isinstance(run.robot.device, SimulatedRobot)
        torso = run.robot.device.stage.truth().torso
        joints = run.robot.joints
    finally:
        run.close()
    model = build_model(world=load_world("empty"), body=find_body(shown.body))
    data = mujoco.MjData(model.mj)
    root = model.mj.body(model.body.root.name).jntadr[0]
    at = model.mj.jnt_qposadr[root]
    data.qpos[at : at + 7] = *torso.position, *torso.orientation
    data.qpos[model.robot.qpos] = [joints[joint.name] for joint in model.robot.joints]
    mujoco.mj_forward(model.mj, data)
    return view(model, data, shown.frame, FROM_BALLS)


def posed(model: Model, pose: Pose) -> mujoco.MjData:
    """Return the robot on its feet in a pose."""
    return standing(model, angles(model.body, pose))


def view(model: Model, data: mujoco.MjData, frame: Frame, side: Side) -> NDArray[np.uint8]:
    """Return the robot from a side."""
    model.mj.vis.quality.offsamples = 4
    options = mujoco.MjvOption()
    options.geomgroup[:] = 0
    options.geomgroup[[0, VISUAL_GROUP]] = 1
    camera = mujoco.MjvCamera()
    camera.azimuth, camera.elevation = side
    camera.distance, camera.lookat = frame.distance, (0.0, 0.0, frame.height)
    with mujoco.Renderer(model.mj, SCALE * SIZE[1], SCALE * SIZE[0]) as renderer:
        renderer.update_scene(data, camera, options)
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_HAZE):
            renderer.scene.flags[flag] = 0
        image = Image.fromarray(renderer.render())
    return np.asarray(image.resize(SIZE, Image.Resampling.LANCZOS))


def save(name: str, row: Sequence[NDArray[np.uint8]]) -> None:
    """Write views side by side."""
    Image.fromarray(np.hstack(row)).quantize(256).save(FOLDER / f"{name}.png", optimize=True)


def main() -> None:
    """Write the pictures."""
    models = {name: build_model(world=load_world("empty"), body=find_body(name)) for name in FAMILY}
    save("family", [view(model, posed(model, {}), FAMILY_FRAME, HALF_LEFT) for model in models.values()])
    for name, (body, frame, pose) in PICTURES.items():
        model = models[body]
        row = [view(model, posed(model, {}), frame, side) for side in (FRONT, HALF_LEFT, BEHIND)]
        save(name, [*row, view(model, posed(model, pose), frame, HALF_LEFT)])
    save("behaviors", [scene(shown) for shown in SCENES])


if __name__ == "__main__":
    main()
