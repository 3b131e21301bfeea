"""A world in the model: floor or soccer field, walls, boxes, balls, signs, and the spectator's camera.

The light, the chequered floor and the collision classes are in scene.xml. Signs are boards with a picture on
them: landmarks with a number, and faces.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Final

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.bodies.parts import CameraFacts
from naoserver.errors import RobotError
from naoserver.soccer_field import POST_RADIUS, Field
from naoserver_sim._body import add_camera, add_motor
from naoserver_sim.world import BALL_RADIUS, Box, CarriedBall, Light, Sign, World
from zenoh_ice.application import missing_package

START: Final = "start"
"""The body at the place where the robot starts."""
SPECTATOR: Final = CameraFacts(
    name="CameraOutside",
    position=(1.15, -1.6, 0.75),
    tilt=0.2,
    horizontal_fov=math.radians(48),
    sizes=((320, 240), (640, 480), (1280, 960)),
    rates=(30.0, 30.0, 15.0),
)
"""A spectator in front of the robot's place and to its right; sees it and the balls."""
SPECTATOR_YAW: Final = math.radians(113)
_FRAMED_HEIGHT: Final = 0.8
"""Height in m of the tallest robot that the spectator sees whole from there."""
_FLOOR_HALF: Final = 6.0
_SOFT: Final = (0.005, 1.0)
"""Time constant in s and damping ratio of a contact."""
_BOX: Final = mujoco.mjtGeom.mjGEOM_BOX
_SHINE: Final = 0.5
"""Highlights as a share of the light that causes them."""
_SUN_DISTANCE: Final = 12.0
"""Metres from the origin to where the shadows of sunlight are computed: more than any floor reaches."""
_LAMP_CUTOFF: Final = 80.0
"""Angle in degrees from its direction up to which a lamp shines."""
_SHADOW_PIXELS: Final = 1024
"""Side of the shadow map in pixels: on a floor of 12 m a pixel is 12 mm."""


def add_surroundings(spec: mujoco.MjSpec, world: World) -> None:
    """Add everything that does not move."""
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
    head.ambient = light.ambient * color
    head.diffuse = np.zeros(3)
    head.specular = np.zeros(3)
    source.dir = np.array(light.direction) / math.hypot(*light.direction)
    source.pos = -_SUN_DISTANCE * source.dir
    if light.position is not None:
        source.type, source.pos = mujoco.mjtLightType.mjLIGHT_SPOT, light.position
        source.cutoff, source.exponent = _LAMP_CUTOFF, 0.0
    # The sky emits light; it is as bright as a lit surface.
    sky, shining = spec.texture("sky"), np.minimum((light.ambient + light.brightness) * color, 1.0)
    sky.rgb1, sky.rgb2 = sky.rgb1 * shining, sky.rgb2 * shining
    if light.shadows:
        source.castshadow = True
        spec.visual.quality.shadowsize = _SHADOW_PIXELS
        spec.visual.map.shadowclip, spec.visual.map.shadowscale = reach, 1.0


def add_movables(spec: mujoco.MjSpec, world: World) -> None:
    """Add everything that moves, and the spectator: after the robot, which is first in all arrays."""
    start = spec.worldbody.add_body(
        name=START, pos=[*world.robot.position, 0.0], quat=about_z(world.robot.heading)
    )
    add_camera(start, SPECTATOR, SPECTATOR_YAW)
    sphere = mujoco.mjtGeom.mjGEOM_SPHERE
    for carried in world.carried_balls:
        carrier = _add_carrier(spec, start, carried)
        seen = spec.find_default("seen")
        carrier.add_geom(seen, type=sphere, size=[BALL_RADIUS, 0, 0], rgba=[*carried.color, 1])
    for ball in world.balls:
        body = spec.worldbody.add_body(name=ball.name, pos=[*ball.position, ball.radius])
        body.add_freejoint(name=ball.name)
        kind, size = spec.find_default("ball"), [ball.radius, 0, 0]
        geom = body.add_geom(kind, type=sphere, size=size, rgba=[*ball.color, 1], mass=ball.mass)
        geom.friction[2], geom.solref = ball.rolling, ball.contact
    for box in world.boxes:
        if box.mass is not None:
            _add_box(spec, box)


def spectator_of(height: float) -> CameraFacts:
    """Return the spectator of a robot of a height in m, of a tall one from farther away and from above."""
    x, y, z = SPECTATOR.position
    scale = max(1.0, height / _FRAMED_HEIGHT)
    return msgspec.structs.replace(SPECTATOR, position=(x * scale, y * scale, z * scale))


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
        add_motor(spec, joint, joint.max_torque, default)
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
"""Maximum pixels per metre of the texture."""
_LARGEST_TEXTURE: Final = 1536
"""Maximum pixels along the longer side of the texture."""
_NET: Final = (0.80, 0.82, 0.84, 0.35)
_NET_THICKNESS: Final = 0.01
WHITE: Final = (0.96, 0.96, 0.96)


@lru_cache(maxsize=2)
def draw_field(field: Field) -> NDArray[np.uint8]:
    """Return a picture of the field with its border: rows from +y to -y, columns from -x to +x, RGB.

    The array, which is kept for the next robot on that field, is read-only.
    """
    size = (field.length + 2 * field.border, field.width + 2 * field.border)
    scale = min(_METRE, _LARGEST_TEXTURE / max(size))
    # Only the quarter with x and y above zero is drawn: the others are its mirror images.
    width, height = (round(scale * side / 2) for side in size)
    x, y = np.meshgrid((np.arange(width) + 0.5) / scale, (np.arange(height) + 0.5) / scale)
    # The white share of each pixel: its depth within a line, in pixels.
    white = np.zeros((height, width))

    def paint(distance: NDArray[np.float64]) -> None:
        """Paint where the distance in m to the edge of a white area is negative."""
        np.maximum(white, np.clip(0.5 - distance * scale, 0.0, 1.0), out=white)

    for (at_x, at_y), (half_x, half_y) in field.lines():
        paint(np.maximum(np.abs(x - at_x) - half_x, np.abs(y - at_y) - half_y))
    paint(np.abs(np.hypot(x, y) - field.circle_diameter / 2) - field.line / 2)
    grass = np.array(field.grass) * (1.0 + 0.04 * np.sign(np.sin(x * math.pi / 0.5)))[..., None]
    colors = grass + white[..., None] * (np.array(WHITE) - grass)
    quarter = np.asarray(np.round(255 * np.clip(colors, 0, 1)), dtype=np.uint8)
    half = np.concatenate([quarter[:, ::-1], quarter], axis=1)
    picture = np.concatenate([half[::-1], half])
    picture.flags.writeable = False
    return picture


def _add_goals(spec: mujoco.MjSpec, field: Field) -> None:
    firm, add = spec.find_default("firm"), spec.worldbody.add_geom
    bar, radius = mujoco.mjtGeom.mjGEOM_CAPSULE, [POST_RADIUS, 0, 0]
    reach = field.goal_width / 2 + POST_RADIUS
    top = field.goal_height
    depth = field.goal_depth
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


_PIXELS: Final = 128
_THICKNESS: Final = 0.01
_BACK: Final = (0.92, 0.92, 0.90, 1.0)

Picture = NDArray[np.uint8]


def draw_landmark(number: int) -> Picture:
    """Return an ArUco mark of 4 by 4 bits with a white border, RGB. Raises RobotError without OpenCV."""
    try:
        import cv2
    except ModuleNotFoundError as error:
        raise RobotError(f"landmarks: {missing_package(error, 'vision')}") from None
    marks = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250)
    picture = np.full((_PIXELS, _PIXELS), 255, np.uint8)
    border = _PIXELS // 8
    picture[border:-border, border:-border] = marks.generateImageMarker(number, _PIXELS - 2 * border)
    return np.repeat(picture[..., None], 3, axis=2)


def draw_face() -> Picture:
    """Return a face in front of a wall, RGB: skin, two dark eyes, brows, a nose and a mouth."""
    from PIL import Image, ImageDraw  # slow to load, and few worlds have such a picture

    image = Image.new("RGB", (_PIXELS, _PIXELS), (150, 165, 175))
    draw = ImageDraw.Draw(image)
    draw.ellipse((26, 6, 102, 70), fill=(70, 45, 30))  # hair
    draw.ellipse((30, 16, 98, 120), fill=(224, 172, 140))
    for left in (44, 72):
        draw.ellipse((left, 54, left + 12, 64), fill=(25, 20, 20))
        draw.line((left - 2, 47, left + 14, 46), fill=(120, 80, 55), width=2)
    draw.line((64, 62, 60, 80, 66, 82), fill=(196, 140, 110), width=2)
    draw.arc((50, 78, 78, 102), 20, 160, fill=(170, 70, 70), width=3)
    return np.asarray(image)


def add_picture(spec: mujoco.MjSpec, name: str, picture: Picture) -> None:
    """Add a material of a name that shows a picture: rows from +y to -y, columns from -x to +x, RGB."""
    height, width, channels = picture.shape
    flat = mujoco.mjtTexture.mjTEXTURE_2D
    texture = spec.add_texture(name=name, type=flat, width=width, height=height, nchannel=channels)
    texture.data = picture.tobytes()
    material = spec.add_material(name=name, specular=0.0, shininess=0.0)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name


def add_sign(spec: mujoco.MjSpec, sign: Sign, name: str) -> None:
    """Add a board that faces in the direction of its heading, and its picture."""
    picture = draw_face() if sign.landmark is None else draw_landmark(sign.landmark)
    add_picture(spec, name, picture)
    # Local axes: x to the viewer's right, y up, z towards the viewer.
    facing, up = (math.cos(sign.heading), math.sin(sign.heading), 0.0), (0.0, 0.0, 1.0)
    turned = np.column_stack([np.cross(up, facing), up, facing])
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, turned.ravel())
    half, center = sign.size / 2, np.array((*sign.position, sign.height))
    firm, seen = spec.find_default("firm"), spec.find_default("seen")
    spec.worldbody.add_geom(
        firm,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[half, half, _THICKNESS / 2],
        pos=center - _THICKNESS * np.array(facing),
        quat=quat,
        rgba=_BACK,
    )
    spec.worldbody.add_geom(
        seen, type=mujoco.mjtGeom.mjGEOM_PLANE, size=[half, half, 0.01], pos=center, quat=quat, material=name
    )
