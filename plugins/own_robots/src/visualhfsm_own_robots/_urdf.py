"""What a URDF says beside what MuJoCo reads, and a URDF that MuJoCo reads: checked, and with repairs."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from typing import Final, Literal, NamedTuple

from naoserver.bodies.parts import MOST_PARTS
from naoserver.errors import RobotError
from naoserver_sim.appearance import NO_COLOR
from visualhfsm_own_robots._meshes import Files
from visualhfsm_own_robots._tree import Element, Fault, number, numbers, refuse

_TYPES: Final = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
TENSOR: Final = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
_NUMBERS: Final = {
    *("lower", "upper", "effort", "velocity", "damping", "friction", "multiplier", "offset"),
    *("value", *TENSOR),
}
"""Attributes that have numbers which MuJoCo does not check, or that an exporter leaves empty."""
_ENDS: Final = ("lower", "upper")
_SHAPES: Final = ("box", "cylinder", "capsule", "sphere", "mesh")
"""The geometries that MuJoCo reads."""
_MOVING: Final = ("revolute", "continuous", "prismatic")
"""The types of joints that another one can lead."""
_READ: Final = {"robot": ("link", "joint", "material"), "link": ("inertial", "visual", "collision")}
"""The elements of which MuJoCo reads something."""
COMPILER: Final = re.compile(
    "angle|coordinate|eulerseq|autolimits|inertiafromgeom|inertiagrouprange|settotalmass|alignfree|fitaabb"
    "|(balance|bound)(mass|inertia)"
)
"""Options of MuJoCo's compiler that a model may set; others are about files, and about speed."""
MOUNT: Final = "mount"
"""The name of a link that stands for the world."""
_ONCE: Final = {
    "link": ("inertial",),
    "inertial": ("origin", "mass", "inertia"),
    "visual": ("origin", "geometry", "material"),
    "collision": ("origin", "geometry"),
    "geometry": _SHAPES,
    "material": ("color",),
    "joint": ("origin", "parent", "child", "axis", "limit", "dynamics", "mimic"),
}
"""The elements that an element has once: urdfdom takes the first, MuJoCo refuses a second."""


class Sensor(NamedTuple):
    """A camera or an inertial unit that a URDF's `<gazebo>` or `<sensor>` elements name."""

    kind: Literal["camera", "imu"]
    name: str
    link: str
    pose: tuple[float, ...] = (0.0,) * 6
    """Place in m, and roll, pitch and yaw in rad, in the link's frame."""
    horizontal_fov: float | None = None
    """Of a camera, in rad; None where the file does not say it, or nothing that a lens has."""


def speeds_of(root: Element) -> dict[str, float]:
    """Return the highest speed of each joint that says one. Raises RobotError for what is no number."""
    limits = [(joint.name, limit) for joint in root.within("joint") for limit in joint.within("limit")]
    said = {name: numbers(limit, "velocity")[0] for name, limit in limits if limit.get("velocity").strip()}
    return {name: speed for name, speed in said.items() if speed > 0.0}


def is_fixed(root: Element) -> bool:
    """Return whether a link `world` carries the robot, by a joint that does not let it float."""
    holding = [joint for joint in root.within("joint") if joint.get("type") != "floating"]
    carriers = {parent.get("link") for joint in holding for parent in joint.within("parent")}
    return "world" in carriers - {child.get("link") for child in root.within("joint", "child")}


def actuated_in(root: Element) -> frozenset[str]:
    """Return the joints that transmissions and `<ros2_control>` drive."""
    driven = {joint.name for joint in root.within("transmission", "joint")}
    controlled = root.within("ros2_control", "joint")
    return frozenset(driven | {each.name for each in controlled if any(each.within("command_interface"))})


def sensors_in(root: Element) -> Iterator[Sensor]:
    """Yield the cameras and inertial units."""
    links = {link.name for link in root.within("link")}
    nothing = Element("", {}, root.source, 0)
    for holder in root.children:
        for sensor in holder.all("sensor") if holder.tag in ("gazebo", "sensor", "link") else ():
            parts: dict[str, Element] = defaultdict(lambda: nothing)
            # Its own elements count before those within others, and of these the first.
            parts |= {part.tag: part for part in (*reversed(list(sensor.all())), *sensor.children)}
            link = parts["parent"].get("link") or holder.get("reference") or holder.name
            kind = sensor.get("type").lower()
            if link not in links or not ("imu" in kind or "camera" in kind or "camera" in parts):
                continue
            place = parts["pose"].text
            if "origin" in parts:
                place = " ".join(parts["origin"].get(name, "0 0 0") for name in ("xyz", "rpy"))
            pose = tuple(number(word) or 0.0 for word in place.split())
            if parts["pose"].get("degrees") in ("true", "1") and "origin" not in parts:
                pose = (*pose[:3], *map(math.radians, pose[3:]))
            pose = pose if len(pose) == 6 and all(map(math.isfinite, pose)) else (0.0,) * 6
            width = number(parts["horizontal_fov"].text or parts["image"].get("hfov")) or 0.0
            angle = width if 0.0 < width < math.pi else None
            yield Sensor("imu" if "imu" in kind else "camera", sensor.name, link, pose, angle)


def prepare(root: Element, files: Files, notes: list[str]) -> None:
    """Change the tree of a URDF to what MuJoCo reads, and note repairs.

    Raises RobotError, with file and line, for faults that have no repair.
    """
    folder = _set_options(root)
    for element in [root, *root.within("link")]:
        known = _READ[element.tag]
        element.children = [each for each in element.children if each.tag in known or each.tag == "mujoco"]
    _keep_first(root, notes)
    for element in root.all():  # what an exporter leaves empty
        said = element.attributes.items()
        element.attributes = {name: text for name, text in said if text.strip() or name not in _NUMBERS}
    refuse(_faults(root))
    _keep_leaders(root, notes)
    _root_it(root, notes)
    for joint in root.within("joint"):
        _settle(joint, notes)
    root.remove_where(
        lambda each: each.tag == "inertial" and not any(m.attributes for m in each.within("mass"))
    )
    _weigh_nothing(root)
    for inertial in root.within("link", "inertial"):
        tensor = next(inertial.within("inertia"), None) or inertial.add("inertia")
        tensor.attributes = dict.fromkeys(TENSOR, "0") | tensor.attributes
    for place, material in enumerate(root.all("material")):
        material.attributes["name"] = material.name or f"material {place}"
        for color in [each for each in material.children if len(each.get("rgba").split()) != 4]:
            material.children.remove(color)
            if rgba := color.get("rgba"):
                notes.append(f"{color.at}: a color is left out: its rgba is {rgba[:60]!r}, not 4 numbers")
    _color(root)
    _keep_shapes(root, files, folder, notes)


def _set_options(root: Element) -> str:
    """Merge the options for MuJoCo, and set ours; return the folder in which they say that meshes are."""
    given: dict[str, str] = {}
    for compiler in root.within("mujoco", "compiler"):
        given |= compiler.attributes
    root.remove_where(lambda each: each.tag == "mujoco")
    ours = {"fusestatic": "false", "discardvisual": "false", "strippath": "false"}
    kept = {name: value for name, value in given.items() if COMPILER.fullmatch(name)}
    root.add("mujoco").add("compiler", **kept, **ours)
    root.children.insert(0, root.children.pop())
    return given.get("meshdir", given.get("assetdir", ""))


def _keep_first(root: Element, notes: list[str]) -> None:
    """Leave the first of elements that belong into another one once, as urdfdom, the reader of ROS, does."""
    second = []
    for parent in root.all(*_ONCE):
        first: dict[str, Element] = {}
        for child in [each for each in parent.children if each.tag in _ONCE[parent.tag]]:
            kind = "shape" if parent.tag == "geometry" else child.tag
            if first.setdefault(kind, child) is not child:
                second.append(f"{child.at}: a second <{child.tag}> in one <{parent.tag}>")
                parent.children.remove(child)
    if second:
        more = f", and {len(second) - 1} more such" if len(second) > 1 else ""
        notes.append(f"{second[0]}{more}: the first one counts")


def _faults(root: Element) -> Iterator[Fault]:
    """Yield what no robot has; each holds of what follows that what is before it was not found."""
    for element in root.all():
        if element.get("quat_xyzw"):
            yield element, "quat_xyzw is not read: write rpy in its place"
        for name in _NUMBERS & element.attributes.keys():
            # A value may be a word, as in <verbose value="Yes"/>.
            if (name != "value" or element.tag == "mass") and len(numbers(element, name)) > 1:
                yield element, f"{name} of <{element.tag}> is {element.get(name)[:60]!r}: write one number"
    parts: dict[tuple[str, str], Element] = {}
    for part in (*root.within("link"), *root.within("joint")):
        if not part.name:
            yield part, f'a {part.tag} without a name: write name="..."'
        first = parts.setdefault((part.tag, part.name), part)
        if first is not part:
            yield part, f"a second {part.tag} {part.name!r}; the first is in line {first.line}"
    links = [name for tag, name in parts if tag == "link"]
    if not 0 < len(links) <= MOST_PARTS:
        yield root, f"{len(links)} links; a robot has 1 to {MOST_PARTS}"
    above: dict[str, Element] = {}
    for joint in root.within("joint"):
        what, kind = f"joint {joint.name!r}", joint.get("type")
        if kind not in _TYPES:
            yield joint, f"{what} has the type {kind!r}; write one of {', '.join(_TYPES)}"
        for tag in ("parent", "child"):
            ends = list(joint.within(tag))
            if len(ends) != 1:
                yield joint, f"{what} has {len(ends)} elements <{tag}>: write <{tag} link=.../>"
            if (link := ends[0].get("link")) not in links:
                yield ends[0], f"{what}: there is no link {link!r}"
        if (other := above.setdefault(link, joint)) is not joint:
            yield ends[0], f"{link!r} is moved by {other.name!r} and by {joint.name!r}"
        for axis in joint.within("axis"):
            if kind != "fixed" and not any(numbers(axis, "xyz", "1 0 0")):
                yield axis, f"the axis of {what} is 0: write its direction"
    for link in links:
        way = [link]
        while way[-1] in above:
            joint = above[way[-1]]
            way.append(_end(joint, "parent"))
            if len(way) > len(above) + 1:
                yield joint, f"joint {joint.name!r} closes a circle of links"


def _keep_leaders(root: Element, notes: list[str]) -> None:
    """Let a joint move by itself that follows one that is not there, or does not move."""
    kinds = {joint.name: joint.get("type") for joint in root.within("joint")}
    for joint in root.within("joint"):
        for mimic in list(joint.within("mimic")):
            leader, why = mimic.get("joint"), ""
            if leader not in kinds:
                why = f"there is no joint {leader!r}"
            elif leader == joint.name or kinds[leader] not in _MOVING:
                why = "that is itself" if leader == joint.name else f"joint {leader!r} is {kinds[leader]}"
            if why:
                joint.children.remove(mimic)
            if why and joint.get("type") in _MOVING:
                notes.append(f"{mimic.at}: joint {joint.name!r} moves by itself, not after {leader!r}: {why}")


def _end(joint: Element, tag: str) -> str:
    """Return the link at an end of a joint."""
    return next(joint.within(tag)).get("link")


def _above(joints: Iterable[Element]) -> dict[str, str]:
    """Return the link that carries each link by some joints."""
    return {_end(joint, "child"): _end(joint, "parent") for joint in joints}


def _top(link: str, above: Mapping[str, str]) -> str:
    """Return the link that carries a link in the end."""
    while link in above:
        link = above[link]
    return link


def _root_it(root: Element, notes: list[str]) -> None:
    """Leave one tree of links, on a root that MuJoCo takes. Raises RobotError for two."""
    above = _above(root.within("joint"))
    tops: dict[str, list[Element]] = {}
    links = {link.name: link for link in root.within("link")}
    for name, link in links.items():
        tops.setdefault(_top(name, above), []).append(link)
    top = max(tops, key=lambda name: len(tops[name]))
    for name in [each for each in tops if each != top]:
        if len(tops[name]) > 1:
            trees = f"here are two, from {top!r} and {name!r}"
            raise RobotError(f"{links[name].at}: a robot is one tree of links; {trees}: add a joint")
        notes.append(f"{links[name].at}: link {name!r} is left out: no joint connects it to {top!r}")
        root.children.remove(links[name])
    _set_down(root, links[top], notes)


def _set_down(root: Element, link: Element, notes: list[str]) -> None:
    """Let the root stand as MuJoCo wants it, which calls the ground `world` and lets only roots float."""
    below = [joint for joint in root.within("joint") if _end(joint, "parent") == link.name]
    bare = not link.children and len(below) == 1
    for joint in root.within("joint"):
        if joint.get("type") == "floating" and not (bare and joint in below):
            raise RobotError(f"{joint.at}: joint {joint.name!r} floats: only the root of a robot may")
    if bare and below[0].get("type") == "floating":
        root.children.remove(link)
        root.children.remove(below[0])
    for world in [each for each in root.within("link") if each.name == "world"]:
        if world is link and bare and below[0].get("type") == "fixed":
            continue
        world.attributes["name"] = name = unused(MOUNT, root)
        notes.append(f"{world.at}: link 'world' is called {name!r}")
        for end in (*root.within("joint", "parent"), *root.within("joint", "child")):
            end.attributes["link"] = name if end.get("link") == "world" else end.get("link")


def unused(name: str, root: Element) -> str:
    """Return a name that no link or body has."""
    while any(part.name == name for part in root.all("link", "body")):
        name += "_"
    return name


def _settle(joint: Element, notes: list[str]) -> None:
    """Give a joint the range that MuJoCo takes for that of the file."""
    for axis in joint.within("axis"):
        axis.attributes.setdefault("xyz", "1 0 0")
    if joint.get("type") == "planar":  # which has no limits, but MuJoCo gives them to the first of its slides
        joint.children = [each for each in joint.children if each.tag != "limit"]
    for limit in list(joint.within("limit")) or [joint.add("limit")]:
        lower, upper = sorted(numbers(limit, name, "0")[0] for name in _ENDS)
        if lower == upper:  # as exporters write it that know no range
            if joint.get("type") in ("revolute", "prismatic"):
                notes.append(f"{limit.at}: joint {joint.name!r} has no range, so it moves without end")
            limit.attributes = {name: text for name, text in limit.attributes.items() if name not in _ENDS}
            continue
        # Both are written: an end that is left out is 0, but MuJoCo takes a range with one end for none.
        limit.attributes |= {"lower": str(lower), "upper": str(upper)}


def _weigh_nothing(root: Element) -> None:
    """Give a link without a mass none if it is fixed to one with a mass; others weigh as their shapes do."""
    above = _above(joint for joint in root.within("joint") if joint.get("type") == "fixed")
    weighed = {_top(link.name, above) for link in root.within("link") if any(link.within("inertial"))}
    for link in root.within("link"):
        if _top(link.name, above) in weighed and not any(link.within("inertial")):
            link.add("inertial").add("mass", value="0")


def _color(root: Element) -> None:
    """Give each visual the color of the first material that is called as its material is, as urdfdom does."""
    visuals = list(root.within("link", "visual"))
    colors: dict[str, list[Element]] = {}
    for material in (*root.within("material"), *(each for of in visuals for each in of.within("material"))):
        colors[material.name] = colors.get(material.name) or list(material.within("color"))
    for visual in visuals:
        for material in list(visual.within("material")):
            material.children = colors[material.name]
            if not material.children:
                visual.children.remove(material)


def _keep_shapes(root: Element, files: Files, folder: str, notes: list[str]) -> None:
    """Leave the shapes that MuJoCo can read, with their meshes and the colors of these."""
    for link in root.within("link"):
        for shape in [each for each in link.children if each.tag != "inertial"]:
            shape.attributes.clear()  # a name, which need not be the only one
            solid = next((each for tag in _SHAPES for each in shape.within("geometry", tag)), None)
            color, fit = NO_COLOR, solid is not None
            if solid is None:
                what = f"{shape.at}: a <{shape.tag}> of link {link.name!r} is left out"
                notes.append(f"{what}: it has none of {', '.join(_SHAPES)}")
            elif solid.tag == "mesh":
                found = files.mesh(solid.get("filename"), solid.source, folder)
                if fit := found is not None:
                    solid.attributes["filename"], color = found[0], found[1].color or NO_COLOR
            if not fit:
                link.children.remove(shape)
            elif shape.tag == "visual" and not any(shape.within("material")):
                rgba = " ".join(map(str, color))  # else MuJoCo gives it that of the visual before it
                shape.add("material", name=f"color {rgba}").add("color", rgba=rgba)
