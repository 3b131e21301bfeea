"""What parts of a body must have to belong together."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Final

import msgspec

from naoserver.errors import RobotError
from naoserver.parts import CORNERS, Shape, Wheels

if TYPE_CHECKING:
    from naoserver.body import Body


_SIZES: Final = {"box": 3, "ellipsoid": 3, "sphere": 1, "capsule": 2, "cylinder": 2}
"""The number of sizes of each kind of shape."""


def check(body: Body) -> None:
    """Raise RobotError unless the parts of a body belong together, and all figures are finite."""
    links = [link.name for link in body.links]
    joints = [joint.name for joint in body.joints]
    _require_distinct("link", links)
    _require_distinct("joint", [*joints, *(joint.name for joint in body.fixed_joints)])
    _require_tree(body, links)
    for joint in (*body.joints, *body.fixed_joints):
        if not math.isclose(math.hypot(*joint.axis), 1.0, abs_tol=1e-6):
            raise RobotError(f"joint {joint.name}: its axis {joint.axis} is no unit vector")
        if not math.isclose(math.hypot(*joint.turn), 1.0, abs_tol=1e-4):
            raise RobotError(f"joint {joint.name}: its turn {joint.turn} is no unit quaternion")
        if not joint.lower <= joint.upper:
            raise RobotError(f"joint {joint.name}: its range from {joint.lower} to {joint.upper} is empty")
        if joint.gear and joint.gear not in body.gears:
            raise RobotError(f"joint {joint.name}: there is no gear {joint.gear!r}")
    for what, names in _named_joints(body):
        for name in names:
            if name not in body.joint:
                raise RobotError(f"{what}: there is no joint {name!r}")
    for what, name in _named_links(body):
        if name not in links:
            raise RobotError(f"{what}: there is no link {name!r}")
    for name, posture in body.postures.items():
        if missing := sorted(set(joints) - posture.angles.keys()):
            raise RobotError(f"posture {name}: no angle of {missing[0]}")
    if body.rest and body.rest not in body.postures:
        raise RobotError(f"rest: there is no posture {body.rest!r}")
    for shape in body.shapes:
        _require_sizes(shape)
    if isinstance(body.walk, Wheels):
        _require_fast_wheels(body, body.walk)
    if len(body.soles) not in (0, 2):
        raise RobotError(f"soles: {len(body.soles)} soles; a body has a left and a right one, or none")
    for sole in body.soles:
        if sole.pressure and sole.pressure.keys() != CORNERS:
            raise RobotError(
                f"sole of {sole.link}: its pressure sensors are not {', '.join(sorted(CORNERS))}"
            )
    _require_finite(body.name, msgspec.to_builtins(body))


def _require_fast_wheels(body: Body, wheels: Wheels) -> None:
    """Raise RobotError when the motors of the wheels cannot drive as fast as the body says."""
    for name in (wheels.left, wheels.right):
        highest = body.joint[name].max_velocity * wheels.radius
        if highest < wheels.fastest:
            raise RobotError(
                f"walk: its fastest is {wheels.fastest:g} m/s, but joint {name} turns for {highest:g} m/s"
            )


def _require_sizes(shape: Shape) -> None:
    wanted = 1 if shape.ends else _SIZES[shape.kind]
    if len(shape.size) != wanted:
        raise RobotError(f"a {shape.kind} of {shape.link}: {len(shape.size)} sizes instead of {wanted}")


def _require_distinct(what: str, names: Sequence[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise RobotError(f"{what} {name}: there are two of this name")


def _require_tree(body: Body, links: Sequence[str]) -> None:
    """Raise RobotError unless joints carry each link but the first, and each after its parent."""
    carried: dict[str, str] = {}
    for joint in (*body.joints, *body.fixed_joints):
        for link in (joint.parent, joint.child):
            if link not in links:
                raise RobotError(f"joint {joint.name}: there is no link {link!r}")
        if joint.child in carried:
            raise RobotError(f"joint {joint.name}: {joint.child} is moved by {carried[joint.child]}, too")
        carried[joint.child] = joint.name
        if links.index(joint.parent) >= links.index(joint.child):
            raise RobotError(
                f"joint {joint.name}: {joint.child} must come after {joint.parent}, which carries it"
            )
    if links[0] in carried:
        raise RobotError(f"link {links[0]}: the first link is the root, but {carried[links[0]]} moves it")
    for link in links[1:]:
        if link not in carried:
            raise RobotError(f"link {link}: no joint carries it")


def _named_joints(body: Body) -> Iterable[tuple[str, Iterable[str]]]:
    """Yield the names of joints that parts of a body mention, with what mentions them."""
    for pair in body.couplings:
        yield "coupling", (pair.leader, pair.follower)
    for table in body.tables:
        yield "table", (table.independent, table.dependent)
    for rule in body.speed_rules:
        yield "speed rule", (*rule.slower, *rule.while_below)
    for name, names in msgspec.structs.asdict(body.groups).items():
        if isinstance(names, tuple):
            yield f"group {name}", names
    for name, axes in body.hinges.items():
        yield f"hinge {name}", (axis.joint for axis in axes.values())
    for name, posture in body.postures.items():
        yield f"posture {name}", posture.angles
    if isinstance(body.walk, Wheels):
        yield "walk", (body.walk.left, body.walk.right)


def _named_links(body: Body) -> Iterable[tuple[str, str]]:
    """Yield the names of links that parts of a body mention, with what mentions them."""
    for camera in body.cameras:
        yield f"camera {camera.name}", camera.link
    for name, place in (*body.effectors.items(), *body.touch.items()):
        yield name, place.link
    for sole in body.soles:
        yield "sole", sole.link
    for shape in body.shapes:
        yield "shape", shape.link
    for link in body.intangible:
        yield "intangible", link
    for pair in body.overlapping:
        for link in pair:
            yield "overlapping", link


def _require_finite(path: str, value: object) -> None:
    """Raise RobotError for a number that is nan or, except a joint's range, infinite."""
    if isinstance(value, float) and not math.isfinite(value):
        if math.isnan(value) or path.rsplit(".", 1)[-1] not in ("lower", "upper"):
            raise RobotError(f"{path} is {value}: it must be a finite number")
    elif isinstance(value, Mapping):
        for key, item in value.items():
            _require_finite(f"{path}.{key}", item)
    elif isinstance(value, (list, tuple)):
        for index, item in enumerate(value):
            _require_finite(f"{path}[{index}]", item)
