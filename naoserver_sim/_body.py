"""The body in the model: links, joints, motors, contact shapes, cameras and sensors, made from its facts.

Units and frames are those of `naoserver.body`; gains and collision classes are in scene.xml. The visible
shapes of the body are in `appearance.py`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import combinations
from typing import Any, Final

import mujoco
import numpy as np

from naoserver.body import H25, Body, Joint, Link
from naoserver.robot import CameraFacts, JointFacts

Links = Mapping[str, mujoco.MjsBody]

TORSO: Final = "torso"
SIDES: Final = ("left", "right")
FEET: Final = ("l_foot", "r_foot")
BUMPERS: Final = ("LFootBumperLeft", "LFootBumperRight", "RFootBumperLeft", "RFootBumperRight")
_UNIT: Final = "inertial unit"

# A bumper feels the forces of contacts whose rays enter a box in front of its half of the toe. Half sizes of
# the box in m; its distance from the toe; and its depth below the sole, which is less than the distance by
# which rays of contacts with the floor descend on their way there.
_BUMPER: Final = (0.006, 0.03, 0.0225)
_BUMPER_AHEAD: Final = 0.0008
_BUMPER_BELOW: Final = 0.0008

# Data of a contact sensor, and its reduction of all contacts of a foot to one wrench: MuJoCo's `netforce`.
_FORCE_TORQUE_PLACE: Final = sum(
    1 << int(getattr(mujoco.mjtConDataField, f"mjCONDATA_{field}")) for field in ("FORCE", "TORQUE", "POS")
)
_NET_FORCE: Final = 3


def add_body(spec: mujoco.MjSpec, body: Body, cameras: tuple[CameraFacts, ...]) -> Links:
    """Add the body on a free base with its motors and sensors; returns its links by name."""
    links: dict[str, mujoco.MjsBody] = {}
    joints = {joint.name: joint for joint in (*body.joints, *body.fixed_joints)}
    for link in body.links:
        joint = joints.get(link.parent_joint or "")
        links[link.name] = _add_link(spec, links, link, joint, fixed=joint in body.fixed_joints)
    _add_contact_shapes(spec, links)
    for first, second in combinations(links, 2):
        if _pass_through(first, second):
            spec.add_exclude(bodyname1=first, bodyname2=second)
    followers = {coupling.follower for coupling in body.couplings}
    for joint, facts in zip(body.joints, body.facts["joints"], strict=True):
        if joint.name not in followers:
            lasting = facts.get("motor", {}).get("continuous_torque_out_no_loss")
            add_motor(spec, joint, _kind(joint.name), lasting)
    for coupling in body.couplings:
        spec.add_equality(
            type=mujoco.mjtEq.mjEQ_JOINT,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            name1=coupling.follower,
            name2=coupling.leader,
            data=[0, 1, *[0] * (mujoco.mjNEQDATA - 2)],  # the polynomial 0 + 1 x
            solref=[0.005, 1],
        )
    for camera in cameras:
        add_camera(links["head"], camera)
    add_sensors(spec, links)
    return links


def add_camera(parent: mujoco.MjsBody, camera: CameraFacts, yaw: float = 0.0) -> None:
    """Mount a camera that looks along its parent's x axis, pitched by its tilt and turned left by `yaw`."""
    width, height = camera.sizes[0]
    half = math.tan(camera.horizontal_fov / 2)
    right = (math.sin(yaw), -math.cos(yaw), 0.0)
    ahead = math.sin(camera.tilt)
    parent.add_camera(
        name=camera.name,
        pos=camera.position,
        xyaxes=[*right, ahead * math.cos(yaw), ahead * math.sin(yaw), math.cos(camera.tilt)],
        fovy=math.degrees(2 * math.atan(half * height / width)),
    )


def add_motor(spec: mujoco.MjSpec, joint: JointFacts, kind: str, lasting: float | None = None) -> None:
    """Add the motor of a joint, named as the joint: it pulls towards its setpoint with the gains of its kind.

    `lasting` is the continuous torque in N m; by default its maximum torque.
    """
    spec.add_actuator(
        spec.find_default(kind),
        name=joint.name,
        target=joint.name,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        ctrlrange=[joint.lower, joint.upper],
        forcerange=[-joint.max_torque, joint.max_torque],
        userdata=[joint.max_torque if lasting is None else lasting],
    )


def _kind(joint: str) -> str:
    """Return the class of a joint and its motor in scene.xml."""
    if any(joint in (coupling.leader, coupling.follower) for coupling in H25.couplings):
        return "pair"
    if any(part in joint for part in ("Hip", "Knee", "Ankle")):
        return "leg"
    return {"Hand": "hand", "WristYaw": "wrist"}.get(joint[1:], "upper")


def _add_link(
    spec: mujoco.MjSpec, links: Links, link: Link, joint: Joint | None, *, fixed: bool
) -> mujoco.MjsBody:
    # The fingers: the facts count their mass in the hand, MuJoCo needs some.
    inertial: dict[str, Any] = {"mass": 1e-5, "inertia": [1e-8] * 3}
    if link.mass > 0:
        of = link.inertia
        inertial = {"mass": link.mass, "ipos": link.com}
        inertial["fullinertia"] = [of.ixx, of.iyy, of.izz, of.ixy, of.ixz, of.iyz]
    if joint is None:
        added = spec.worldbody.add_body(name=link.name, explicitinertial=True, **inertial)
        added.add_freejoint(name="base")
        return added
    added = links[joint.parent].add_body(name=link.name, pos=joint.origin, explicitinertial=True, **inertial)
    if fixed:
        return added
    kind = spec.find_default(_kind(joint.name))
    added.add_joint(kind, name=joint.name, axis=joint.axis, range=[joint.lower, joint.upper])
    return added


def _add_contact_shapes(spec: mujoco.MjSpec, links: Links) -> None:
    """Add the contact shapes of the links; the feet stand on the boxes round their soles."""
    kind, geom = spec.find_default("link"), mujoco.mjtGeom
    height = H25.facts["dimensions"]["foot_height"]
    for shape in H25.facts["self_collision_shapes"]["shapes"]:
        link = links[shape["link"]]
        size = shape["size"]
        place = np.array(shape["pos"])
        if shape["link"].endswith("_foot"):
            side = SIDES[shape["link"] == "r_foot"]
            outline = np.array(H25.facts["sole"][side])
            low, high = outline.min(axis=0), outline.max(axis=0)
            half = (high - low) / 2
            middle = (high + low) / 2
            thickness = size[2] / 2
            link.add_geom(
                kind,
                name=sole(side),
                type=geom.mjGEOM_BOX,
                size=[*half, thickness],
                pos=[*middle, thickness - height],
            )
        elif shape["type"] == "sphere":
            link.add_geom(kind, type=geom.mjGEOM_SPHERE, size=[size[0], 0, 0], pos=place)
        else:
            radius, length = size
            # The facts give a cylinder; a capsule of the same radius and reach is cheaper to compute.
            half = max(length / 2 - radius, 0.001) * np.array(shape["axis"])
            ends = [*(place - half), *(place + half)]
            link.add_geom(kind, type=geom.mjGEOM_CAPSULE, size=[radius, 0, 0], fromto=ends)


def sole(side: str) -> str:
    """Return the name of the contact shape of the sole of a side, `left` or `right`."""
    return f"{side}_sole"


def _pass_through(first: str, second: str) -> bool:
    """Return whether two links may pass through each other."""
    # The balls round the ankles reach into the other leg and into the thigh of a robot that merely crouches:
    # shins and soles keep the legs apart, the range of the knee keeps the ankle off the thigh.
    return not {"l_ankle", "r_ankle"}.isdisjoint((first, second)) or are_neighbors(first, second)


def are_neighbors(first: str, second: str) -> bool:
    """Return whether two links meet at joints in one point, or one carries the other there.

    The shapes of neighbors overlap.
    """
    carriers = {joint.child: joint for joint in H25.joints}

    def cluster(link: str) -> str:
        # The joints of a hip, an ankle or a shoulder share a point: the links between them are one neighbor.
        while link in carriers and not any(carriers[link].origin):
            link = carriers[link].parent
        return link

    def carrier(link: str) -> str | None:
        return cluster(carriers[link].parent) if link in carriers else None

    one, other = cluster(first), cluster(second)
    return one == other or carrier(one) == other or carrier(other) == one


def add_sensors(spec: mujoco.MjSpec, links: Links) -> None:
    """Add the inertial unit, the soles' wrenches and the bumpers to the body's links."""
    sensor, kind = mujoco.mjtSensor, mujoco.mjtObj

    def measure(site: str, **sensors: mujoco.mjtSensor) -> None:
        for name, measurement in sensors.items():
            spec.add_sensor(name=name, type=measurement, objtype=kind.mjOBJ_SITE, objname=site)

    links[TORSO].add_site(name=_UNIT, pos=H25.facts["imu"]["accelerometer"])
    measure(_UNIT, acceleration=sensor.mjSENS_ACCELEROMETER, turning=sensor.mjSENS_GYRO)
    measure(_UNIT, attitude=sensor.mjSENS_FRAMEQUAT)
    height = H25.facts["dimensions"]["foot_height"]
    for side in SIDES:
        foot, middle = links[f"{side[0]}_foot"], f"{side} sole"
        foot.add_site(name=middle, pos=[0, 0, -height])
        wrench = spec.add_sensor(
            name=f"{side} wrench", type=sensor.mjSENS_CONTACT, objtype=kind.mjOBJ_BODY, objname=foot.name
        )
        wrench.intprm[:3] = [_FORCE_TORQUE_PLACE, _NET_FORCE, 1]
        for axis in ("POS", "XAXIS", "YAXIS", "ZAXIS"):
            measure(middle, **{f"{side} {axis}": getattr(sensor, f"mjSENS_FRAME{axis}")})
        x, y = zip(*H25.facts["sole"][side], strict=True)
        ahead = max(x) + _BUMPER_AHEAD + _BUMPER[0]
        middle_y, up = (max(y) + min(y)) / 2, _BUMPER[2] - height - _BUMPER_BELOW
        for edge, leftward in (("Left", 1.0), ("Right", -1.0)):
            bumper = f"{side[0].upper()}FootBumper{edge}"
            place = [ahead, middle_y + leftward * _BUMPER[1], up]
            foot.add_site(name=bumper, type=mujoco.mjtGeom.mjGEOM_BOX, pos=place, size=_BUMPER)
            measure(bumper, **{bumper: sensor.mjSENS_TOUCH})
