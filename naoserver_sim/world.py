"""What surrounds the robot: floor, light, background, the spectator's camera, and balls on three joints each.

The world's frame: x forward and y left of the robot as it starts, z up, the origin on the floor below it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import mujoco
import numpy as np

from naoserver.robot import CameraFacts, JointFacts
from naoserver_sim.body import BODY_BIT, FLOOR_BIT, add_camera
from naoserver_sim.motors import add_motor

BALL_RADIUS: Final = 0.06

SPECTATOR: Final = CameraFacts(
    name="CameraOutside",
    position=(1.15, -1.6, 0.75),
    tilt=0.2,
    horizontal_fov=math.radians(48),
    sizes=((320, 240), (640, 480), (1280, 960)),
    rates=(30.0, 30.0, 15.0),
)
"""A spectator in front of the robot and to its right; sees it and the balls."""
_SPECTATOR_YAW: Final = math.radians(113)


@dataclass(frozen=True, slots=True)
class Ball:
    """A ball that a mechanism carries round the robot: pan, then distance, then height."""

    name: str
    color: tuple[float, float, float]
    start: tuple[float, float, float]
    """Pan in rad, distance in m, height of the centre in m."""

    @property
    def joints(self) -> tuple[JointFacts, JointFacts, JointFacts]:
        """The joints in the order of `start`; the forces are those of a mechanism that lacks none."""
        return (
            JointFacts(f"{self.name}Pan", -math.pi, math.pi, 2.0, 100.0),
            JointFacts(f"{self.name}X", 0.15, 3.0, 1.5, 100.0),
            JointFacts(f"{self.name}Z", BALL_RADIUS, 1.5, 1.5, 100.0),
        )


BALLS: Final = (
    Ball("BallRed", (0.95, 0.02, 0.02), (-0.25, 1.0, 0.5)),
    Ball("BallGreen", (0.02, 0.85, 0.05), (0.25, 1.0, 0.5)),
)


def scattered(balls: Sequence[Ball], random: np.random.Generator) -> tuple[Ball, ...]:
    """Return the balls with random starting places in front of the robot, where its head can follow them."""
    return tuple(
        replace(
            ball,
            start=(random.uniform(-0.5, 0.5), random.uniform(0.7, 1.2), random.uniform(0.35, 0.65)),
        )
        for ball in balls
    )


# The mechanism weighs next to nothing beside the inertia of its motors, so that its axes do not disturb each
# other. Stiffness and damping are critical at 30 rad/s: it follows its setpoint in 0.1 s and never swings.
_ARMATURE: Final = 1.0
_STIFFNESS: Final = 900.0
_DAMPING: Final = 60.0
_BALL_MASS: Final = 0.001


def add_surroundings(spec: mujoco.MjSpec) -> None:
    """Add the floor, the light, the background and the spectator's camera."""
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
        name="floor",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=[0.80, 0.82, 0.84],
        rgb2=[0.70, 0.72, 0.75],
        width=64,
        height=64,
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
    floor = spec.add_material(name="floor", texrepeat=[2, 2], texuniform=True)
    floor.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "floor"
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[6, 6, 0.1],
        material="floor",
        contype=FLOOR_BIT,
        conaffinity=BODY_BIT,
        friction=[1.0, 0.02, 0.001],
    )
    add_camera(spec.worldbody, SPECTATOR, _SPECTATOR_YAW)


def add_ball(spec: mujoco.MjSpec, ball: Ball) -> None:
    """Add a ball with its mechanism; it touches nothing and weighs nothing."""
    pan, distance, height = ball.joints
    carrier = spec.worldbody.add_body(name=ball.name, gravcomp=1)
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
    carrier.mass = _BALL_MASS
    carrier.inertia = [1e-6] * 3
    carrier.add_geom(
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=[BALL_RADIUS, 0, 0],
        rgba=[*ball.color, 1],
        contype=0,
        conaffinity=0,
        mass=0,
    )
