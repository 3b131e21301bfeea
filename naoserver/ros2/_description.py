"""The description of the body for ROS: a URDF, and the frames of its links and sensors.

The names of links and frames are those of naoqi_driver2. REP 120 (Coordinate Frames for Humanoid Robots)
defines `base_link`, `torso`, `gaze`, `l_wrist`, `l_gripper`, `l_ankle`, `l_sole` and those on the right.
Axes are those of REP 103: x forward, y left, z up; of optical frames z forward, x right, y down.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final
from xml.etree import ElementTree as ET

from interfaces.jderobot import CameraDescription
from naoserver.body import BODIES, Body, Joint, Link
from naoserver.capabilities import Vector

ODOM: Final = "odom"
"""The frame of the odometry: the place at which it began."""
ROOT: Final = "base_link"
"""The root of the tree: the torso's frame."""
FOOTPRINT: Final = "base_footprint"
"""The place on the floor between the soles, with the heading of the torso."""
SOLES: Final = ("l_sole", "r_sole")
LINKS: Final = {
    "torso": "torso",
    "neck": "Neck",
    "head": "Head",
    **{
        link: name
        for side in "lr"
        for link, name in (
            (f"{side}_shoulder", f"{side.upper()}Shoulder"),
            (f"{side}_upper_arm", f"{side.upper()}Bicep"),
            (f"{side}_elbow", f"{side.upper()}Elbow"),
            (f"{side}_forearm", f"{side.upper()}ForeArm"),
            (f"{side}_wrist_hand", f"{side}_wrist"),
            (f"{side}_fingers", f"{side}_gripper"),
            (f"{side}_pelvis", f"{side.upper()}Pelvis"),
            (f"{side}_hip", f"{side.upper()}Hip"),
            (f"{side}_thigh", f"{side.upper()}Thigh"),
            (f"{side}_tibia", f"{side.upper()}Tibia"),
            (f"{side}_ankle", f"{side.upper()}AnklePitch"),
            (f"{side}_foot", f"{side}_ankle"),
        )
    },
}
"""The name in ROS of each link of the body."""
CAMERA_FRAMES: Final = {
    "Camera": "CameraTop",
    "CameraBottom": "CameraBottom",
    "CameraOutside": "CameraOutside",
}
"""The beginning of the frames of each camera: `..._frame`, and `..._optical_frame` of its images."""

OUTSIDE_YAW: Final = math.radians(113)
"""Yaw of `CameraOutside` in `odom`, which its description lacks; a simulation places it (surroundings.py)."""
_BONE: Final = 0.018
"""Radius in m of the cylinders that are drawn between joints, in addition to the shapes of the facts."""
_LEAST_MASS, _LEAST_INERTIA = 1e-5, 1e-8
"""For the fingers, in kg and kg m2: their mass is included in the hand's, but simulators need some."""
_OPTICAL: Final = (-math.pi / 2, 0.0, -math.pi / 2)
_NOWHERE: Final = (0.0, 0.0, 0.0)

Shape = tuple[Vector, Vector, str, dict[str, str]]
"""A shape of a link: place in m, roll, pitch and yaw in rad, tag and attributes of its geometry."""


@dataclass(frozen=True, slots=True)
class Frame:
    """A frame that is fixed to another."""

    name: str
    parent: str
    position: Vector
    """In the parent's frame in m."""
    angles: Vector = _NOWHERE
    """Roll, pitch and yaw in rad: about the parent's fixed x, then y, then z axis."""


def body_of(joints: Sequence[str]) -> Body | None:
    """Return the body with these joints in this order; None for an unknown robot."""
    return next((body for body in BODIES.values() if body.joint_names == tuple(joints)), None)


def fixed_frames(body: Body) -> list[Frame]:
    """Return the frames that never move, each after its parent."""
    facts = body.facts
    frames = [Frame("torso", ROOT, _NOWHERE)]
    frames += [Frame(LINKS[joint.child], LINKS[joint.parent], joint.origin) for joint in body.fixed_joints]
    sole = (0.0, 0.0, -facts["dimensions"]["foot_height"])
    frames += [Frame(name, f"{name[0]}_ankle", sole) for name in SOLES]
    for camera in body.cameras:
        frames += _camera_frames(camera.name, "Head", camera.position, (0.0, camera.tilt, 0.0))
    frames.append(Frame("gaze", "Head", body.cameras[0].position))
    for part in ("accelerometer", "gyrometer"):
        frames.append(Frame(f"ImuTorso{part.capitalize()}_frame", "torso", _vector(facts["imu"][part])))
    for side in ("left", "right"):
        letter, sonar = side[0], facts["sonar"][side]
        place = _vector(sonar["position"]), _vector(sonar["rpy"])
        frames.append(Frame(f"{letter.upper()}Sonar_frame", "torso", *place))
        for sensor, position in facts["fsr"][side].items():
            corner = "".join(filter(str.isupper, sensor))  # FrontLeft: FL
            frames.append(Frame(f"{letter.upper()}Fsr{corner}_frame", f"{letter}_ankle", _vector(position)))
    for sensor, position in facts["touch"].items():
        name, parent = _touch_frame(sensor)
        frames.append(Frame(name, parent, _vector(position)))
    return frames


def outside_frames(camera: CameraDescription) -> list[Frame]:
    """Return the frames of a camera beside the robot: it stands still where the odometry began."""
    place = camera.posx, camera.posy, camera.posz
    return _camera_frames(camera.name, ODOM, place, (0.0, camera.tilt, OUTSIDE_YAW))


def _camera_frames(camera: str, parent: str, position: Vector, angles: Vector) -> list[Frame]:
    name = CAMERA_FRAMES[camera]
    body = Frame(f"{name}_frame", parent, position, angles)
    return [body, Frame(f"{name}_optical_frame", body.name, _NOWHERE, _OPTICAL)]


def _touch_frame(sensor: str) -> tuple[str, str]:
    """Return the frame of a touch sensor, and the link that carries it."""
    if sensor == "ChestButton":
        return "ChestButton_frame", "torso"
    if sensor.startswith("Head"):
        return f"HeadTouch{sensor.removeprefix('Head')}_frame", "Head"
    if sensor[1:].startswith("Hand"):
        return f"{sensor[:5]}Touch{sensor[5:]}_frame", f"{sensor[0].lower()}_wrist"
    return f"{sensor}_frame", f"{sensor[0].lower()}_ankle"


def urdf(body: Body) -> str:
    """Return the URDF of a body: links with masses and shapes, joints with limits, fixed frames.

    The shapes are the simple ones in the facts of the links, and lines from joint to joint, without meshes.
    """
    robot = ET.Element("robot", name=f"nao_{body.name.lower()}")
    material = ET.SubElement(robot, "material", name="shell")
    ET.SubElement(material, "color", rgba="0.92 0.92 0.94 1")
    ET.SubElement(robot, "link", name=ROOT)
    for link in body.links:
        _add_link(robot, body, link)
    leaders = {coupling.follower: coupling.leader for coupling in body.couplings}
    for joint in body.joints:
        _add_joint(robot, joint, leaders.get(joint.name))
    named = set(LINKS.values())
    for frame in fixed_frames(body):
        if frame.name not in named:
            ET.SubElement(robot, "link", name=frame.name)
        fixed = ET.SubElement(robot, "joint", name=f"{frame.name}_fixedjoint", type="fixed")
        _connect(fixed, frame.parent, frame.name, frame.position, frame.angles)
    ET.indent(robot)
    return ET.tostring(robot, "unicode", xml_declaration=True) + "\n"


def _add_link(robot: ET.Element, body: Body, link: Link) -> None:
    element = ET.SubElement(robot, "link", name=LINKS[link.name])
    moments = {name: getattr(link.inertia, name) for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")}
    if not link.mass:
        moments |= dict.fromkeys(("ixx", "iyy", "izz"), _LEAST_INERTIA)
    inertial = ET.SubElement(element, "inertial")
    _add_origin(inertial, link.com)
    ET.SubElement(inertial, "mass", value=_number(link.mass or _LEAST_MASS))
    ET.SubElement(inertial, "inertia", {name: _number(moment) for name, moment in moments.items()})
    for shape in _shapes(body, link.name):
        for kind in ("visual", "collision"):
            _add_shape(element, kind, shape)
    for joint in (*body.joints, *body.fixed_joints):
        if joint.parent == link.name and (length := math.hypot(*joint.origin)) > _BONE:
            x, y, z = joint.origin
            size = {"radius": _number(_BONE), "length": _number(length)}
            bone = (x / 2, y / 2, z / 2), _turn_to(joint.origin), "cylinder", size
            _add_shape(element, "visual", bone)


def _shapes(body: Body, link: str) -> Iterator[Shape]:
    """Yield the simple shapes of a link."""
    for shape in body.facts["self_collision_shapes"]["shapes"]:
        if shape["link"] != link:
            continue
        place, size = _vector(shape["pos"]), [_number(part) for part in shape["size"]]
        if shape["type"] == "sphere":
            yield place, _NOWHERE, "sphere", {"radius": size[0]}
        elif shape["type"] == "box":
            yield place, _NOWHERE, "box", {"size": " ".join(size)}
        else:
            yield place, _turn_to(shape["axis"]), "cylinder", {"radius": size[0], "length": size[1]}


def _add_shape(link: ET.Element, kind: str, shape: Shape) -> None:
    place, angles, tag, attributes = shape
    element = ET.SubElement(link, kind)
    _add_origin(element, place, angles)
    ET.SubElement(ET.SubElement(element, "geometry"), tag, attributes)
    if kind == "visual":
        ET.SubElement(element, "material", name="shell")


def _add_joint(robot: ET.Element, joint: Joint, leader: str | None) -> None:
    element = ET.SubElement(robot, "joint", name=joint.name, type="revolute")
    _connect(element, LINKS[joint.parent], LINKS[joint.child], joint.origin)
    ET.SubElement(element, "axis", xyz=_text(joint.axis))
    limits = {
        "lower": joint.lower,
        "upper": joint.upper,
        "velocity": joint.max_velocity,
        "effort": joint.max_torque,
    }
    ET.SubElement(element, "limit", {name: _number(value) for name, value in limits.items()})
    if leader is not None:
        ET.SubElement(element, "mimic", joint=leader)


def _connect(
    joint: ET.Element, parent: str, child: str, position: Sequence[float], angles: Vector = _NOWHERE
) -> None:
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    _add_origin(joint, position, angles)


def _add_origin(element: ET.Element, position: Sequence[float], angles: Vector = _NOWHERE) -> None:
    ET.SubElement(element, "origin", xyz=_text(position), rpy=_text(angles))


def _turn_to(axis: Sequence[float]) -> Vector:
    """Return roll, pitch and yaw that turn z to an axis."""
    x, y, z = axis
    return 0.0, math.atan2(math.hypot(x, y), z), math.atan2(y, x)


def _vector(numbers: Sequence[Any]) -> Vector:
    x, y, z = map(float, numbers)
    return x, y, z


def _text(numbers: Sequence[float]) -> str:
    return " ".join(map(_number, numbers))


def _number(value: float) -> str:
    return f"{value:.9g}"
