"""What parts of a body must have to belong together."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import chain
from typing import Final

import msgspec

from naoserver.bodies import parts
from naoserver.bodies._facts import Facts
from naoserver.bodies.footsteps import Footsteps
from naoserver.errors import RobotError

_FEWEST_POINTS: Final = 4
"""Of a hull: those of a tetrahedron."""
_MAY_BE_PASSIVE: Final = ("coupling", "posture")
"""What may name a joint without a motor."""
_ROUNDING: Final = 1e-6
"""Distance in rad or m that may be due to rounding."""


def check(body: Facts) -> None:
    """Raise RobotError unless the parts of a body belong together, and all figures are finite."""
    links = [link.name for link in body.links]
    _require_distinct("link", links)
    _require_distinct("joint", [joint.name for joint in (*body.joints, *body.fixed_joints)])
    _require_distinct("camera", [camera.name for camera in body.cameras])
    _require_distinct("shape", [shape.name for shape in body.shapes if shape.name])
    _require_tree(body, links)
    for joint in (*body.joints, *body.fixed_joints):
        _require_sound(joint, body)
    _require_known_joints(body)
    known = set(links)
    for what, name in _named_links(body):
        if name not in known:
            raise RobotError(f"{what}: there is no link {name!r}")
    _require_one_pair("coupling", [(pair.leader, pair.follower) for pair in body.couplings])
    for pair in body.couplings:
        _require_agreement(pair, body)
    _require_one_pair("table", [(table.independent, table.dependent) for table in body.tables])
    for table in body.tables:
        joint = body.joint[table.dependent]
        for angle, lower, upper in table.rows:
            if lower > joint.upper or upper < joint.lower:
                raise RobotError(f"range table of {joint.name}: at {angle} rad it is outside its own range")
    _require_whole_postures(body)
    for shape in body.shapes:
        _require_sizes(shape)
    for camera in body.cameras:
        if len(camera.sizes) != len(camera.rates):
            sizes, rates = len(camera.sizes), len(camera.rates)
            raise RobotError(f"camera {camera.name}: {sizes} sizes, but {rates} rates")
    _require_soles(body)
    for name, kick in body.kicks.items():
        for axis, (lower, upper) in (("x", kick.x), ("y", kick.y)):
            if not lower < upper:
                raise RobotError(f"kick {name}: its {axis} from {lower:g} to {upper:g} is empty")
    if isinstance(body.walk, parts.Wheels):
        _require_fast_wheels(body, body.walk)
    _require_finite(body.name, body.as_data())


def _require_sound(joint: parts.Joint, body: Facts) -> None:
    """Raise RobotError for a joint, fixed or not, that cannot be."""
    what = f"joint {joint.name}"
    if not math.isclose(math.hypot(*joint.axis), 1.0, abs_tol=1e-6):
        raise RobotError(f"{what}: its axis {joint.axis} is no unit vector")
    if not math.isclose(math.hypot(*joint.turn), 1.0, abs_tol=1e-4):
        raise RobotError(f"{what}: its turn {joint.turn} is no unit quaternion")
    if not joint.lower <= joint.upper:
        raise RobotError(f"{what}: its range from {joint.lower} to {joint.upper} is empty")
    if joint.gear and joint.gear not in body.gears:
        raise RobotError(f"{what}: there is no gear {joint.gear!r}")
    if joint.name not in body.joint:
        return
    if not (joint.max_velocity > 0.0 and joint.max_torque >= 0.0):
        raise RobotError(
            f"{what}: its highest velocity must be above 0, and so must its torque, or 0 if it has no motor"
        )
    if joint.gear and joint.name in body.motors and body.gears[joint.gear].stiffness == 0.0:
        raise RobotError(f"{what}: its gear {joint.gear!r} has the stiffness 0: it would hold nothing")


def _require_known_joints(body: Facts) -> None:
    """Raise RobotError when a part mentions a joint that is not there, or one joint twice."""
    for what, named in _named_joints(body):
        for name, times in Counter(iter(named)).items():
            if name not in body.joint:
                raise RobotError(f"{what}: there is no joint {name!r}")
            if body.joint[name].passive and not what.startswith(_MAY_BE_PASSIVE):
                raise RobotError(
                    f"{what}: {name} has no motor (max_torque = 0): give it one, or leave it out"
                )
            if times > 1:
                raise RobotError(f"{what}: {name} is there twice")


def _require_whole_postures(body: Facts) -> None:
    for name, posture in body.postures.items():
        named = {joint.name for joint in body.joints if not joint.passive}
        if missing := sorted(named - posture.angles.keys()):
            raise RobotError(f"posture {name}: no angle of {missing[0]}")
    if body.rest and body.rest not in body.postures:
        raise RobotError(f"rest: there is no posture {body.rest!r}")


def _require_soles(body: Facts) -> None:
    """Raise RobotError unless a body has two soles or none, and those that its walk needs."""
    if isinstance(body.walk, parts.Steps | Footsteps) and not body.soles:
        raise RobotError("walk: it takes steps, but the body has no soles")
    if len(body.soles) not in (0, 2):
        raise RobotError(f"soles: {len(body.soles)} soles; a body has a left and a right one, or none")
    for sole in body.soles:
        if sole.pressure and sole.pressure.keys() != set(parts.CORNERS):
            raise RobotError(f"sole of {sole.link}: its pressure sensors are not {', '.join(parts.CORNERS)}")


def _require_one_pair(what: str, pairs: Sequence[tuple[str, str]]) -> None:
    """Raise RobotError when a joint that depends on another one is in a second pair.

    The safety layer keeps one table of a joint, and moves no joint for one that itself makes way.
    """
    named = [name for pair in pairs for name in pair]
    for leader, follower in pairs:
        if named.count(follower) > 1:
            raise RobotError(f"{what}: {follower} depends on {leader}, so it must be in no other {what}")


def _require_agreement(pair: parts.Coupling, body: Facts) -> None:
    """Raise RobotError when two joints cannot move together wherever the leader may be."""
    what = f"coupling of {pair.follower}"
    leader, follower = body.joint[pair.leader], body.joint[pair.follower]
    if pair.ratio == 0.0:
        raise RobotError(f"{what}: with the ratio 0 it does not follow {pair.leader}")
    if leader.passive != follower.passive:
        without = leader if leader.passive else follower
        raise RobotError(f"{what}: {without.name} has no motor (max_torque = 0), but moves with one that has")
    lowest, highest = sorted((pair.of(leader.lower), pair.of(leader.upper)))
    if lowest < follower.lower - _ROUNDING or highest > follower.upper + _ROUNDING:
        raise RobotError(
            f"{what}: {pair.leader} takes it from {lowest:.4g} to {highest:.4g}, outside its own range from"
            f" {follower.lower:.4g} to {follower.upper:.4g}: narrow the range of {pair.leader}"
        )


def _require_fast_wheels(body: Facts, wheels: parts.Wheels) -> None:
    """Raise RobotError when the motors of the wheels cannot drive as fast as the body says."""
    for name in (wheels.left, wheels.right):
        highest = body.joint[name].max_velocity * wheels.radius
        if highest < wheels.fastest:
            raise RobotError(
                f"walk: its fastest is {wheels.fastest:g} m/s, but joint {name} turns for {highest:g} m/s"
            )


def _require_sizes(shape: parts.Shape) -> None:
    if shape.kind == "hull":
        if len(shape.points) < _FEWEST_POINTS:
            raise RobotError(f"a hull of {shape.link}: {len(shape.points)} points, at least {_FEWEST_POINTS}")
        if (shape.position, shape.turn, shape.ends) != (parts.NOWHERE, parts.NO_TURN, None):
            raise RobotError(f"a hull of {shape.link}: its points say where it is, so leave out its place")
    elif shape.points:
        raise RobotError(f"a {shape.kind} of {shape.link}: only a hull has points")
    wanted = 1 if shape.ends else parts.SHAPE_SIZES[shape.kind]
    if len(shape.size) != wanted:
        raise RobotError(f"a {shape.kind} of {shape.link}: {len(shape.size)} sizes instead of {wanted}")


def _require_distinct(what: str, names: Sequence[str]) -> None:
    for name, times in Counter(names).items():
        if times > 1:
            raise RobotError(f"{what} {name}: there are two of this name")


def _require_tree(body: Facts, links: Sequence[str]) -> None:
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


def _named_joints(body: Facts) -> Iterable[tuple[str, Iterable[str]]]:
    """Yield the names of joints that parts of a body mention, with what mentions them."""
    for pair in body.couplings:
        yield "coupling", (pair.leader, pair.follower)
    for table in body.tables:
        yield "table", (table.independent, table.dependent)
    for rule in body.speed_rules:
        yield "speed rule", rule.slower
        yield "speed rule", rule.while_below
    groups = {
        name: names for name, names in msgspec.structs.asdict(body.groups).items() if isinstance(names, tuple)
    }
    for name, names in groups.items():
        yield f"group {name}", names
    yield "groups", chain(*groups.values())
    for name, axes in body.hinges.items():
        yield f"hinge {name}", (axis.joint for axis in axes.values())
    for name, posture in body.postures.items():
        yield f"posture {name}", posture.angles
    if isinstance(body.walk, parts.Wheels):
        yield "walk", (body.walk.left, body.walk.right)


def _named_links(body: Facts) -> Iterable[tuple[str, str]]:
    """Yield the names of links that parts of a body mention, with what mentions them."""
    for loop in body.loops:
        yield "loop", loop.first
        yield "loop", loop.second
    for camera in body.cameras:
        yield f"camera {camera.name}", camera.link
    for name, place in (*body.effectors.items(), *body.touch.items()):
        yield name, place.link
    for sole in body.soles:
        yield "sole", sole.link
    for place in (body.sonar.left, body.sonar.right) if body.sonar else ():
        yield "sonar", place.link
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
    elif isinstance(value, dict):
        for key, item in value.items():
            _require_finite(f"{path}.{key}", item)
    elif isinstance(value, (list, tuple)):
        for index, item in enumerate(value):
            _require_finite(f"{path}[{index}]", item)
