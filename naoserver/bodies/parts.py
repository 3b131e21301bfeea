"""The parts of a robot's body, as data: links, joints, groups, cameras, sensors, postures, ways to move.

Units are SI and rad. Frames: x forward, y left, z up; a link's frame is at its parent joint and moves with
the link. Quaternions are (w, x, y, z).
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import astuple
from enum import StrEnum
from functools import cached_property
from itertools import pairwise
from typing import Annotated, Final, Literal

from msgspec import Meta, Struct, field
from msgspec.structs import replace

from naoserver.bodies.capabilities import Color, FootReading
from naoserver.bodies.footsteps import Footsteps
from naoserver.errors import RobotError
from zenoh_ice.data.text import sentence

_Length = Annotated[float, Meta(ge=-1000.0, le=1000.0, description="write m, from -1000 to 1000")]
Vector = tuple[_Length, _Length, _Length]
Quaternion = tuple[float, float, float, float]
NO_TURN: Final[Quaternion] = (1.0, 0.0, 0.0, 0.0)
NOWHERE: Final[Vector] = (0.0, 0.0, 0.0)

Range = tuple[float, float]
"""The lower and the upper limit."""

_Positive = Annotated[float, Meta(gt=0.0, description="write a number above 0")]
_NotNegative = Annotated[float, Meta(ge=0.0, description="write a number, at least 0")]
_Pixels = Annotated[int, Meta(ge=1, le=10_000, description="write a number of pixels, 10000 at most")]
Name = Annotated[
    str,
    Meta(
        max_length=64,
        pattern=r"\A[^\x00-\x1f\x7f\ud800-\udfff]+\Z",
        description="write a name of 1 to 64 printable characters",
    ),
]

CORNERS: Final = ("FrontLeft", "FrontRight", "RearLeft", "RearRight")
"""The pressure sensors of a sole, in the order of a `FootReading`."""
MOST_PARTS: Final = 1000
"""Most links, joints and shapes of a body."""
MOST_CAMERAS: Final = 16


class _Part(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A part of the description; `source` and `note` say where its figures come from."""

    source: str = ""
    note: str = ""


class Motor(_Part, frozen=True):
    """The data sheet of a joint's motor, at the joint: behind the gear, without the losses in it."""

    no_load_speed: _Positive
    """In rad/s."""
    stall_torque: _Positive
    """In N m."""
    continuous_torque: _Positive
    """In N m: what the motor bears without end without getting too hot."""
    model: str = ""
    gear_ratio: float = 0.0


class JointFacts(Struct, frozen=True):
    """The limits of a joint: rad, rad/s and N m of a hinge; m, m/s and N of a linear axis.

    The range of a joint that turns without end is infinite.
    """

    name: str
    lower: float
    upper: float
    max_velocity: float
    max_torque: float
    """0 for a passive joint: it has no motor and moves with what touches it."""

    @property
    def passive(self) -> bool:
        """Whether it has no motor: it is read as any other, and never commanded."""
        return self.max_torque == 0.0


class Joint(JointFacts, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A joint of the body with its place in the tree of links."""

    name: Name
    parent: Name
    """Link that carries the joint."""
    child: Name
    """Link that the joint moves."""
    axis: Vector
    """Unit vector in the child's frame; a positive angle is right-handed about it."""
    origin: Vector
    """Place of the child's frame in the parent's frame in m."""
    turn: Quaternion = NO_TURN
    """Rotation of the child's frame in the parent's frame at the angle 0."""
    lower: float = -math.inf
    upper: float = math.inf
    sliding: bool = False
    """Whether it slides along the axis instead of turning about it."""
    gear: str = ""
    """Its servo and gear, out of `Body.gears`."""
    motor: Motor | None = None
    source: str = ""
    note: str = ""


class Gear(_Part, frozen=True):
    """A servo and its gear, as they are simulated; of a passive joint, its spring and its bearings."""

    stiffness: _NotNegative
    """Torque in N m for each rad between the joint and its setpoint, or the `rest` of a passive joint."""
    damping: _NotNegative = 0.0
    """Torque in N m for each rad/s, by the servo."""
    friction_damping: _NotNegative = 0.0
    """The same by the bearings, also of a limp joint."""
    friction: _NotNegative = 0.0
    """Friction at any speed in N m."""
    inertia: _NotNegative = 0.0
    """Inertia of the rotor behind the gear in kg m2."""
    rest: float = 0.0
    """Angle in rad to which the spring of a passive joint pulls it."""


class Gains(_Part, frozen=True):
    """The highest gains that the motors of a body take by command."""

    kp: _Positive
    """In N m/rad."""
    kd: _Positive
    """In N m s/rad."""


class Inertia(Struct, frozen=True, forbid_unknown_fields=True):
    """Moments and products of inertia about the centre of mass in link axes in kg m^2."""

    ixx: float = 0.0
    ixy: float = 0.0
    ixz: float = 0.0
    iyy: float = 0.0
    iyz: float = 0.0
    izz: float = 0.0


class Link(_Part, frozen=True):
    """A rigid part of the body."""

    name: Name
    mass: _NotNegative
    """In kg; 0 for a part whose mass is included in its neighbor's."""
    com: Vector = NOWHERE
    """Centre of mass in m."""
    inertia: Inertia = Inertia()
    ros_name: Name | None = None
    """Its frame in ROS; by default its name."""


class Coupling(_Part, frozen=True):
    """Two joints that one motor drives, or that move together without one; the leader's command wins."""

    leader: Name
    follower: Name
    ratio: float = 1.0
    """Angle of the follower for each rad of the leader."""
    offset: float = 0.0
    """Angle of the follower in rad where the leader is at 0."""

    def of(self, leader: float) -> float:
        """Return the follower's angle at an angle of the leader."""
        return self.offset + self.ratio * leader

    def reversed(self) -> Coupling:
        """Return the coupling by which the follower leads the leader alike."""
        ratio, offset = 1.0 / self.ratio, -self.offset / self.ratio
        return Coupling(leader=self.follower, follower=self.leader, ratio=ratio, offset=offset)


class Loop(_Part, frozen=True):
    """A place where two links hold each other, which closes a chain of links to a loop."""

    first: Name
    second: Name
    place: Vector
    """In m in the frame of `first`."""
    other: Vector
    """The same place in the frame of `second`."""
    turn: Quaternion | None = None
    """Rotation of `second` in the frame of `first`, if they cannot turn against each other either."""


class RangeTable(Struct, frozen=True, forbid_unknown_fields=True, dict=True):
    """The range of the joint `dependent` at each angle of the joint `independent`, linear between rows."""

    independent: str
    dependent: str
    rows: tuple[tuple[float, float, float], ...]
    """Angle of `independent`, then lower and upper limit of `dependent`, in rad, by increasing angle."""
    source: str = ""

    def __post_init__(self) -> None:
        if not self.rows:
            raise RobotError(f"range table of {self.dependent}: no rows")
        for before, after in pairwise(self.rows):
            if not before[0] < after[0]:
                raise RobotError(f"range table of {self.dependent}: angle {after[0]} does not increase")
        for angle, lower, upper in self.rows:
            if lower > upper:
                raise RobotError(f"range table of {self.dependent}: empty range at {angle} rad")

    @cached_property
    def steepest(self) -> float:
        """Largest change of a limit of `dependent` per rad of `independent`."""
        slopes = (
            max(abs(after[1] - before[1]), abs(after[2] - before[2])) / (after[0] - before[0])
            for before, after in pairwise(self.rows)
        )
        return max(slopes, default=0.0)

    def at(self, angle: float) -> tuple[float, float]:
        """Return the range of `dependent` at `angle` of `independent`; beyond the table, that at its edge."""
        rows = self.rows
        place = bisect_left(rows, (angle,))
        if place == 0:
            return rows[0][1:]
        if place == len(rows):
            return rows[-1][1:]
        left, right = rows[place - 1], rows[place]
        share = (angle - left[0]) / (right[0] - left[0])
        return left[1] + share * (right[1] - left[1]), left[2] + share * (right[2] - left[2])

    def over(self, angles: Sequence[float]) -> tuple[float, float]:
        """Return the range that is allowed everywhere between the least and the greatest of `angles`.

        The range is piecewise linear, so its narrowest points lie at the ends and at the rows between.
        """
        first, last = min(angles), max(angles)
        ranges = [self.at(first), self.at(last)]
        ranges += [row[1:] for row in self.rows if first < row[0] < last]
        lowers, uppers = zip(*ranges, strict=True)
        return max(lowers), min(uppers)


class SpeedRule(_Part, frozen=True):
    """Some joints are slower while others are in a posture, such as the arms while the knees are straight."""

    slower: tuple[str, ...]
    fraction: Annotated[float, Meta(gt=0.0, le=1.0, description="write a fraction above 0, at most 1")]
    """The limit of their speeds, as a fraction of their full speed."""
    while_below: dict[str, float] = {}
    """The rule applies while each of these joints is below its angle in rad; always, if it names none."""


class Axis(StrEnum):
    """An axis of a Pose3D device, named as the member of the interface that holds it."""

    X = "x"
    Y = "y"
    Z = "z"
    PAN = "pan"
    TILT = "tilt"
    ROLL = "roll"


class HingeAxis(Struct, frozen=True, forbid_unknown_fields=True):
    """The joint of a hinge's axis: the axis is at 0 where the joint is at `zero`, and turns with its `sign`.

    The axes of a humanoid's hinges mean the same whatever the zeros of its joints: a shoulder's tilt is 0
    with the arm forwards and pi/2 when it hangs, its roll and an elbow's are 0 in the direction of the limb.
    """

    joint: str
    sign: Literal[1, -1] = 1
    zero: float = 0.0
    """In rad."""

    def of(self, angle: float) -> float:
        """Return the angle of the axis at an angle of the joint."""
        return self.sign * (angle - self.zero)

    def joint_angle(self, angle: float) -> float:
        """Return the angle of the joint at an angle of the axis: undo `of`."""
        return self.sign * angle + self.zero


class Hinge(Struct, frozen=True):
    """Joints that JdeRobot serves as one Pose3D device, as `{name}Motors` and `{name}Encoders`."""

    name: str
    axes: Mapping[Axis, HingeAxis]
    """The axes that the hinge has."""

    @property
    def joints(self) -> tuple[str, ...]:
        """Its joints, in the order of the axes."""
        return tuple(axis.joint for axis in self.axes.values())


class Groups(_Part, frozen=True):
    """The joints of each limb, from the trunk outwards."""

    head: tuple[str, ...] = ()
    left_arm: tuple[str, ...] = ()
    right_arm: tuple[str, ...] = ()
    left_leg: tuple[str, ...] = ()
    right_leg: tuple[str, ...] = ()
    trunk: tuple[str, ...] = ()
    wheels: tuple[str, ...] = ()

    @property
    def legs(self) -> tuple[str, ...]:
        """The joints of both legs."""
        return self.left_leg + self.right_leg

    @property
    def arms(self) -> tuple[str, ...]:
        """The joints of both arms."""
        return self.left_arm + self.right_arm


class CameraFacts(Struct, frozen=True):
    """Abilities and place of a camera."""

    name: str
    """Identity under which it is served: `Camera` (the first one), `CameraBottom`, `CameraOutside`."""
    position: tuple[float, float, float]
    """Place in m in its link's frame or, for a camera that is not on the robot, in the world's frame."""
    tilt: float
    """Pitch in that frame in rad, positive looks down."""
    horizontal_fov: Annotated[float, Meta(gt=0.0, lt=math.pi, description="write rad above 0, below pi")]
    """Horizontal field of view in rad. Pixels are square: the vertical one follows from the image's shape."""
    sizes: Annotated[tuple[tuple[_Pixels, _Pixels], ...], Meta(min_length=1)]
    """Width and height in pixels of each image size that it supports."""
    rates: tuple[_Positive, ...]
    """Highest image rate at each of `sizes`, in 1/s; every lower rate is supported, too."""

    def focal_length(self, width: int) -> float:
        """Return the focal length in pixels of images of some width."""
        return width / 2 / math.tan(self.horizontal_fov / 2)


class Camera(CameraFacts, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A camera on the body."""

    name: Name
    link: Name
    ros_name: Name | None = None
    """The beginning of its frames in ROS; by default its name."""
    source: str = ""


_Share = Annotated[float, Meta(ge=0.0, le=1.0, description="write a share from 0 to 1")]


class SeenKind(_Part, frozen=True):
    """How well the cameras see things of a kind; errors are standard deviations."""

    farthest: _Positive
    """Distance in m up to which they are seen."""
    missed: _Share = 0.0
    """Share of looks that miss one although it shows."""
    invented: _Share = 0.0
    """How many a picture shows that are not there."""
    direction: _NotNegative = 0.0
    """Error of the direction in rad."""
    distance: _NotNegative = 0.0
    """Error of the distance as a share of it, of what is not seen on the floor."""


SEEN: Final[Mapping[str, SeenKind]] = {
    "ball": SeenKind(farthest=6.0, missed=0.05, invented=0.003, direction=0.0033, distance=0.05),
    "robot": SeenKind(farthest=5.0, missed=0.2, direction=0.027, distance=0.1),
    "goalpost": SeenKind(farthest=8.0, missed=0.1, invented=0.002, direction=0.01, distance=0.1),
    "crossing": SeenKind(farthest=3.0, missed=0.2, invented=0.002, direction=0.005),
    "line": SeenKind(farthest=3.0, missed=0.2, invented=0.01, direction=0.004),
    "tag": SeenKind(farthest=3.0, missed=0.03, direction=0.003, distance=0.03),
    "face": SeenKind(farthest=3.0, missed=0.1, direction=0.01, distance=0.1),
    "box": SeenKind(farthest=4.0, missed=0.1, direction=0.01, distance=0.1),
}
"""Of balls and robots as `benchmarks/bench_eyes.py` measures eyes in noisy pictures; the rest is assumed.

Their ranges, and the errors of distances in the air, are assumed, too.
"""


class Sight(_Part, frozen=True):
    """How well eyes see what the cameras show, as a simulation imitates them where it is not exact."""

    rate: _Positive = 15.0
    """Looks a second."""
    delay: Annotated[float, Meta(ge=0.0, le=0.15, description="write s, 0.15 at most")] = 0.08
    """Seconds from the moment of a picture until it is known what it shows."""
    lean: _NotNegative = 0.008
    """Error in rad, a standard deviation, of how the robot leans, as long as it runs."""
    sway: _NotNegative = 0.008
    """The same from one picture to the next, which turns all that it shows: a robot may walk.

    A simulated Nao's inertial unit and joints err so with noise: by 0.008 and 0.003 standing, 0.009 walking.
    """
    kinds: dict[str, SeenKind] = field(default_factory=lambda: dict(SEEN))


class Place(_Part, frozen=True):
    """A place on a link."""

    link: Name
    position: Vector = NOWHERE
    """In m."""
    angles: Vector = NOWHERE
    """Roll, pitch and yaw in rad: about the link's x, then y, then z axis."""


class InertialUnit(_Part, frozen=True):
    """The accelerometer and the gyroscope, in the root link."""

    accelerometer: Vector
    """In m."""
    gyrometer: Vector


class TouchSensor(Place, frozen=True):
    """A touch sensor; one with a `field` feels contacts, the others are pressed by the scene's `press`."""

    field: tuple[Vector, Vector] | None = None
    """Middle and half sides in m of the box in front of it, through which it feels forces of contacts."""
    ros_name: Name | None = None
    """The beginning of its frame in ROS; by default its name."""


class Sole(_Part, frozen=True):
    """The sole of a foot: a plane below its link."""

    link: Name
    outline: Annotated[tuple[tuple[_Length, _Length], ...], Meta(min_length=3)]
    """Its convex outline in m, x and y in the link's frame."""
    height: _NotNegative
    """Height in m of the link's frame above the plane."""
    pressure: dict[str, Vector] = {}
    """Places of its pressure sensors in m: none, or `FrontLeft`, `FrontRight`, `RearLeft` and `RearRight`."""

    def center(self, foot: FootReading) -> tuple[float, float]:
        """Return x and y of the center of the forces in m in the link's frame; 0 for a free foot."""
        if foot.total <= 0.0:
            return 0.0, 0.0
        places = (self.pressure.get(corner, NOWHERE) for corner in CORNERS)
        moments = [(force * x, force * y) for force, (x, y, _) in zip(astuple(foot), places, strict=True)]
        x, y = map(sum, zip(*moments, strict=True))
        return x / foot.total, y / foot.total


class Sonar(_Part, frozen=True):
    """Two distance sensors on the root link that look ahead, to the left and to the right."""

    left: Place
    right: Place
    cone: _Positive
    """Full angle of the cones in rad."""
    nearest: _Positive
    """Range in m."""
    farthest: _Positive

    def __post_init__(self) -> None:
        if not self.nearest < self.farthest:
            raise RobotError(f"sonar: its range from {self.nearest:g} to {self.farthest:g} m is empty")


ShapeKind = Literal["box", "sphere", "capsule", "cylinder", "ellipsoid", "hull"]
SHAPE_SIZES: Final[Mapping[ShapeKind, int]] = {
    "box": 3,
    "ellipsoid": 3,
    "sphere": 1,
    "capsule": 2,
    "cylinder": 2,
    "hull": 0,
}
"""The number of sizes of each kind of shape; a capsule between its `ends` has one."""
MOST_POINTS: Final = 32
"""Most points of a hull."""
_THINNEST: Final = 1e-4
"""Least half side in m of the box around a hull."""


class Shape(_Part, frozen=True):
    """A simple shape of a link that touches things."""

    link: Name
    kind: ShapeKind
    size: tuple[_Positive, ...] = ()
    """Half sides of a box, half axes of an ellipsoid, the radius of a sphere; radius and half length, along
    z, of a cylinder and of a capsule, or only the radius of a capsule between its `ends`; none of a hull."""
    position: Vector = NOWHERE
    turn: Quaternion = NO_TURN
    ends: tuple[Vector, Vector] | None = None
    points: Annotated[tuple[Vector, ...], Meta(max_length=MOST_POINTS)] = ()
    """Corners of a hull in m in the link's frame: it is the least convex shape that has them all."""
    friction: _Positive | None = None
    """Sliding friction with anything; by default the larger one of both counts."""
    name: str = ""

    def boxed(self) -> Shape:
        """Return the box around a hull, for what knows no hulls; any other shape as it is."""
        if self.kind != "hull":
            return self
        sides = [(min(along), max(along)) for along in zip(*self.points, strict=True)]
        size = tuple(max((high - low) / 2, _THINNEST) for low, high in sides)
        x, y, z = ((low + high) / 2 for low, high in sides)
        return replace(self, kind="box", size=size, position=(x, y, z), points=())


class Stance(StrEnum):
    """The part on which the body rests."""

    STANDING = sentence("standing")
    SITTING = sentence("sitting")
    BELLY = sentence("lying on its belly")
    BACK = sentence("lying on its back")
    LEFT_SIDE = sentence("lying on its left side")
    RIGHT_SIDE = sentence("lying on its right side")


class Posture(_Part, frozen=True):
    """An angle in rad for each joint."""

    stance: Stance
    angles: dict[str, float]


class Lamp(_Part, frozen=True):
    """A group of lights of one color."""

    start: Color
    """Its color after the start."""
    single_colored: bool = False
    """Whether that color is all that it can show, more or less bright."""


class Battery(_Part, frozen=True):
    """The battery."""

    voltage: _Positive
    """Nominal voltage in V."""
    energy: _Positive
    """Capacity in J."""
    electronics: _NotNegative = 0.0
    """Power in W of everything except the motors."""


class MotorHeat(_Part, frozen=True):
    """The temperatures of the motors that matter, in degrees Celsius."""

    hot: float
    """Above it a motor gives less torque."""
    too_hot: float
    """At it a motor gives none."""
    cool: float
    """Below it a hot motor counts as cool again."""

    def __post_init__(self) -> None:
        if not self.cool <= self.hot < self.too_hot:
            raise RobotError(f"motor_heat: {self.cool:g}, {self.hot:g} and {self.too_hot:g} do not increase")


LYING_TILT: Final = math.radians(60)
"""Tilt of the torso in rad beyond which most robots lie rather than stand, crouch or sit."""


class FallRules(_Part, frozen=True):
    """When a robot on feet is falling, as its fall manager decides."""

    standing_load: _Positive
    """Least load on the soles in N with which it stands on its feet."""
    lying_load: _NotNegative
    """Load on the soles in N below which it is off its feet: the heels of a lying robot carry less."""
    lying_tilt: _Positive = LYING_TILT
    """Tilt of the torso in rad beyond which it lies: less for a body that falls into a heap."""


class Kick(_Part, frozen=True):
    """Where the middle of a ball must lie for a motion to kick it straight ahead: a rectangle on the floor.

    In the robot's frame as it stands before the kick: on the floor below the root, upright, in its heading.
    """

    x: Range
    """The nearest and the farthest place in m."""
    y: Range
    """From the right to the left in m."""
    rolls: _Positive | None = None
    """How far it rolls then in m, if that is known."""

    @property
    def place(self) -> tuple[float, float]:
        """The best place, x and y in m: the middle."""
        return sum(self.x) / 2, sum(self.y) / 2

    def reaches(self, x: float, y: float) -> bool:
        """Return whether a ball at a place in m would be kicked."""
        return self.x[0] <= x <= self.x[1] and self.y[0] <= y <= self.y[1]


class Play(_Part, frozen=True):
    """How imperfect the gears of a robot are, in a simulation with noise."""

    delay: Annotated[int, Meta(ge=0, le=10, description="write a number of ticks, 10 at most")]
    """Control ticks of 10 ms until a command has reached its motor."""
    least_backlash: _NotNegative
    """Backlash of a joint in rad, drawn once from this range."""
    most_backlash: _NotNegative

    def __post_init__(self) -> None:
        if self.least_backlash > self.most_backlash:
            raise RobotError(
                f"play: its backlash from {self.least_backlash:g} to {self.most_backlash:g} rad is empty"
            )


class Steps(_Part, frozen=True, tag="steps", tag_field="kind"):
    """The walk of a Nao: light, with fast steps in the rhythm in which its body rocks."""


class Wheels(_Part, frozen=True, tag="wheels", tag_field="kind"):
    """Two driven wheels side by side, which turn the robot by the difference of their speeds."""

    left: str
    """Joint of the left wheel, whose positive angle drives forwards."""
    right: str
    radius: _Positive
    """Of a wheel in m."""
    distance: _Positive
    """From wheel to wheel in m."""
    fastest: _Positive
    """Highest speed in m/s."""
    fastest_turn: _Positive
    """In rad/s."""
    acceleration: _Positive = 1.0
    """In m/s2."""


Walk = Steps | Footsteps | Wheels
