"""What a facts file declares of a body: its fields, and how they stand together in a table."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Annotated, Any

import msgspec
from msgspec import Meta, Struct
from msgspec.structs import asdict

from naoserver.bodies import parts
from naoserver.bodies.looks import Looks


class Facts(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, eq=False, dict=True):
    """The parts of a body, each of which may be wrong beside another."""

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
    sight: parts.Sight = parts.Sight()
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

    @cached_property
    def joint(self) -> Mapping[str, parts.Joint]:
        """The joints by name."""
        return {joint.name: joint for joint in self.joints}

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

    def as_data(self) -> dict[str, Any]:
        """Return its parts except the looks as tables, lists, texts and numbers."""
        own = asdict(self)
        del own["looks"]
        data: dict[str, Any] = msgspec.to_builtins(own)
        return data
