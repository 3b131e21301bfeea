"""The frames of the links and sensors of a body in ROS, and its URDF.

Frames have the names that the body's description gives them there, for the Nao those of naoqi_driver2. REP
120 (Coordinate Frames for Humanoid Robots) defines `base_link`, `torso`, `gaze`, `l_sole` and `r_sole`. Axes
are those of REP 103: x forward, y left, z up; of optical frames z forward, x right, y down. The URDF has
links with masses and simple shapes, joints with limits and fixed frames, no meshes.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final
from xml.etree import ElementTree as ET

from interfaces.jderobot import CameraDescription
from naoserver.bodies.body import Body
from naoserver.bodies.capabilities import Vector
from naoserver.bodies.kinematics import angles_of, turned
from naoserver.bodies.parts import NOWHERE, Camera, Coupling, Joint, Link, Shape, Sole

ODOM: Final = "odom"
"""The frame of the odometry: the place at which it began."""
ROOT: Final = "base_link"
"""The root of the tree: the frame of the body's root link."""
FOOTPRINT: Final = "base_footprint"
"""The place on the floor between the soles, or below the root, with the heading of the root."""
SOLES: Final = ("l_sole", "r_sole")
GAZE: Final = "gaze"
OUTSIDE: Final = "CameraOutside"
"""The camera beside the robot."""
OUTSIDE_YAW: Final = math.radians(113)
"""Its yaw in `odom`, which its description lacks; a simulation places it (surroundings.py)."""
_OPTICAL: Final = (-math.pi / 2, 0.0, -math.pi / 2)


@dataclass(frozen=True, slots=True)
class FixedFrame:
    """A frame that is fixed to another."""

    name: str
    parent: str
    position: Vector
    """In the parent's frame in m."""
    angles: Vector = NOWHERE
    """Roll, pitch and yaw in rad: about the parent's fixed x, then y, then z axis."""


def link_frames(body: Body) -> Mapping[str, str]:
    """Return the frame of each link, by the link's name; no two are equal, nor one of the robot's own."""
    names: dict[str, str] = {}
    taken = {ODOM, FOOTPRINT}
    for link in body.links:
        name = link.ros_name or link.name
        while name in taken or (name == ROOT and link is not body.root):
            name += "_"
        taken.add(name)
        names[link.name] = name
    return names


def fixed_frames(body: Body) -> list[FixedFrame]:
    """Return the frames that never move, each after its parent.

    One that has the name of a link is left out: that link is it.
    """
    links = link_frames(body)
    root = links[body.root.name]
    frames = [FixedFrame(root, ROOT, NOWHERE)] if root != ROOT else []
    frames += [
        FixedFrame(links[joint.child], links[joint.parent], joint.origin, angles_at_rest(joint))
        for joint in body.fixed_joints
    ]
    taken = {ODOM, ROOT, FOOTPRINT, *links.values()}
    for frame in _sensor_frames(body, links):
        if frame.name not in taken:
            taken.add(frame.name)
            frames.append(frame)
    return frames


def angles_at_rest(joint: Joint) -> Vector:
    """Return roll, pitch and yaw of a joint's frame in its parent's, at the angle 0."""
    return angles_of(turned(joint.turn))


def camera_frame(camera: Camera | None, name: str) -> str:
    """Return the beginning of the frames of a camera; `camera` is None for one that is not on the body."""
    return (camera.ros_name if camera else None) or name


def optical_frame(camera: str) -> str:
    """Return the frame of a camera's images, by the beginning of its frames."""
    return f"{camera}_optical_frame"


def outside_frames(camera: CameraDescription) -> list[FixedFrame]:
    """Return the frames of a camera beside the robot: it stands still where the odometry began."""
    place = camera.posx, camera.posy, camera.posz
    return list(_camera_frames(camera.name, ODOM, place, (0.0, camera.tilt, OUTSIDE_YAW)))


def _camera_frames(name: str, parent: str, position: Vector, angles: Vector) -> Iterator[FixedFrame]:
    yield FixedFrame(f"{name}_frame", parent, position, angles)
    yield FixedFrame(optical_frame(name), f"{name}_frame", NOWHERE, _OPTICAL)


def _sensor_frames(body: Body, links: Mapping[str, str]) -> Iterator[FixedFrame]:
    """Yield the frames of soles and sensors, each after its parent."""
    for name, sole in zip(SOLES, body.soles, strict=False):
        yield FixedFrame(name, links[sole.link], (0.0, 0.0, -sole.height))
    for camera in body.cameras:
        name = camera_frame(camera, camera.name)
        yield from _camera_frames(name, links[camera.link], camera.position, (0.0, camera.tilt, 0.0))
    if body.cameras and body.neck is not None:
        yield FixedFrame(GAZE, links[body.cameras[0].link], body.cameras[0].position)
    if (unit := body.inertial_unit) is not None:
        root = links[body.root.name]
        yield FixedFrame("ImuTorsoAccelerometer_frame", root, unit.accelerometer)
        yield FixedFrame("ImuTorsoGyrometer_frame", root, unit.gyrometer)
    for side, place in (("L", body.sonar.left), ("R", body.sonar.right)) if body.sonar else ():
        yield FixedFrame(f"{side}Sonar_frame", links[place.link], place.position, place.angles)
    for side, sole in zip("LR", body.soles, strict=False):
        yield from _pressure_frames(side, sole, links[sole.link])
    for sensor, place in body.touch.items():
        yield FixedFrame(f"{place.ros_name or sensor}_frame", links[place.link], place.position, place.angles)


def _pressure_frames(side: str, sole: Sole, link: str) -> Iterator[FixedFrame]:
    for sensor, position in sole.pressure.items():
        corner = "".join(filter(str.isupper, sensor))  # FrontLeft: FL
        yield FixedFrame(f"{side}Fsr{corner}_frame", link, position)


_BONE: Final = 0.018
"""Radius in m of the cylinders that are drawn between joints, in addition to the shapes of the body."""
_LEAST_MASS, _LEAST_INERTIA = 1e-5, 1e-8
"""For parts that have no mass or inertia, in kg and kg m2: simulators need some."""
_FAR: Final = 1e6
"""The end in m of a range without one, for which URDF has no word."""

Form = tuple[Vector, Vector, str, dict[str, str]]
"""A shape of a link: place in m, roll, pitch and yaw in rad, tag and attributes of its geometry."""


def urdf(body: Body, prefix: str = "") -> str:
    """Return the URDF of a body, whose links' names begin with a prefix, as its frames do.

    The shapes are those with which it touches things, and lines from joint to joint.
    """
    robot = ET.Element("robot", name=re.sub(r"\W+", "_", (body.title or body.name).lower()))
    material = ET.SubElement(robot, "material", name="shell")
    ET.SubElement(material, "color", rgba="0.92 0.92 0.94 1")
    links = link_frames(body)
    if ROOT not in links.values():
        ET.SubElement(robot, "link", name=ROOT)
    for link in body.links:
        _add_link(robot, body, link, links[link.name])
    for joint in body.joints:
        _add_joint(robot, joint, links, body.following.get(joint.name))
    named = set(links.values())
    for frame in fixed_frames(body):
        if frame.name not in named:
            ET.SubElement(robot, "link", name=frame.name)
        fixed = ET.SubElement(robot, "joint", name=f"{frame.name}_fixedjoint", type="fixed")
        _connect(fixed, frame.parent, frame.name, frame.position, frame.angles)
    for element in robot.iter():
        if (key := {"link": "name", "parent": "link", "child": "link"}.get(element.tag)) is not None:
            element.set(key, prefix + element.attrib[key])
    ET.indent(robot)
    return ET.tostring(robot, "unicode", xml_declaration=True) + "\n"


def _add_link(robot: ET.Element, body: Body, link: Link, name: str) -> None:
    element = ET.SubElement(robot, "link", name=name)
    moments = {name: getattr(link.inertia, name) for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")}
    moments |= {name: max(moments[name], _LEAST_INERTIA) for name in ("ixx", "iyy", "izz")}
    inertial = ET.SubElement(element, "inertial")
    _add_origin(inertial, link.com)
    ET.SubElement(inertial, "mass", value=_number(link.mass or _LEAST_MASS))
    ET.SubElement(inertial, "inertia", {name: _number(moment) for name, moment in moments.items()})
    for shape in body.shapes:
        if shape.link == link.name:
            for kind in ("visual", "collision"):
                _add_form(element, kind, _form(shape))
    for bone in _bones(body, link):
        _add_form(element, "visual", bone)


def _bones(body: Body, link: Link) -> Iterator[Form]:
    """Yield the lines from a link to the joints that it carries."""
    for joint in (*body.joints, *body.fixed_joints):
        if joint.parent == link.name and (length := math.hypot(*joint.origin)) > _BONE:
            x, y, z = joint.origin
            yield (x / 2, y / 2, z / 2), _turn_to(joint.origin), "cylinder", _cylinder(_BONE, length)


def _form(shape: Shape) -> Form:
    """Return a shape as URDF has it: a capsule as a cylinder as long, hull and ellipsoid as boxes around."""
    shape = shape.boxed()
    angles, size = angles_of(turned(shape.turn)), shape.size
    if shape.kind == "sphere":
        return shape.position, angles, "sphere", {"radius": _number(size[0])}
    if shape.kind in ("box", "ellipsoid"):
        return shape.position, angles, "box", {"size": _text([2.0 * part for part in size])}
    if shape.ends is None:
        reach = size[1] + (size[0] if shape.kind == "capsule" else 0.0)
        return shape.position, angles, "cylinder", _cylinder(size[0], 2.0 * reach)
    begin, end = shape.ends
    x, y, z = ((first + last) / 2 for first, last in zip(begin, end, strict=True))
    along = [last - first for first, last in zip(begin, end, strict=True)]
    return (x, y, z), _turn_to(along), "cylinder", _cylinder(size[0], math.hypot(*along) + 2.0 * size[0])


def _cylinder(radius: float, length: float) -> dict[str, str]:
    return {"radius": _number(radius), "length": _number(length)}


def _add_form(link: ET.Element, kind: str, form: Form) -> None:
    place, angles, tag, attributes = form
    element = ET.SubElement(link, kind)
    _add_origin(element, place, angles)
    ET.SubElement(ET.SubElement(element, "geometry"), tag, attributes)
    if kind == "visual":
        ET.SubElement(element, "material", name="shell")


def _add_joint(robot: ET.Element, joint: Joint, links: Mapping[str, str], pair: Coupling | None) -> None:
    endless = not joint.sliding and math.isinf(joint.upper - joint.lower)
    kind = "prismatic" if joint.sliding else "continuous" if endless else "revolute"
    element = ET.SubElement(robot, "joint", name=joint.name, type=kind)
    _connect(element, links[joint.parent], links[joint.child], joint.origin, angles_at_rest(joint))
    ET.SubElement(element, "axis", xyz=_text(joint.axis))
    limits = {"velocity": joint.max_velocity, "effort": joint.max_torque}
    if not endless:
        limits |= {"lower": max(joint.lower, -_FAR), "upper": min(joint.upper, _FAR)}
    ET.SubElement(element, "limit", {name: _number(value) for name, value in limits.items()})
    if pair is not None:
        ratio, offset = _number(pair.ratio), _number(pair.offset)
        ET.SubElement(element, "mimic", joint=pair.leader, multiplier=ratio, offset=offset)


def _connect(joint: ET.Element, parent: str, child: str, position: Sequence[float], angles: Vector) -> None:
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    _add_origin(joint, position, angles)


def _add_origin(element: ET.Element, position: Sequence[float], angles: Vector = NOWHERE) -> None:
    ET.SubElement(element, "origin", xyz=_text(position), rpy=_text(angles))


def _turn_to(axis: Sequence[float]) -> Vector:
    """Return roll, pitch and yaw that turn z to an axis."""
    x, y, z = axis
    return 0.0, math.atan2(math.hypot(x, y), z), math.atan2(y, x)


def _text(numbers: Sequence[float]) -> str:
    return " ".join(map(_number, numbers))


def _number(value: float) -> str:
    return f"{value:.9g}"
