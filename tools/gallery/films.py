"""Film a run in virtual time: small moving pictures, with the states that the robot is in below them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any, Final, NamedTuple

os.environ.setdefault("MUJOCO_GL", "egl")

import mujoco
import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont, ImageSequence

from naoserver.bodies.capabilities import Color
from naoserver_sim.appearance import VISUAL_GROUP, Lamps
from naoserver_sim.model import Model, build_model
from naoserver_sim.world import StartPose, World, load_world
from tools.gallery.scenes import ROOT, Scene
from visualhfsm.simulation import Behavior, Team, simulate, simulate_team

SIZE: Final = (260, 195)
"""Width and height in pixels."""
RATE: Final = 8.0
"""Pictures per second."""
LAST: Final = 1.2
"""Seconds for which the last picture stays."""
QUALITY: Final = 45
_LONGEST_RUN: Final = 120.0  # s
_CAPTION: Final = 17


class Moment(NamedTuple):
    """What a picture is made of: the places of everything, the lights, the states, and the middle in m."""

    qpos: NDArray[np.float64]
    lights: dict[str, Color]
    states: str
    middle: tuple[float, float]


def film(scene: Scene, document: Path) -> list[Image.Image]:
    """Return the pictures of a scene."""
    world = _world(scene)
    with closing(_run(scene, document, world)) as running:
        run = running if isinstance(running, Behavior) else running.behaviors[0]
        device: Any = run.robot.device
        model = device._model if scene.others else build_model(world=world, body=device.body)
        moments = list(_moments(scene, run, model, running.advance))
    return list(_pictures(scene, model, moments))


def write(pictures: list[Image.Image], path: Path, *, rate: float = RATE, quality: int = QUALITY) -> None:
    """Write a moving picture, which begins again after a rest."""
    pause = round(1000.0 / rate)
    durations = [pause] * (len(pictures) - 1) + [round(1000.0 * LAST)]
    first, *others = pictures
    first.save(
        path, save_all=True, append_images=others, duration=durations, loop=0, quality=quality, method=6
    )


def beside(films: list[Path], path: Path) -> None:
    """Write films side by side, which end together."""
    opened = [[frame.copy() for frame in ImageSequence.Iterator(Image.open(each))] for each in films]
    count = min(map(len, opened))
    pictures = []
    for together in zip(*(each[-count:] for each in opened), strict=True):
        row = Image.new("RGB", (len(together) * SIZE[0], SIZE[1]))
        for place, picture in enumerate(together):
            row.paste(picture, (place * SIZE[0], 0))
        pictures.append(row)
    write(pictures, path)


def caption(picture: Image.Image, text: str) -> Image.Image:
    """Return a picture with a line of text at its foot."""
    drawn = ImageDraw.Draw(picture, "RGBA")
    width, height = picture.size
    drawn.rectangle((0, height - _CAPTION, width, height), fill=(16, 21, 28, 190))
    font = ImageFont.load_default(12)
    drawn.text((5, height - _CAPTION + 1), text, font=font, fill=(240, 244, 248))
    return picture


def _world(scene: Scene) -> World:
    world = load_world(scene.world)
    if world.robots:
        first, *others = world.robots
        world = replace(world, robots=(replace(first, position=scene.robot), *others))
    else:
        world = replace(world, robot=StartPose(position=scene.robot))
    if scene.ball is not None:
        world = replace(world, balls=(replace(world.balls[0], position=scene.ball),))
    return world


def _run(scene: Scene, document: Path, world: World) -> Behavior | Team:
    parameters = dict(scene.parameters)
    if scene.others:
        documents = [document, *(ROOT / each for each in scene.others)]
        each = [parameters, *({} for _ in scene.others)]
        return simulate_team(documents, world=world, camera="rendered", seed=scene.seed, parameters=each)
    is_match = scene.world == "soccer"
    return simulate(
        document,
        robot="sim",
        body=scene.body,
        world=world,
        camera="rendered" if is_match else "drawn",
        seed=scene.seed,
        noise=is_match,
        posture=scene.posture,
        parameters=parameters,
        stand_ins=True,
    )


def _moments(
    scene: Scene, run: Behavior, model: Model, advance: Callable[[float], object]
) -> Iterator[Moment]:
    """Yield what is shown, from the run."""
    if scene.values:
        run.set(1, **scene.values)
    acts = sorted(scene.acts.items())
    step, now, shown = scene.faster / RATE, 0.0, []
    ends = scene.skip + scene.seconds if not scene.until else _LONGEST_RUN
    while now <= ends:
        while acts and acts[0][0] <= now:
            acts.pop(0)[1](run)
        if now >= scene.skip:
            shown.append(_moment(run, model))
        if scene.until and ends == _LONGEST_RUN and run.is_active(scene.until):
            ends = now + scene.after
        advance(step)
        now += step
    if scene.until and ends == _LONGEST_RUN:
        raise SystemExit(f"{run.document}: it is not {scene.until} after {_LONGEST_RUN:g} s")
    yield from shown[-round(scene.seconds / step) :]


def _moment(run: Behavior, model: Model) -> Moment:
    device: Any = run.robot.device  # a simulated one, perhaps behind one with drawn images
    truth = device.stage.truth()
    qpos = np.array(model.whole.qpos0)
    for index, place in (
        (model.base, truth.torso),
        *((index, truth.objects[name]) for name, index in model.loose.items()),
    ):
        qpos[index.qpos : index.qpos + 7] = *place.position, *place.orientation
    qpos[model.robot.qpos] = [run.robot.joints[joint.name] for joint in model.robot.joints]
    if model.others:  # all robots
        qpos = device._simulator.newest().whole_qpos.copy()
    for name, carrier in model.balls.items():
        qpos[carrier.qpos] = run.robot.ball(name).position
    places = [truth.torso.position, *(truth.objects[name].position for name in model.loose)]
    x, y, _ = np.mean(places, axis=0)
    return Moment(qpos, dict(device.lights.colors()), run.active, (x, y))


def _pictures(scene: Scene, model: Model, moments: list[Moment]) -> Iterator[Image.Image]:
    mj = model.whole
    data = mujoco.MjData(mj)
    mj.vis.quality.offsamples = 4
    options = mujoco.MjvOption()
    options.geomgroup[:] = 0
    options.geomgroup[[0, VISUAL_GROUP]] = 1
    camera = mujoco.MjvCamera()
    camera.azimuth, camera.elevation = scene.side
    camera.distance = scene.distance
    middle = np.mean([each.middle for each in moments], axis=0)
    camera.lookat = (*middle, scene.height)
    lights: dict[str, Color] = {}
    lamps = Lamps(mj, lambda: dict(lights))
    with mujoco.Renderer(mj, 2 * SIZE[1], 2 * SIZE[0]) as renderer:
        for each in moments:
            lights.update(each.lights)
            lamps.show()
            data.qpos[:] = each.qpos
            mujoco.mj_kinematics(mj, data)
            mujoco.mj_camlight(mj, data)
            renderer.update_scene(data, camera, options)
            picture = Image.fromarray(renderer.render()).resize(SIZE, Image.Resampling.LANCZOS)
            yield caption(picture, each.states)
