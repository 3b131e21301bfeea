"""A robot's body and its looks, as its server describes them and as the page draws them.

Any process may serve any description, so all of it is checked; what cannot be drawn is replaced: looks by the
body's contact shapes, and these by sticks from joint to joint. Lengths are in m; the server's quaternions are
(w, x, y, z), those of the page (x, y, z, w).
"""

from __future__ import annotations

import base64
import logging
import math
import struct
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from typing import Annotated, Any, Final, Literal, TypeVar

import msgspec
from msgspec import Meta, Struct

from codegen.messages import NO_MESSAGE, Message
from codegen.reasons import reason
from interfaces.nao import DescriptionPrx
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._monitor.realm.realm import PolledValue
from zenoh_ice import Communicator
from zenoh_ice.data import typed
from zenoh_ice.data.keys import Target
from zenoh_ice.data.text import printable

DESCRIPTION: Final = "Description"
"""The identity of the servant that describes the robot."""
LARGEST_TEXT: Final = 8 << 20
"""Most characters of the body, and of the looks."""
_MOST_PARTS: Final = 1000
_MOST_SHAPES: Final = 5000
_GREY: Final = (0.62, 0.65, 0.69)
_STICK: Final = 0.012
"""Radius in m of the sticks."""

P = TypeVar("P", bound=Struct)

_logger = logging.getLogger(__name__)

_Name = Annotated[str, Meta(min_length=1, max_length=64)]
_Number = Annotated[float, Meta(ge=-1000.0, le=1000.0)]
_Share = Annotated[float, Meta(ge=0.0, le=1.0)]
_Size = Annotated[float, Meta(ge=0.0, le=1000.0)]
_Vector = tuple[_Number, _Number, _Number]
_Quaternion = tuple[_Number, _Number, _Number, _Number]
_Color = tuple[_Share, _Share, _Share]
_NO_TURN: Final = (1.0, 0.0, 0.0, 0.0)


class _Link(Struct, frozen=True):
    name: _Name


class _Joint(Struct, frozen=True):
    name: _Name
    parent: _Name
    child: _Name
    axis: _Vector
    origin: _Vector
    turn: _Quaternion = _NO_TURN
    sliding: bool = False


class HingeAxis(Struct, frozen=True):
    """The joint of an axis: the axis is at 0 where the joint is at `zero`, and turns with its `sign`."""

    joint: _Name
    sign: Literal[1, -1] = 1
    zero: float = 0.0

    def of(self, joints: Mapping[str, float]) -> float | None:
        """Return the angle of the axis in rad; None while that of the joint is unknown."""
        angle = joints.get(self.joint)
        return None if angle is None else self.sign * (angle - self.zero)


class _Neck(Struct, frozen=True):
    pan: HingeAxis | None = None
    tilt: HingeAxis | None = None


class _Hinges(Struct, frozen=True):
    neck: _Neck = msgspec.field(name="Neck", default=_Neck())


class _Camera(Struct, frozen=True):
    link: _Name
    position: _Vector = (0.0, 0.0, 0.0)
    tilt: _Number = 0.0


class _Sole(Struct, frozen=True):
    link: _Name
    outline: Annotated[tuple[tuple[_Number, _Number], ...], Meta(min_length=3, max_length=_MOST_PARTS)]
    height: _Number


class _ContactShape(Struct, frozen=True):
    link: _Name
    kind: Literal["box", "sphere", "capsule", "cylinder", "ellipsoid", "hull"]
    size: Annotated[tuple[_Size, ...], Meta(max_length=3)] = ()
    position: _Vector = (0.0, 0.0, 0.0)
    turn: _Quaternion = _NO_TURN
    ends: tuple[_Vector, _Vector] | None = None
    points: Annotated[tuple[_Vector, ...], Meta(max_length=_MOST_PARTS)] = ()


class _Body(Struct, frozen=True):
    """What is drawn of a `naoserver.body.Body`."""

    name: _Name
    links: Annotated[tuple[_Link, ...], Meta(min_length=1, max_length=_MOST_PARTS)]
    title: Annotated[str, Meta(max_length=64)] = ""
    joints: Annotated[tuple[_Joint, ...], Meta(max_length=_MOST_PARTS)] = ()
    fixed_joints: Annotated[tuple[_Joint, ...], Meta(max_length=_MOST_PARTS)] = ()
    hinges: _Hinges = _Hinges()
    cameras: tuple[_Camera, ...] = ()
    soles: Annotated[tuple[_Sole, ...], Meta(max_length=2)] = ()
    shapes: Annotated[tuple[_ContactShape, ...], Meta(max_length=_MOST_PARTS)] = ()
    postures: Annotated[dict[_Name, msgspec.Raw], Meta(max_length=_MOST_PARTS)] = {}


class _Shape(Struct, frozen=True, omit_defaults=True):
    """A shape as the page draws it; sizes are halves."""

    link: _Name
    kind: Literal["mesh", "box", "sphere", "capsule", "cylinder", "ellipsoid", "ring"]
    color: _Color
    size: Annotated[tuple[_Size, ...], Meta(max_length=3)] = ()
    position: _Vector | None = None
    quaternion: _Quaternion | None = None
    mesh: Annotated[int, Meta(ge=0)] = 0
    mirrored: bool = False
    glow: _Share = 0.0
    opacity: _Share = 1.0


class _Mesh(Struct, frozen=True):
    vertices: str
    indices: str


class _Looks(Struct, frozen=True):
    shapes: Annotated[tuple[_Shape, ...], Meta(max_length=_MOST_SHAPES)]
    meshes: Annotated[tuple[_Mesh, ...], Meta(max_length=_MOST_PARTS)] = ()
    mesh_unit: Annotated[float, Meta(gt=0.0, le=1.0)] = msgspec.field(name="meshUnit", default=1e-4)


@dataclass(frozen=True, slots=True)
class DescribedRobot:
    """A robot as the page draws it; `body` and `looks` are the texts of its server."""

    name: str
    title: str
    """Its name for people."""
    neck: tuple[HingeAxis | None, HingeAxis | None]
    """The axes that pan and tilt its first camera."""
    joints: frozenset[str]
    sliding: tuple[str, ...]
    """The joints that slide instead of turning."""
    postures: tuple[str, ...]
    page: bytes
    """JSON for `static/robot3d/robot-drawing.js`."""
    hash: str
    """Names the content of `page`."""
    body: str
    looks: str

    def head(self, joints: Mapping[str, float]) -> tuple[float | None, float | None]:
        """Return pan and tilt of the head in rad at these angles of the joints; None when unknown."""
        pan, tilt = self.neck
        return None if pan is None else pan.of(joints), None if tilt is None else tilt.of(joints)


def describe(body: str, looks: str) -> DescribedRobot:
    """Return a robot of the texts that its `Description` serves. Raises VisualHfsmError for an unsound body.

    Looks that cannot be drawn are replaced, and logged.
    """
    found = _decode(body, _Body, Message("body"))
    tree = _tree(found)
    try:
        drawn = _decode(looks, _Looks, Message("looks")) if looks else None
        if drawn is not None:
            _check_looks(drawn, tree)
    except VisualHfsmError as error:
        _logger.warning("%s is drawn by its contact shapes: %s", printable(found.name), error)
        drawn = None
    if drawn is None or not drawn.shapes:
        # A server of a Nao that does not know how it looks, such as that of a real one.
        drawn = _looks_of_nao(found) or _Looks(tuple(_plain_shapes(found, tree)))
    content: dict[str, Any] = {
        "name": found.name,
        "title": found.title or found.name,
        "links": list(tree.values()),
        "soles": {sole.link: [[*point, -sole.height] for point in sole.outline] for sole in found.soles},
        **msgspec.to_builtins(drawn),
    }
    if found.cameras and found.cameras[0].link in tree:
        content["eye"] = found.cameras[0]
    page = msgspec.json.encode(content)
    neck = found.hinges.neck
    return DescribedRobot(
        name=found.name,
        title=printable(found.title or found.name),
        neck=(neck.pan, neck.tilt),
        joints=frozenset(joint.name for joint in found.joints),
        sliding=tuple(joint.name for joint in found.joints if joint.sliding),
        postures=tuple(map(printable, found.postures)),
        page=page,
        hash=sha256(page).hexdigest()[:32],
        body=body,
        looks=looks,
    )


@cache
def nao() -> DescribedRobot:
    """Return a Nao: the robot of servers and recordings that describe none."""
    # Late: most robots describe themselves, and a page without robots needs none of it.
    from naoserver.bodies import DEFAULT_BODY, find_body
    from naoserver.bodies.looks.description import write_looks
    from naoserver.body import write_body

    nao = find_body(DEFAULT_BODY)
    return describe(write_body(nao), write_looks(nao))


class DescriptionMonitor:
    """Fetch the description that a proxy of this text serves; `update` it a few times a second."""

    def __init__(self, communicator: Communicator, identity: str = DESCRIPTION) -> None:
        self._communicator = communicator
        proxy = DescriptionPrx.uncheckedCast(communicator.stringToProxy(identity))
        self._target = Target(proxy.ice_getRealm(), proxy.ice_getIdentity())
        self._body = PolledValue(proxy.getBody.begin)
        self._looks = PolledValue(proxy.getLooks.begin)
        self._served: tuple[str, float] | None = None
        self._read: tuple[str, str] | None = None
        self.robot: DescribedRobot | None = None
        """The robot that is described, also when it has left; None until one was."""
        self._refusal = NO_MESSAGE

    @property
    def is_present(self) -> bool:
        """Whether a robot is described."""
        return bool(self._communicator.presence.servers(self._target))

    @property
    def trouble(self) -> str:
        """Why the present description cannot be drawn."""
        return self._refusal or printable(self._body.trouble or self._looks.trouble)

    def update(self) -> None:
        """Request what is missing of a robot that has appeared."""
        served = next(
            ((each.server, each.since) for each in self._communicator.presence.servers(self._target)), None
        )
        if served is None:
            return
        if served != self._served:  # perhaps another robot
            self._served = served
            self._body.forget()
            self._looks.forget()
            self.robot, self._read, self._refusal = None, None, NO_MESSAGE
        body, looks = self._body.poll(), self._looks.poll()
        if body is None or looks is None or self._read is not None:
            return
        self._read = body, looks
        try:
            self.robot = describe(body, looks)
        except VisualHfsmError as error:
            self._refusal = error.message
            _logger.warning("%s", error)


def _decode(text: str, part: type[P], what: Message) -> P:
    if len(text) > LARGEST_TEXT:
        raise VisualHfsmError.because(
            "the robot's {what} has {count} MB, and at most {limit} are read",
            what=what,
            count=len(text) >> 20,
            limit=LARGEST_TEXT >> 20,
        )
    try:
        return typed.from_json(text, part)
    except (msgspec.MsgspecError, RecursionError) as error:
        raise VisualHfsmError.because(
            "the robot's {what} cannot be read: {reason}", what=what, reason=reason(error)
        ) from error


def _tree(body: _Body) -> dict[str, dict[str, Any]]:
    """Return the links as the page has them, by name, each after the one that carries it."""
    names = [link.name for link in body.links]
    moved = {joint.name for joint in body.joints}
    by_child = {joint.child: joint for joint in (*body.fixed_joints, *body.joints)}
    tree: dict[str, dict[str, Any]] = {names[0]: {"name": names[0]}}
    for name in names[1:]:
        joint = by_child.get(name)
        if joint is None or joint.parent not in tree or name in tree:
            raise VisualHfsmError.because(
                "the robot's body has no joint that carries {name} after another link", name=printable(name)
            )
        w, x, y, z = joint.turn
        link: dict[str, Any] = {"name": name, "parent": joint.parent, "origin": joint.origin}
        if joint.turn != _NO_TURN:
            link["turn"] = (x, y, z, w)
        if joint.name in moved:
            link |= {"joint": joint.name, "axis": joint.axis} | ({"sliding": True} if joint.sliding else {})
        tree[name] = link
    if missing := next((sole.link for sole in body.soles if sole.link not in tree), None):
        raise VisualHfsmError.because(
            "the robot's body has no link {missing}, which a sole names", missing=printable(missing)
        )
    return tree


def _check_looks(looks: _Looks, links: Mapping[str, object]) -> None:
    """Raise VisualHfsmError unless there are the links, meshes and vertices that shapes and meshes use."""
    for shape in looks.shapes:
        if shape.link not in links:
            raise VisualHfsmError.because(
                "there is no link {link}, to which a shape belongs", link=printable(shape.link)
            )
        if shape.kind == "mesh" and shape.mesh >= len(looks.meshes):
            raise VisualHfsmError.because(
                "there is no mesh {mesh}, of {count}", mesh=shape.mesh, count=len(looks.meshes)
            )
    for number, mesh in enumerate(looks.meshes):
        with VisualHfsmError.in_place_of(ValueError, "mesh {number} is not base64: {reason}", number=number):
            vertices = base64.b64decode(mesh.vertices, validate=True)
            packed = base64.b64decode(mesh.indices, validate=True)
        if len(vertices) % 6 or len(packed) % 6:
            raise VisualHfsmError.because("mesh {number} does not consist of triangles", number=number)
        indices = struct.unpack(f"<{len(packed) // 2}H", packed)
        if max(indices, default=-1) >= len(vertices) // 6:
            raise VisualHfsmError.because("mesh {number} uses a vertex that it lacks", number=number)


def _looks_of_nao(body: _Body) -> _Looks | None:
    """Return the looks of a Nao for a body with its links, joint by joint; None for other bodies."""
    known = nao()
    links = _decode(known.body, _Body, Message("body")).links
    if {link.name for link in links} != {link.name for link in body.links}:
        return None
    return _decode(known.looks, _Looks, Message("looks"))


def _plain_shapes(body: _Body, tree: Mapping[str, Mapping[str, Any]]) -> Iterator[_Shape]:
    """Yield the contact shapes of a body, hulls as boxes, or sticks from joint to joint if it has none."""
    known = [shape for shape in body.shapes if shape.link in tree]
    for shape in known:
        w, x, y, z = shape.turn
        if shape.kind == "hull":
            yield _box_around(shape)
            continue
        if shape.ends is None:
            size, place, turn = shape.size, shape.position, (x, y, z, w)
        else:
            size, place, turn = _between(*shape.ends, shape.size[0])
        yield _Shape(shape.link, shape.kind, _GREY, size, place, turn)
    if known:
        return
    for link in body.links:
        yield _Shape(link.name, "sphere", _GREY, (2 * _STICK,))
    for joint in (*body.joints, *body.fixed_joints):
        if any(joint.origin):
            yield _Shape(joint.parent, "capsule", _GREY, *_between((0.0, 0.0, 0.0), joint.origin, _STICK))


def _box_around(hull: _ContactShape) -> _Shape:
    low, high = ([pick(along) for along in zip(*hull.points, strict=True)] for pick in (min, max))
    ends = zip(low, high, strict=True)
    (x, half_x), (y, half_y), (z, half_z) = (((one + other) / 2, (other - one) / 2) for one, other in ends)
    return _Shape(hull.link, "box", _GREY, (half_x, half_y, half_z), (x, y, z))


def _between(
    begin: Iterable[float], end: Iterable[float], radius: float
) -> tuple[tuple[float, float], tuple[float, float, float], tuple[float, float, float, float]]:
    """Return size, middle and turn of a capsule between two points."""
    (bx, by, bz), (ex, ey, ez) = begin, end
    dx, dy, dz = ex - bx, ey - by, ez - bz
    length = math.hypot(dx, dy, dz)
    middle = ((bx + ex) / 2, (by + ey) / 2, (bz + ez) / 2)
    across = math.hypot(dx, dy)
    if across < 1e-9:
        return (radius, length / 2), middle, (0.0, 0.0, 0.0, 1.0)
    half = math.atan2(across, dz) / 2
    share = math.sin(half) / across
    return (radius, length / 2), middle, (-dy * share, dx * share, 0.0, math.cos(half))
