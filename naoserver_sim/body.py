"""The H25 body as a MuJoCo model: links, joints, motors, contact shapes and cameras, made from its facts.

Units and frames are those of `naoserver.body`. What a person sees of the body is in `appearance.py`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final

import mujoco
import numpy as np

from naoserver.body import Body, Joint, Link
from naoserver.robot import CameraFacts
from naoserver_sim.contacts import FRICTION, exclude_neighbors, moving
from naoserver_sim.motors import add_motor

TORSO: Final = "torso"

# Gains and friction with which the body stands, dances and walks at steps of 1 to 5 ms; kp in N m/rad, kv in
# N m s/rad, armature in kg m^2, damping in N m s/rad.
_LEG: Final = {"kp": 100.0, "kv": 2.5, "armature": 0.01}
_UPPER: Final = {"kp": 20.0, "kv": 0.5, "armature": 0.005}
_WRIST: Final = {"kp": 5.0, "kv": 0.1, "armature": 0.005}
_HAND: Final = {"kp": 0.5, "kv": 0.02, "armature": 0.0005}
_DAMPING: Final = 0.05
_FRICTION_LOSS: Final = 0.02
_LEG_JOINTS: Final = ("Hip", "Knee", "Ankle")

COLLISION_GROUP: Final = 3
"""Geoms of this group are not drawn."""

_MASSLESS: Final = (1e-5, 1e-8)
"""Mass in kg and inertia in kg m^2 of the fingers: the facts count theirs in the hand, MuJoCo needs some."""


def gains(joint: str) -> dict[str, float]:
    """Return kp, kv and armature of a joint's motor."""
    if any(part in joint for part in _LEG_JOINTS):
        return _LEG
    if joint.endswith("Hand"):
        return _HAND
    if joint.endswith("WristYaw"):
        return _WRIST
    return _UPPER


def add_body(spec: mujoco.MjSpec, body: Body, cameras: tuple[CameraFacts, ...]) -> dict[str, mujoco.MjsBody]:
    """Add the body on a free base with its motors; returns its links by name, for the appearance."""
    links: dict[str, mujoco.MjsBody] = {}
    joints = {joint.name: joint for joint in body.joints}
    for link in body.links:
        links[link.name] = _add_link(spec, links, link, joints.get(link.parent_joint or ""))
    _add_contact_shapes(links, body)
    exclude_neighbors(spec, body)
    followers = {coupling.follower for coupling in body.couplings}
    for joint, facts in zip(body.joints, body.facts["joints"], strict=True):
        if joint.name not in followers:
            tuning, motor = gains(joint.name), facts.get("motor", {})
            lasting = motor.get("continuous_torque_out_no_loss")
            add_motor(spec, joint, kp=tuning["kp"], kv=tuning["kv"], lasting=lasting)
    for coupling in body.couplings:
        spec.add_equality(
            name=f"{coupling.leader}={coupling.follower}",
            type=mujoco.mjtEq.mjEQ_JOINT,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            name1=coupling.follower,
            name2=coupling.leader,
            data=[0, 1, *[0] * (mujoco.mjNEQDATA - 2)],  # the polynomial 0 + 1 x
            solref=[0.005, 1],
        )
    for camera in cameras:
        add_camera(links["head"], camera)
    return links


def add_camera(parent: mujoco.MjsBody, camera: CameraFacts, yaw: float = 0.0) -> None:
    """Mount a camera that looks along x of its parent, pitched down by its tilt and turned left by `yaw`."""
    width, height = camera.sizes[0]
    half = math.tan(camera.horizontal_fov / 2)
    # MuJoCo's cameras look along -z, with x to the right and y up in the image.
    forward = np.array(
        [math.cos(camera.tilt) * math.cos(yaw), math.cos(camera.tilt) * math.sin(yaw), -math.sin(camera.tilt)]
    )
    right = np.array([math.sin(yaw), -math.cos(yaw), 0.0])
    axes = np.column_stack([right, np.cross(right, forward), -forward])
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, axes.flatten())
    parent.add_camera(
        name=camera.name,
        pos=camera.position,
        quat=quat,
        fovy=math.degrees(2 * math.atan(half * height / width)),
    )


def _add_link(
    spec: mujoco.MjSpec, links: Mapping[str, mujoco.MjsBody], link: Link, joint: Joint | None
) -> mujoco.MjsBody:
    if joint is None:
        added = spec.worldbody.add_body(name=link.name)
        added.add_freejoint(name="base")
    else:
        added = links[joint.parent].add_body(name=link.name, pos=joint.origin)
        added.add_joint(
            name=joint.name,
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=joint.axis,
            limited=mujoco.mjtLimited.mjLIMITED_TRUE,
            range=[joint.lower, joint.upper],
            armature=gains(joint.name)["armature"],
            damping=[_DAMPING, 0, 0],
            frictionloss=_FRICTION_LOSS,
        )
    added.explicitinertial = True
    if link.mass > 0:
        inertia = link.inertia
        added.mass = link.mass
        added.ipos = link.com
        added.fullinertia = [inertia.ixx, inertia.iyy, inertia.izz, inertia.ixy, inertia.ixz, inertia.iyz]
    else:
        added.mass = _MASSLESS[0]
        added.inertia = [_MASSLESS[1]] * 3
    return added


def _add_contact_shapes(links: Mapping[str, mujoco.MjsBody], body: Body) -> None:
    """Add the shapes with which the links touch things; the feet stand on the box round their soles."""
    for shape in body.facts["self_collision_shapes"]["shapes"]:
        link = links[shape["link"]]
        if shape["link"].endswith("_foot"):
            continue
        if shape["type"] == "sphere":
            _add_contact(link, mujoco.mjtGeom.mjGEOM_SPHERE, [shape["size"][0], 0, 0], pos=shape["pos"])
        else:
            radius, length = shape["size"]
            # The facts give a cylinder; a capsule of the same radius and reach costs less.
            half = max(length / 2 - radius, 0.001)
            ends = [p - half * a for p, a in zip(shape["pos"], shape["axis"], strict=True)]
            ends += [p + half * a for p, a in zip(shape["pos"], shape["axis"], strict=True)]
            _add_contact(link, mujoco.mjtGeom.mjGEOM_CAPSULE, [radius, 0, 0], fromto=ends)
    height = body.facts["dimensions"]["foot_height"]
    shapes = {shape["link"]: shape for shape in body.facts["self_collision_shapes"]["shapes"]}
    for side in ("left", "right"):
        outline = body.facts["sole"][side]
        low = [min(point[axis] for point in outline) for axis in (0, 1)]
        high = [max(point[axis] for point in outline) for axis in (0, 1)]
        thickness = shapes[f"{side[0]}_foot"]["size"][2] / 2
        _add_contact(
            links[f"{side[0]}_foot"],
            mujoco.mjtGeom.mjGEOM_BOX,
            [(high[0] - low[0]) / 2, (high[1] - low[1]) / 2, thickness],
            name=sole(side),
            pos=[(high[0] + low[0]) / 2, (high[1] + low[1]) / 2, thickness - height],
        )


def sole(side: str) -> str:
    """Return the name of the contact shape of the sole of a side, `left` or `right`."""
    return f"{side}_sole"


def _add_contact(
    link: mujoco.MjsBody, kind: mujoco.mjtGeom, size: Sequence[float], **where: str | Sequence[float]
) -> None:
    link.add_geom(
        type=kind,
        size=size,
        group=COLLISION_GROUP,
        mass=0,
        condim=4,
        friction=FRICTION,
        solref=[0.005, 1],
        **moving(),
        **where,
    )
