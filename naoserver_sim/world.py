"""A world as described by its file: balls, boxes, walls, a soccer field, light, and the robot's start.

A world is a TOML file, such as those of `naoserver_sim/worlds`; docs/how-to/worlds.md lists its keys. Its
frame: x and y on the floor, z up. Lengths in m, masses in kg, angles in rad,
colors as red, green, blue from 0 to 1.
"""

from __future__ import annotations

import math
from importlib import resources
from pathlib import Path
from typing import Annotated, Final

import msgspec
import numpy as np
from msgspec import Meta, Struct

from naoserver.bodies.parts import JointFacts
from naoserver.errors import RobotError
from naoserver.soccer_field import Field, Share, Size
from zenoh_ice.data.toml_file import parse_toml, read_text
from zenoh_ice.settings import Realm

BALL_RADIUS: Final = 0.06
"""Radius in m of a carried ball."""
_MOST_THINGS: Final = 100
_LOWEST_LIGHT: Final = 0.1
"""Sine of the smallest angle at which light falls downwards."""

Place = Annotated[float, Meta(ge=-50.0, le=50.0)]
Mass = Annotated[float, Meta(ge=0.001, le=100.0)]
Angle = Annotated[float, Meta(ge=-2 * math.pi, le=2 * math.pi)]
Color = tuple[Share, Share, Share]
Brightness = Annotated[float, Meta(ge=0.0, le=2.0)]
Component = Annotated[float, Meta(ge=-1.0, le=1.0)]
Height = Annotated[float, Meta(ge=0.1, le=50.0)]
_Seconds = Annotated[float, Meta(ge=0.001, le=0.1)]
_Damping = Annotated[float, Meta(ge=0.1, le=2.0)]
Name = Annotated[str, Meta(pattern=r"^[A-Z]\w{0,31}\Z")]


class StartPose(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Start of the robot."""

    position: tuple[Place, Place] = (0.0, 0.0)
    heading: Angle = 0.0


class RobotPlace(StartPose, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One of several robots, and where it starts."""

    name: Realm
    """Its realm."""
    body: str = ""
    """The name of its body, or a file; the default one if it is empty."""
    team: Annotated[str, Meta(pattern=r"^\w{0,32}\Z")] = ""
    shirt: Color | None = None
    """Color of its trunk; None for that of its looks."""


class CarriedBall(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A ball that a mechanism carries round the robot's start: by pan, then distance, then height."""

    name: Annotated[str, Meta(pattern=r"^Ball[A-Z]\w{0,27}\Z")]
    color: Color
    start: tuple[Angle, Place, Place]
    """Pan in rad, distance in m, height of the center in m."""

    def __post_init__(self) -> None:
        for joint, value in zip(self.joints, self.start, strict=True):
            if not joint.lower <= value <= joint.upper:
                message = f"{value:g} is not within {joint.lower:g} and {joint.upper:g}"
                raise ValueError(f"start of {self.name}: {message}")

    @property
    def joints(self) -> tuple[JointFacts, JointFacts, JointFacts]:
        """The joints in the order of `start`; the mechanism has ample force."""
        return (
            JointFacts(f"{self.name}Pan", -math.pi, math.pi, 2.0, 100.0),
            JointFacts(f"{self.name}X", 0.15, 3.0, 1.5, 100.0),
            JointFacts(f"{self.name}Z", BALL_RADIUS, 1.5, 1.5, 100.0),
        )


class LooseBall(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A ball that rolls where it is pushed; by default that of the Standard Platform League."""

    name: Name
    position: tuple[Place, Place]
    color: Color = (0.95, 0.95, 0.95)
    radius: Size = 0.05
    mass: Mass = 0.044
    rolling: Annotated[float, Meta(ge=0.0, le=0.1)] = 0.0025
    """Rolling friction: by how many m what carries it acts before its middle."""
    contact: tuple[Annotated[float, Meta(ge=0.001, le=0.1)], Annotated[float, Meta(ge=0.1, le=2.0)]] = (
        0.005,
        1.0,
    )
    """Time constant in s and damping ratio of what touches it: below 1 it bounces."""


class Box(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A box on the floor; with a mass it can be pushed, without one it is fixed."""

    name: Name
    position: tuple[Place, Place]
    size: tuple[Size, Size, Size]
    """Full lengths along its x, y and z."""
    heading: Angle = 0.0
    color: Color = (0.55, 0.45, 0.35)
    mass: Mass | None = None


class Wall(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A wall between two places on the floor."""

    begin: tuple[Place, Place]
    end: tuple[Place, Place]
    height: Size = 0.5
    thickness: Size = 0.05
    color: Color = (0.86, 0.84, 0.80)

    def __post_init__(self) -> None:
        if math.dist(self.begin, self.end) < self.thickness:
            raise ValueError("the wall is shorter than it is thick")


class Sign(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """An upright board with a landmark on it, or with a face."""

    position: tuple[Place, Place]
    height: Annotated[float, Meta(ge=0.03, le=5.0)] = 0.5
    """Height of its middle above the floor."""
    heading: Angle = math.pi
    """The direction in which it faces."""
    size: Annotated[float, Meta(ge=0.03, le=5.0)] = 0.2
    landmark: Annotated[int, Meta(ge=0, le=249)] | None = None
    """The number on it; None for a face."""


class Light(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The light of a world: sunlight, or a lamp, and light from everywhere."""

    direction: tuple[Component, Component, Component] = (-0.3, -0.25, -1.0)
    """Direction of the light: downwards. Any length."""
    position: tuple[Place, Place, Height] | None = None
    """Position of a lamp, which shines up to 80 degrees from the direction; None for sunlight."""
    brightness: Brightness = 0.7
    """Brightness of a white surface at a right angle to the light, as a share of white."""
    ambient: Brightness = 0.4
    """The same for the ambient light, from all directions."""
    color: Color = (1.0, 1.0, 1.0)
    """Color of both."""
    shadows: bool = False

    def __post_init__(self) -> None:
        if self.direction[2] >= -_LOWEST_LIGHT * math.hypot(*self.direction):
            raise ValueError("the direction does not go down: write a negative third number")


class World(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A world: the contents of its file."""

    description: str = ""
    robot: StartPose = StartPose()
    """Where a robot starts that is alone; it is the first of `robots` if there are any."""
    robots: tuple[RobotPlace, ...] = ()
    carried_balls: tuple[CarriedBall, ...] = ()
    balls: tuple[LooseBall, ...] = ()
    boxes: tuple[Box, ...] = ()
    walls: tuple[Wall, ...] = ()
    signs: tuple[Sign, ...] = ()
    field: Field | None = None
    light: Light | None = None
    """None for the light of scene.xml."""

    @property
    def loose(self) -> tuple[str, ...]:
        """The names of objects that can be pushed: balls that roll, and boxes with a mass."""
        boxes = [box.name for box in self.boxes if box.mass is not None]
        return (*(ball.name for ball in self.balls), *boxes)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all objects that have one."""
        named: tuple[CarriedBall | LooseBall | Box, ...] = (*self.carried_balls, *self.balls, *self.boxes)
        return tuple(thing.name for thing in named)


def bundled_worlds() -> tuple[str, ...]:
    """Return the names of the bundled worlds."""
    folder = resources.files("naoserver_sim") / "worlds"
    names = [Path(entry.name) for entry in folder.iterdir()]
    return tuple(sorted(name.stem for name in names if name.suffix == ".toml"))


def load_world(name: str) -> World:
    """Return a world by its name, if it is bundled, or else from the file of that name.

    Raises RobotError that names the file, the line and the problem.
    """
    if name in bundled_worlds():
        text = (resources.files("naoserver_sim") / "worlds" / f"{name}.toml").read_text(encoding="utf-8")
        return parse_world(text, name)
    try:
        text = read_text(Path(name), RobotError)
    except RobotError as error:
        known = ", ".join(bundled_worlds())
        raise RobotError(f"{error}; give the file of a world, or one of {known}") from error
    return parse_world(text, name)


def parse_world(text: str, source: str) -> World:
    """Return the world that a text describes. Raises RobotError that names `source` and the problem."""
    world = parse_toml(text, World, source, RobotError)
    if world.robots:
        if world.robot != StartPose():
            raise RobotError(f"{source}: [robot] and [[robots]]: write only one of them")
        first = world.robots[0]
        start = StartPose(position=first.position, heading=first.heading)
        world = msgspec.structs.replace(world, robot=start)
    if world.field is not None and world.balls:
        field = msgspec.structs.replace(world.field, ball_radius=world.balls[0].radius)
        world = msgspec.structs.replace(world, field=field)
    names = (*world.names, *(robot.name for robot in world.robots))
    for name in names:
        if names.count(name) > 1:
            raise RobotError(f"{source}: {name} appears {names.count(name)} times; use each name once")
    if len(names) + len(world.walls) + len(world.signs) > _MOST_THINGS:
        raise RobotError(f"{source}: there are more than {_MOST_THINGS} things")
    return world


_APART: Final = 1.0
"""Distance in m between robots that a world gives no places."""
_REALM: Final = "nao"


def side_by_side(world: World, robots: int, realm: str = _REALM) -> World:
    """Return the world with some robots at the robot's start, alternately to its left and its right.

    Their names are the realm, and the realm with 2, 3 and so on.
    """
    start = world.robot
    places = []
    for number in range(robots):
        aside = _APART * ((number + 1) // 2) * (1 if number % 2 else -1)
        x = start.position[0] - aside * math.sin(start.heading)
        y = start.position[1] + aside * math.cos(start.heading)
        name = realm + (str(number + 1) if number else "")
        places.append(RobotPlace(name=name, position=(x, y), heading=start.heading))
    return msgspec.structs.replace(world, robots=tuple(places))


def scattered(world: World, random: np.random.Generator) -> World:
    """Return the world with its carried balls at random places within reach of the robot's head."""
    balls = tuple(
        msgspec.structs.replace(
            ball, start=(random.uniform(-0.5, 0.5), random.uniform(0.7, 1.2), random.uniform(0.35, 0.65))
        )
        for ball in world.carried_balls
    )
    return msgspec.structs.replace(world, carried_balls=balls)


DEFAULT_WORLD: Final = "balls"
"""The world if none is chosen."""
