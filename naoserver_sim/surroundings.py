"""A world in the model: floor, light, background, the spectator's camera, walls, boxes and balls."""

from __future__ import annotations

import math
from typing import Final

import mujoco

from naoserver.robot import CameraFacts
from naoserver_sim.body import add_camera
from naoserver_sim.contacts import FRICTION, firm, moving, untouchable
from naoserver_sim.field import add_field
from naoserver_sim.motors import add_motor
from naoserver_sim.world import BALL_RADIUS, Box, CarriedBall, LooseBall, Wall, World

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
_FLOOR_SIZE: Final = 6.0

# The mechanism weighs next to nothing beside the inertia of its motors, so that its axes do not disturb each
# other. Stiffness and damping are critical at 30 rad/s: it follows its setpoint in 0.1 s and never swings.
_ARMATURE: Final = 1.0
_STIFFNESS: Final = 900.0
_DAMPING: Final = 60.0
_CARRIER_MASS: Final = 0.001

_SOFT: Final = (0.005, 1.0)
"""Time constant in s and damping ratio of a contact."""
_BALL_FRICTION: Final = (0.8, 0.01, 0.0025)
"""Of a ball of foam on a carpet: along the floor, and in m about its normal and of rolling."""


def add_surroundings(spec: mujoco.MjSpec, world: World) -> None:
    """Add the light and what stands firm."""
    _add_light(spec)
    if world.field is not None:
        add_field(spec, world.field)
    else:
        _add_floor(spec)
    for wall in world.walls:
        _add_wall(spec, wall)
    for box in world.boxes:
        if box.mass is None:
            _add_box(spec, box)


def add_movables(spec: mujoco.MjSpec, world: World) -> None:
    """Add what moves, and the spectator: after the robot, which stands first in all arrays."""
    start = spec.worldbody.add_body(
        name="start", pos=[*world.robot.position, 0.0], quat=about_z(world.robot.heading)
    )
    add_camera(start, SPECTATOR, _SPECTATOR_YAW)
    for carried in world.carried_balls:
        _add_carried_ball(spec, start, carried)
    for loose in world.balls:
        _add_loose_ball(spec, loose)
    for box in world.boxes:
        if box.mass is not None:
            _add_box(spec, box)


def _add_carried_ball(spec: mujoco.MjSpec, start: mujoco.MjsBody, ball: CarriedBall) -> None:
    """Add a ball, which touches nothing, with the mechanism that carries it round the robot's start."""
    pan, distance, height = ball.joints
    carrier = start.add_body(name=ball.name, gravcomp=1)
    for joint, kind, axis in (
        (pan, mujoco.mjtJoint.mjJNT_HINGE, [0, 0, 1]),
        (distance, mujoco.mjtJoint.mjJNT_SLIDE, [1, 0, 0]),
        (height, mujoco.mjtJoint.mjJNT_SLIDE, [0, 0, 1]),
    ):
        carrier.add_joint(
            name=joint.name,
            type=kind,
            axis=axis,
            limited=mujoco.mjtLimited.mjLIMITED_TRUE,
            range=[joint.lower, joint.upper],
            armature=_ARMATURE,
        )
        add_motor(spec, joint, kp=_STIFFNESS, kv=_DAMPING)
    carrier.explicitinertial = True
    carrier.mass = _CARRIER_MASS
    carrier.inertia = [1e-6] * 3
    carrier.add_geom(
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=[BALL_RADIUS, 0, 0],
        rgba=[*ball.color, 1],
        mass=0,
        **untouchable(),
    )


def about_z(angle: float) -> tuple[float, float, float, float]:
    """Return the quaternion (w, x, y, z) of a turn to the left."""
    return math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2)


def _add_light(spec: mujoco.MjSpec) -> None:
    spec.visual.headlight.ambient = [0.42, 0.42, 0.42]
    spec.visual.headlight.diffuse = [0.35, 0.35, 0.35]
    spec.visual.headlight.specular = [0.1, 0.1, 0.1]
    spec.worldbody.add_light(
        pos=[1.5, 1.0, 4.0],
        dir=[-0.3, -0.25, -1.0],
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        diffuse=[0.5, 0.5, 0.5],
        specular=[0.3, 0.3, 0.3],
        castshadow=False,
    )
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.80, 0.84, 0.88],
        rgb2=[0.60, 0.62, 0.64],
        width=32,
        height=192,
    )


def _add_floor(spec: mujoco.MjSpec) -> None:
    spec.add_texture(
        name="floor",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=[0.80, 0.82, 0.84],
        rgb2=[0.70, 0.72, 0.75],
        width=64,
        height=64,
    )
    material = spec.add_material(name="floor", texrepeat=[2, 2], texuniform=True)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "floor"
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[_FLOOR_SIZE, _FLOOR_SIZE, 0.1],
        material="floor",
        friction=FRICTION,
        **firm(),
    )


def _add_wall(spec: mujoco.MjSpec, wall: Wall) -> None:
    (x0, y0), (x1, y1) = wall.begin, wall.end
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX,
        # Longer by its thickness, so that walls which end at one point close the corner.
        size=[(math.dist(wall.begin, wall.end) + wall.thickness) / 2, wall.thickness / 2, wall.height / 2],
        pos=[(x0 + x1) / 2, (y0 + y1) / 2, wall.height / 2],
        quat=about_z(math.atan2(y1 - y0, x1 - x0)),
        rgba=[*wall.color, 1],
        friction=FRICTION,
        **firm(),
    )


def _add_box(spec: mujoco.MjSpec, box: Box) -> None:
    half = [side / 2 for side in box.size]
    body = spec.worldbody.add_body(name=box.name, pos=[*box.position, half[2]], quat=about_z(box.heading))
    if box.mass is not None:
        body.add_freejoint(name=box.name)
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=half,
        rgba=[*box.color, 1],
        mass=box.mass or 0.0,
        friction=FRICTION,
        solref=_SOFT,
        **(firm() if box.mass is None else moving()),
    )


def _add_loose_ball(spec: mujoco.MjSpec, ball: LooseBall) -> None:
    body = spec.worldbody.add_body(name=ball.name, pos=[*ball.position, ball.radius])
    body.add_freejoint(name=ball.name)
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=[ball.radius, 0, 0],
        rgba=[*ball.color, 1],
        mass=ball.mass,
        friction=_BALL_FRICTION,
        condim=6,
        priority=1,  # its own rolling friction counts, not the larger one of what it touches
        solref=_SOFT,
        **moving(),
    )
