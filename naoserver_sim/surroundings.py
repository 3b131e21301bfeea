"""A world in the model: floor or soccer field, walls, boxes, balls, and the spectator's camera.

The light, the chequered floor, and the classes that say what touches what stand in scene.xml.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.robot import CameraFacts
from naoserver_sim.body import add_camera, add_motor
from naoserver_sim.signs import add_picture, add_sign
from naoserver_sim.world import BALL_RADIUS, Box, CarriedBall, Field, Light, World

SPECTATOR: Final = CameraFacts(
    name="CameraOutside",
    position=(1.15, -1.6, 0.75),
    tilt=0.2,
    horizontal_fov=math.radians(48),
    sizes=((320, 240), (640, 480), (1280, 960)),
    rates=(30.0, 30.0, 15.0),
)
"""A spectator in front of the robot's place and to its right; sees it and the balls."""
_SPECTATOR_YAW: Final = math.radians(113)
_FLOOR_HALF: Final = 6.0
_SOFT: Final = (0.005, 1.0)
"""Time constant in s and damping ratio of a contact."""
_BOX: Final = mujoco.mjtGeom.mjGEOM_BOX
_SHINE: Final = 0.5
"""Highlights as a share of the light that causes them."""
_SUN_DISTANCE: Final = 12.0
"""Metres from the origin to where the shadows of sunlight are computed: more than any floor reaches."""
_LAMP_CUTOFF: Final = 80.0
"""Degrees from its direction to which a lamp shines."""
_SHADOW_PIXELS: Final = 1024
"""Side of the map of shadows: on a floor of 12 m a pixel is 12 mm."""


def add_surroundings(spec: mujoco.MjSpec, world: World) -> None:
    """Add what stands firm."""
    firm, field = spec.find_default("firm"), world.field
    half = (_FLOOR_HALF, _FLOOR_HALF)
    if field is not None:
        half = (field.length / 2 + field.border, field.width / 2 + field.border)
        add_picture(spec, "field", draw_field(field))
    material = "floor" if field is None else "field"
    plane = mujoco.mjtGeom.mjGEOM_PLANE
    spec.worldbody.add_geom(firm, name="floor", type=plane, size=[*half, 0.1], material=material)
    if field is not None:
        _add_goals(spec, field)
    for wall in world.walls:
        (x0, y0), (x1, y1) = wall.begin, wall.end
        # Longer by its thickness, so that walls which end at one point close the corner.
        length = math.dist(wall.begin, wall.end) + wall.thickness
        spec.worldbody.add_geom(
            firm,
            type=_BOX,
            size=[length / 2, wall.thickness / 2, wall.height / 2],
            pos=[(x0 + x1) / 2, (y0 + y1) / 2, wall.height / 2],
            quat=about_z(math.atan2(y1 - y0, x1 - x0)),
            rgba=[*wall.color, 1],
        )
    for box in world.boxes:
        if box.mass is None:
            _add_box(spec, box)
    for number, sign in enumerate(world.signs, 1):
        add_sign(spec, sign, f"sign{number}")
    if world.light is not None:
        _set_light(spec, world.light, max(half))


def _set_light(spec: mujoco.MjSpec, light: Light, reach: float) -> None:
    """Replace the light of the scene; shadows reach as far from the origin as the floor, `reach` in m."""
    color = np.array(light.color)
    source, head = spec.worldbody.lights[0], spec.visual.headlight
    source.diffuse = light.brightness * color
    source.specular = _SHINE * source.diffuse
    head.ambient, head.diffuse, head.specular = light.ambient * color, np.zeros(3), np.zeros(3)
    source.dir = np.array(light.direction) / math.hypot(*light.direction)
    source.pos = -_SUN_DISTANCE * source.dir
    if light.position is not None:
        source.type, source.pos = mujoco.mjtLightType.mjLIGHT_SPOT, light.position
        source.cutoff, source.exponent = _LAMP_CUTOFF, 0.0
    # The sky shines by itself; it is as bright as what the light falls on.
    sky, shining = spec.texture("sky"), np.minimum((light.ambient + light.brightness) * color, 1.0)
    sky.rgb1, sky.rgb2 = sky.rgb1 * shining, sky.rgb2 * shining
    if light.shadows:
        source.castshadow = True
        spec.visual.quality.shadowsize = _SHADOW_PIXELS
        spec.visual.map.shadowclip, spec.visual.map.shadowscale = reach, 1.0


def add_movables(spec: mujoco.MjSpec, world: World) -> None:
    """Add what moves, and the spectator: after the robot, which stands first in all arrays."""
    start = spec.worldbody.add_body(
        name="start", pos=[*world.robot.position, 0.0], quat=about_z(world.robot.heading)
    )
    add_camera(start, SPECTATOR, _SPECTATOR_YAW)
    sphere = mujoco.mjtGeom.mjGEOM_SPHERE
    for carried in world.carried_balls:
        carrier = _add_carrier(spec, start, carried)
        seen = spec.find_default("seen")
        carrier.add_geom(seen, type=sphere, size=[BALL_RADIUS, 0, 0], rgba=[*carried.color, 1])
    for ball in world.balls:
        body = spec.worldbody.add_body(name=ball.name, pos=[*ball.position, ball.radius])
        body.add_freejoint(name=ball.name)
        kind, size = spec.find_default("ball"), [ball.radius, 0, 0]
        body.add_geom(kind, type=sphere, size=size, rgba=[*ball.color, 1], mass=ball.mass)
    for box in world.boxes:
        if box.mass is not None:
            _add_box(spec, box)


def _add_carrier(spec: mujoco.MjSpec, start: mujoco.MjsBody, ball: CarriedBall) -> mujoco.MjsBody:
    """Add the mechanism that carries a ball round the robot's start."""
    carrier = start.add_body(
        name=ball.name, gravcomp=1, explicitinertial=True, mass=0.001, inertia=[1e-6] * 3
    )
    hinge, slide = mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE
    axes = ((hinge, [0, 0, 1]), (slide, [1, 0, 0]), (slide, [0, 0, 1]))
    for joint, (kind, axis) in zip(ball.joints, axes, strict=True):
        default, limits = spec.find_default("carrier"), [joint.lower, joint.upper]
        carrier.add_joint(default, name=joint.name, type=kind, axis=axis, range=limits)
        add_motor(spec, joint, "carrier")
    return carrier


def about_z(angle: float) -> tuple[float, float, float, float]:
    """Return the quaternion (w, x, y, z) of a turn to the left."""
    return math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2)


def _add_box(spec: mujoco.MjSpec, box: Box) -> None:
    half = [side / 2 for side in box.size]
    body = spec.worldbody.add_body(name=box.name, pos=[*box.position, half[2]], quat=about_z(box.heading))
    kind = spec.find_default("firm" if box.mass is None else "moving")
    if box.mass is not None:
        body.add_freejoint(name=box.name)
    body.add_geom(kind, type=_BOX, size=half, rgba=[*box.color, 1], mass=box.mass or 0.0, solref=_SOFT)


# -- a soccer field ------------------------------------------------------------------------------------------

_METRE: Final = 100
"""Pixels in a metre of the texture at most."""
_LARGEST: Final = 1536
"""Pixels along the longer side of the texture at most."""
_MARK: Final = 0.10
_POST_RADIUS: Final = 0.05
_NET: Final = (0.80, 0.82, 0.84, 0.35)
_NET_THICKNESS: Final = 0.01
WHITE: Final = (0.96, 0.96, 0.96)


def field_lines(field: Field) -> Iterator[tuple[tuple[float, float], tuple[float, float]]]:
    """Yield the center and the half sides of each straight line in the quarter x >= 0, y >= 0 of a field.

    Mirrored at both axes they are all; lines that cross an axis reach as far beyond it.
    """
    half, end = field.line / 2, field.length / 2
    # The halfway line and the outline, then both areas before the goal.
    yield (0.0, 0.0), (half, field.width / 2)
    yield (0.0, field.width / 2), (end + half, half)
    yield (end, 0.0), (half, field.width / 2 + half)
    for depth, breadth in (field.penalty_area, field.goal_area):
        yield (end - depth / 2, breadth / 2), (depth / 2 + half, half)
        yield (end - depth, 0.0), (half, breadth / 2 + half)
    for mark in (0.0, end - field.penalty_mark):
        yield (mark, 0.0), (_MARK / 2, half)
        yield (mark, 0.0), (half, _MARK / 2)


def draw_field(field: Field) -> NDArray[np.uint8]:
    """Return a picture of the field with its border: rows from +y to -y, columns from -x to +x, RGB."""
    size = (field.length + 2 * field.border, field.width + 2 * field.border)
    scale = min(_METRE, _LARGEST / max(size))
    width, height = (round(scale * side) for side in size)
    x = (np.arange(width) + 0.5) / scale - size[0] / 2
    y = size[1] / 2 - (np.arange(height) + 0.5) / scale
    x, y = np.meshgrid(np.abs(x), np.abs(y))  # everything is there twice, mirrored
    # The share of a pixel that is white: how far it lies within a line, in pixels.
    white = np.zeros((height, width))

    def paint(distance: NDArray[np.float64]) -> None:
        """Paint where a distance in m to what is to be white is negative."""
        np.maximum(white, np.clip(0.5 - distance * scale, 0.0, 1.0), out=white)

    for (at_x, at_y), (half_x, half_y) in field_lines(field):
        paint(np.maximum(np.abs(x - at_x) - half_x, np.abs(y - at_y) - half_y))
    paint(np.abs(np.hypot(x, y) - field.circle_diameter / 2) - field.line / 2)
    grass = np.array(field.grass) * (1.0 + 0.04 * np.sign(np.sin(x * math.pi / 0.5)))[..., None]
    colors = grass + white[..., None] * (np.array(WHITE) - grass)
    return np.asarray(np.round(255 * np.clip(colors, 0, 1)), dtype=np.uint8)


def _add_goals(spec: mujoco.MjSpec, field: Field) -> None:
    firm, add = spec.find_default("firm"), spec.worldbody.add_geom
    bar, radius = mujoco.mjtGeom.mjGEOM_CAPSULE, [_POST_RADIUS, 0, 0]
    reach, top, depth = field.goal_width / 2 + _POST_RADIUS, field.goal_height, field.goal_depth
    for side in (-1, 1):
        line = side * field.length / 2
        back = line + side * depth
        for begin, end in (
            ((line, reach, 0.0), (line, reach, top)),
            ((line, -reach, 0.0), (line, -reach, top)),
            ((line, reach, top), (line, -reach, top)),
        ):
            add(firm, type=bar, size=radius, fromto=[*begin, *end], rgba=[*WHITE, 1])
        for center, half in (
            ((back, 0.0), (_NET_THICKNESS, reach)),
            (((line + back) / 2, reach), (depth / 2, _NET_THICKNESS)),
            (((line + back) / 2, -reach), (depth / 2, _NET_THICKNESS)),
        ):
            add(firm, type=_BOX, size=[*half, top / 2], pos=[*center, top / 2], rgba=_NET)
