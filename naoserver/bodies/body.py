"""What a robot is, as data: links, joints, groups, cameras, sensors, postures, and its way to move.

A facts file of `naoserver.bodies` describes a body; `read_body` reads and checks it. Every part but the name
and the links is optional: what a body lacks is not served. Units are SI and rad. Frames: x forward, y left, z
up; a link's frame is at its parent joint and moves with the link. Quaternions are (w, x, y, z).
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Annotated, Any, Final

import msgspec
from msgspec import Meta, Struct, inspect
from msgspec.structs import asdict, replace

from naoserver.bodies import parts
from naoserver.bodies._checks import check
from naoserver.bodies.looks import Looks
from naoserver.errors import RobotError
from zenoh_ice.data.toml_file import convert

LARGEST_DESCRIPTION: Final = (1 << 20) - 64
"""Most characters of a body, and of its looks, as JSON: what fits into an answer."""
_SERVANT: Final = "Description"
"""What serves bodies."""


class Body(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, eq=False, dict=True):
    """A robot's body. Raises RobotError when its parts do not belong together, naming the part."""

    name: parts.Name
    """The manufacturer's name for it, such as `H25`."""
    title: str = ""
    """What a person calls it, such as `Nao H25`."""
    links: Annotated[tuple[parts.Link, ...], Meta(min_length=1, max_length=parts.MOST_PARTS)]
    """The rigid parts, the root first, each after the link that carries it."""
    joints: Annotated[tuple[parts.Joint, ...], Meta(max_length=parts.MOST_PARTS)] = ()
    """The joints in the order of every reading."""
    fixed_joints: Annotated[tuple[parts.Joint, ...], Meta(max_length=parts.MOST_PARTS)] = ()
    """Places where a link is fixed to another, at the angle 0."""
    gears: dict[str, parts.Gear] = {}
    gains: parts.Gains | None = None
    """None for motors that follow positions only, as those of a Nao."""
    play: parts.Play | None = None
    """None for gears like those of a Nao."""
    couplings: tuple[parts.Coupling, ...] = ()
    """The pairs of joints that move together."""
    loops: tuple[parts.Loop, ...] = ()
    """What closes chains of links to loops."""
    tables: tuple[parts.RangeTable, ...] = ()
    """The ranges that keep parts of the body off each other."""
    speed_rules: tuple[parts.SpeedRule, ...] = ()
    groups: parts.Groups = parts.Groups()
    hinges: dict[str, dict[parts.Axis, parts.HingeAxis]] = {}
    """The Pose3D devices of the body by name."""
    effectors: dict[parts.Name, parts.Place] = {}
    """The parts whose places can be asked for and reached: hands, feet, the head, cameras."""
    cameras: Annotated[tuple[parts.Camera, ...], Meta(max_length=parts.MOST_CAMERAS)] = ()
    """The cameras, the most important one first."""
    inertial_unit: parts.InertialUnit | None = None
    soles: tuple[parts.Sole, ...] = ()
    """The soles of the left and of the right foot, or none."""
    sonar: parts.Sonar | None = None
    touch: dict[parts.Name, parts.TouchSensor] = {}
    """The touch sensors by name."""
    lights: dict[str, parts.Lamp] = {}
    battery: parts.Battery | None = None
    motor_heat: parts.MotorHeat | None = None
    """None for motors whose temperatures are not watched."""
    voice: bool = False
    """Whether it has a loudspeaker, on which it speaks and plays sounds."""
    postures: Annotated[dict[parts.Name, parts.Posture], Meta(max_length=parts.MOST_PARTS)] = {}
    rest: str = ""
    """The posture in which it starts; without one, joints are as near to 0 as their ranges let them."""
    falls: parts.FallRules | None = None
    """None for a robot that cannot fall."""
    walk: parts.Walk | None = None
    kicks: dict[parts.Name, parts.Kick] = {}
    """The motions that kick, by name."""
    mounted: bool = False
    """Whether its root is fixed to the floor, as an arm's on a table."""
    shapes: Annotated[tuple[parts.Shape, ...], Meta(max_length=parts.MOST_PARTS)] = ()
    intangible: tuple[str, ...] = ()
    """Links whose shapes do not touch other links of the body."""
    overlapping: tuple[tuple[str, str], ...] = ()
    """Pairs of links whose shapes do not touch each other, besides neighbors."""
    looks: Looks | None = None
    """What is seen of it, if its model says so; else what `bodies.looks` has, or its shapes."""
    sources: dict[str, str] = {}
    """What the letters in `source` stand for."""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        check(self)

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """The names of `joints`."""
        return tuple(joint.name for joint in self.joints)

    @cached_property
    def joint(self) -> Mapping[str, parts.Joint]:
        """The joints by name."""
        return {joint.name: joint for joint in self.joints}

    @cached_property
    def moved_by(self) -> Mapping[str, parts.Joint]:
        """The joint, movable or fixed, between each link and the one that carries it, by the link's name."""
        return {joint.child: joint for joint in (*self.joints, *self.fixed_joints)}

    @property
    def root(self) -> parts.Link:
        """The link that carries all others, such as the torso."""
        return self.links[0]

    @property
    def mass(self) -> float:
        """In kg."""
        return sum(link.mass for link in self.links)

    @cached_property
    def following(self) -> Mapping[str, parts.Coupling]:
        """The coupling of each joint that follows another one."""
        return {pair.follower: pair for pair in self.couplings}

    @cached_property
    def motors(self) -> tuple[str, ...]:
        """The joints with separate motors: those that neither are passive nor follow another one."""
        return tuple(
            joint.name for joint in self.joints if not joint.passive and joint.name not in self.following
        )

    def hinge(self, name: str) -> parts.Hinge | None:
        """Return a Pose3D device of the body; None when it has no such."""
        return parts.Hinge(name, self.hinges[name]) if name in self.hinges else None

    @property
    def neck(self) -> parts.Hinge | None:
        """What points the first camera, by pan and tilt: a neck, or a waist; None without such joints."""
        neck = self.hinge("Neck")
        return neck if neck and {parts.Axis.PAN, parts.Axis.TILT} <= neck.axes.keys() else None

    @property
    def lying_tilt(self) -> float:
        """The tilt of the torso in rad beyond which it lies rather than stands, crouches or sits."""
        return self.falls.lying_tilt if self.falls else parts.LYING_TILT

    @property
    def touch_sensors(self) -> tuple[str, ...]:
        """The names of the touch sensors."""
        return tuple(self.touch)

    @cached_property
    def resting_angles(self) -> Mapping[str, float]:
        """The angles of the posture of `rest`."""
        return self.complete(self.postures[self.rest].angles if self.rest else {})

    def complete(self, angles: Mapping[str, float]) -> dict[str, float]:
        """Return an angle of every joint, within its range.

        Those of `angles`, else as near to 0 as can be; a follower is where its leader takes it.
        """
        found = {
            joint.name: min(max(angles.get(joint.name, 0.0), joint.lower), joint.upper)
            for joint in self.joints
        }
        return found | {name: pair.of(found[pair.leader]) for name, pair in self.following.items()}

    def motor_currents(self, torques: Sequence[float]) -> list[float]:
        """Return the unsigned current in A with which each joint's motor gives a torque in N m.

        A motor that turns at its no-load speed induces the voltage, so the ratio of both is that of the
        torque to the current, too. It is 0 for a joint without facts of its motor.
        """
        return [abs(torque) * ratio for torque, ratio in zip(torques, self._currents, strict=True)]

    @cached_property
    def _currents(self) -> tuple[float, ...]:
        volts = self.battery.voltage if self.battery else math.inf
        return tuple(joint.motor.no_load_speed / volts if joint.motor else 0.0 for joint in self.joints)

    def as_data(self) -> dict[str, Any]:
        """Return its parts except the looks as tables, lists, texts and numbers."""
        own = asdict(self)
        del own["looks"]
        data: dict[str, Any] = msgspec.to_builtins(own)
        return data

    def without(self, name: str, title: str, joints: Collection[str], touch: Collection[str]) -> Body:
        """Return a copy called `name`: some joints are fixed at the angle 0, some touch sensors missing."""

        def left(names: Iterable[str]) -> tuple[str, ...]:
            return tuple(name for name in names if name not in joints)

        groups = {
            group: left(names) for group, names in asdict(self.groups).items() if isinstance(names, tuple)
        }
        postures = {
            key: replace(posture, angles={at: posture.angles[at] for at in left(posture.angles)})
            for key, posture in self.postures.items()
        }
        hinges = {
            hinge: axes
            for hinge, axes in self.hinges.items()
            if not any(axis.joint in joints for axis in axes.values())
        }
        return replace(
            self,
            name=name,
            title=title,
            joints=tuple(joint for joint in self.joints if joint.name not in joints),
            fixed_joints=(*self.fixed_joints, *(joint for joint in self.joints if joint.name in joints)),
            groups=replace(self.groups, **groups),
            hinges=hinges,
            postures=postures,
            speed_rules=tuple(replace(rule, slower=left(rule.slower)) for rule in self.speed_rules),
            touch={sensor: place for sensor, place in self.touch.items() if sensor not in touch},
        )


def read_body(text: str | bytes, file: str) -> Body:
    """Return the body that a facts file, in JSON, describes. Raises RobotError with file and entry."""
    return _body_of(_parse(text, file), file)


def read_description(text: str) -> Body:
    """Return the body that a server describes in JSON. Raises RobotError, which names the entry.

    What only a newer version knows of a body is left out.
    """
    if len(text) > LARGEST_DESCRIPTION:
        raise RobotError(f"{_SERVANT}: {len(text)} characters, and at most {LARGEST_DESCRIPTION} are read")
    return _body_of(_known(_parse(text, _SERVANT), inspect.type_info(Body)), _SERVANT)


def _parse(text: str | bytes, file: str) -> Any:  # noqa: ANN401
    try:
        return json.loads(text, object_pairs_hook=_unique(file))
    except (ValueError, RecursionError) as problem:
        raise RobotError(f"{file}: not JSON: {problem}") from problem


def _body_of(described: object, file: str) -> Body:
    try:
        return convert(described, Body, file, RobotError)
    except RobotError as error:
        if str(error).startswith(file):
            raise
        raise RobotError(f"{file}: {error}") from None


def _known(value: Any, kind: inspect.Type) -> Any:  # noqa: ANN401
    """Return data of a type without the entries that it does not have."""
    match kind, value:
        case inspect.StructType(), dict():
            kinds = {field.encode_name: field.type for field in kind.fields}
            found = {key: _known(value[key], kinds[key]) for key in value if key in kinds}
            return found | {key: value[key] for key in value if key == kind.tag_field}
        case inspect.DictType(), dict():
            return {key: _known(item, kind.value_type) for key, item in value.items()}
        case inspect.VarTupleType(), list():
            return [_known(item, kind.item_type) for item in value]
        case inspect.UnionType(), dict():
            structs = (each for each in kind.types if isinstance(each, inspect.StructType))
            tagged = (
                each for each in structs if each.tag_field is None or value.get(each.tag_field) == each.tag
            )
            return next((_known(value, each) for each in tagged), value)
    return value


def write_body(body: Body) -> str:
    """Return a body without its looks as the JSON that `read_body` reads.

    Ranges without an end are left out.
    """
    return json.dumps(_without_infinite(body.as_data()))


_INFINITE: Final = (math.inf, -math.inf)


def _without_infinite(value: Any) -> Any:  # noqa: ANN401
    if isinstance(value, dict):
        return {key: _without_infinite(item) for key, item in value.items() if item not in _INFINITE}
    return [_without_infinite(item) for item in value] if isinstance(value, (list, tuple)) else value


def _unique(file: str) -> Callable[[list[tuple[str, Any]]], dict[str, Any]]:
    """Return a hook that refuses an object with a doubled or unprintable key, which JSON would let pass."""

    def collect(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found = dict(pairs)
        if len(found) < len(pairs):
            names = [name for name, _ in pairs]
            doubled = next(name for name in names if names.count(name) > 1)
            raise RobotError(f"{file}: {doubled!r} is there twice")
        for name in found:
            if not name.isprintable():
                raise RobotError(f"{file}: the key {name[:60]!r} is not printable")
        return found

    return collect
