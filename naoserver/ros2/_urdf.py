"""The URDF of a body: links with masses and simple shapes, joints with limits, fixed frames, no meshes."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Final
from xml.etree import ElementTree as ET

from naoserver.body import Body
from naoserver.capabilities import Vector
from naoserver.kinematics import angles_of, turned
from naoserver.parts import NOWHERE, Coupling, Joint, Link, Shape

from ._frames import ROOT, angles_at_rest, fixed_frames, link_frames

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
