"""Draw the pictures of this folder, and those of the editor's start page: robots from several sides, in
motion, side by side on one scale, while they run a behavior, and cut out.

python docs/pictures/robots/draw.py
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final, NamedTuple

os.environ.setdefault("MUJOCO_GL", "egl")

import mujoco
import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray
from PIL import Image

from naoserver.bodies import find_body
from naoserver.bodies.capabilities import Pose as Placed
from naoserver.bodies.capabilities import Vector
from naoserver.bodies.parts import Axis
from naoserver.body import Body
from naoserver_sim.appearance import VISUAL_GROUP
from naoserver_sim.model import FreeIndex, Model, build_model
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.standing import standing
from naoserver_sim.world import StartPose, World, load_world
from visualhfsm.simulation import RobotUnderTest, simulate

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


class Kick(NamedTuple):
    """A robot that plays football: its picture is the one when the ball has begun to roll."""

    body: str
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
KICKS: Final = (
    Kick("H25", Frame(0.25, 1.5)),
    Kick("T1", Frame(0.5, 2.7)),
    Kick("G1", Frame(0.55, 2.9)),
)
ROLLED: Final = 0.12
"""How far in m the ball has rolled then."""
FROM_BALLS: Final = Side(162.0, -10.0)
FRONT: Final = Side(180.0, -8.0)
BESIDE: Final = Side(150.0, -12.0)
HALF_LEFT: Final = Side(218.0, -10.0)
BEHIND: Final = Side(325.0, -10.0)
FAMILY: Final = ("Cart", "H25", "T1", "G1")
CARDS: Final = (*FAMILY, "H21")
"""Robots that the start page of the editor shows."""
CARD_FOLDER: Final = FOLDER.parents[2] / "visualhfsm/_editor/static/pictures"
CUT_OUT: Final = 144
"""Width and height of a card's picture in pixels."""
CUT_OUT_DRAWN: Final = 900
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
        return seen(run.robot, load_world("empty"), shown.frame, FROM_BALLS)
    finally:
        run.close()


def kick(shown: Kick) -> NDArray[np.uint8]:
    """Return a robot whose ball has begun to roll."""
    soccer = load_world("soccer")
    world = replace(soccer, balls=(replace(soccer.balls[0], position=(0.6, 0.1)),), robot=StartPose())
    run = simulate(
        DOCUMENTS / "score.xml",
        robot="sim",
        body=shown.body,
        world=world,
        camera="rendered",
        seed=2,
        noise=True,
        parameters={"start_x": 0.0},
    )
    try:
        run.run_until("kick", limit=60.0)
        lies = ball_of(run.robot)
        run.run_until(lambda: math.dist(ball_of(run.robot), lies) > ROLLED, limit=10.0)
        return seen(run.robot, world, shown.frame, BESIDE)
    finally:
        run.close()


def ball_of(robot: RobotUnderTest) -> Vector:
    """Return where the ball of a soccer field is."""
    assert robot.device.stage is not None
    return robot.device.stage.truth().objects["Ball"].position


def seen(robot: RobotUnderTest, world: World, frame: Frame, side: Side) -> NDArray[np.uint8]:
    """Return a simulated robot and the balls of its world as they are now."""
    assert isinstance(robot.device, SimulatedRobot)
    truth = robot.device.stage.truth()
    model = build_model(world=world, body=robot.device.body)
    data = mujoco.MjData(model.mj)
    put(data, model.base, truth.torso)
    for name, index in model.loose.items():
        put(data, index, truth.objects[name])
    data.qpos[model.robot.qpos] = [robot.joints[joint.name] for joint in model.robot.joints]
    mujoco.mj_forward(model.mj, data)
    middle = np.mean([truth.torso.position, *(truth.objects[name].position for name in model.loose)], axis=0)
    return view(model, data, frame, side, (middle[0], middle[1]))


def put(data: mujoco.MjData, index: FreeIndex, pose: Placed) -> None:
    """Put something where it is."""
    data.qpos[index.qpos : index.qpos + 7] = *pose.position, *pose.orientation


def posed(model: Model, pose: Pose) -> mujoco.MjData:
    """Return the robot on its feet in a pose."""
    return standing(model, angles(model.body, pose))


def view(
    model: Model, data: mujoco.MjData, frame: Frame, side: Side, at: tuple[float, float] = (0.0, 0.0)
) -> NDArray[np.uint8]:
    """Return what is at a place on the floor, such as the robot, from a side."""
    model.mj.vis.quality.offsamples = 4
    options = mujoco.MjvOption()
    options.geomgroup[:] = 0
    options.geomgroup[[0, VISUAL_GROUP]] = 1
    camera = mujoco.MjvCamera()
    camera.azimuth, camera.elevation = side
    camera.distance, camera.lookat = frame.distance, (*at, frame.height)
    with mujoco.Renderer(model.mj, SCALE * SIZE[1], SCALE * SIZE[0]) as renderer:
        renderer.update_scene(data, camera, options)
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_HAZE):
            renderer.scene.flags[flag] = 0
        image = Image.fromarray(renderer.render())
    return np.asarray(image.resize(SIZE, Image.Resampling.LANCZOS))


def cut_out(model: Model) -> Image.Image:
    """Return a robot at rest without anything around it, as large as fits."""
    data, camera, options = posed(model, {}), mujoco.MjvCamera(), mujoco.MjvOption()
    options.geomgroup[:] = 0
    options.geomgroup[VISUAL_GROUP] = 1
    model.mj.vis.quality.offsamples = 4
    camera.azimuth, camera.elevation = HALF_LEFT
    camera.lookat, camera.distance = (0.0, 0.0, 0.6), 2.4
    with mujoco.Renderer(model.mj, CUT_OUT_DRAWN, CUT_OUT_DRAWN) as renderer:
        renderer.update_scene(data, camera, options)
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_HAZE):
            renderer.scene.flags[flag] = 0
        colors = renderer.render()
        renderer.enable_segmentation_rendering()
        renderer.update_scene(data, camera, options)
        mask = (renderer.render()[..., 0] >= 0).astype(np.uint8) * 255
    image = Image.fromarray(np.dstack([colors, mask]))
    image = image.crop(image.getbbox())
    scale = CUT_OUT / max(image.size)
    size = round(image.width * scale), round(image.height * scale)
    whole = Image.new("RGBA", (CUT_OUT, CUT_OUT))
    # Its edge is blended with nothing, so that it is the same on a dark page.
    small = image.convert("RGBa").resize(size, Image.Resampling.LANCZOS).convert("RGBA")
    whole.paste(small, ((CUT_OUT - size[0]) // 2, CUT_OUT - size[1]))
    return whole


def save(name: str, row: Sequence[NDArray[np.uint8]]) -> None:
    """Write views side by side."""
    Image.fromarray(np.hstack(row)).quantize(256).save(FOLDER / f"{name}.png", optimize=True)


def main() -> None:
    """Write the pictures."""
    models = {name: build_model(world=load_world("empty"), body=find_body(name)) for name in CARDS}
    for name, model in models.items():
        cut_out(model).save(CARD_FOLDER / f"{name}.webp", quality=80, method=6)
    save(
        "family",
        [view(model, posed(model, {}), FAMILY_FRAME, HALF_LEFT) for model in map(models.__getitem__, FAMILY)],
    )
    for name, (body, frame, pose) in PICTURES.items():
        model = models[body]
        row = [view(model, posed(model, {}), frame, side) for side in (FRONT, HALF_LEFT, BEHIND)]
        save(name, [*row, view(model, posed(model, pose), frame, HALF_LEFT)])
    save("behaviors", [scene(shown) for shown in SCENES])
    save("football", [kick(shown) for shown in KICKS])


if __name__ == "__main__":
    main()
