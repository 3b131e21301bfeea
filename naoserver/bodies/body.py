"""What a robot is, as data: links, joints, groups, cameras, sensors, postures, and its way to move.

`read_body` reads a facts file, whose entries `_facts.py` declares, and checks it. Every part but the name and
the links is optional: what a body lacks is not served. Units are SI and rad. Frames: x forward, y left, z
up; a link's frame is at its parent joint and moves with the link. Quaternions are (w, x, y, z).
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any, Final

from msgspec import inspect
from msgspec.structs import asdict, replace

from naoserver.bodies import parts
from naoserver.bodies._checks import check
from naoserver.bodies._facts import Facts
from naoserver.errors import RobotError
from zenoh_ice.data.toml_file import convert

LARGEST_DESCRIPTION: Final = (1 << 20) - 64
"""Most characters of a body, and of its looks, as JSON: what fits into an answer."""
_SERVANT: Final = "Description"
"""What serves bodies."""


class Body(Facts, frozen=True, forbid_unknown_fields=True, kw_only=True, eq=False, dict=True):
    """A robot's body. Raises RobotError when its parts do not belong together, naming the part."""

    def __post_init__(self) -> None:
        check(self)

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """The names of `joints`."""
        return tuple(joint.name for joint in self.joints)

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
