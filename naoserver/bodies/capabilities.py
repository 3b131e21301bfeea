"""Optional abilities besides joints and cameras: gains, walk, balance, senses, lights, voice, sounds, stage.

Each is an attribute of `Robot`, None if the robot lacks it; the server adds servants for those that exist.
The contract of `naoserver.robot` applies here, too: methods may be called from any thread, reading methods
return the newest immutable snapshot without blocking, commands return at once. SI units and radians;
x forward, y left, z up.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Final, Literal, NamedTuple, Protocol, runtime_checkable

from naoserver.soccer_field import Field

Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class WalkVelocity:
    """A velocity on the floor in the robot's own frame: in m/s and, for the turn to the left, in rad/s."""

    forward: float = 0.0
    left: float = 0.0
    turn: float = 0.0


STILL: Final = WalkVelocity()


@dataclass(frozen=True, slots=True)
class Odometry:
    """Estimated place of the robot on the floor, in m, in the frame of its start."""

    time: float
    """Robot time in s."""
    x: float
    y: float
    heading: float
    """In rad, within (-pi, pi]."""


class JointCommand(NamedTuple):
    """What the motor of a joint follows: it gives kp (position - angle) + kd (velocity - speed) + torque.

    In rad, rad/s and N m, or m, m/s and N of a slide. It never takes the joint out of its range, or beyond
    its highest speed.
    """

    position: float
    velocity: float
    torque: float
    kp: float
    kd: float
    lower: float
    """The lower end of the range, which the angle of another joint may narrow."""
    upper: float
    max_speed: float


@runtime_checkable
class GainControl(Protocol):
    """Motors that follow commands with gains, as those of most humanoids; those of a Nao do not."""

    def command_gains(self, commands: Mapping[str, JointCommand]) -> None:
        """Let some motors follow commands, each until the next command of any kind to its joint.

        Meanwhile the setpoint of the joint is where the joint is. Stiffness limits the torque, as ever.
        """


@runtime_checkable
class Walker(Protocol):
    """The walk of a robot, on legs or on wheels."""

    @property
    def lag(self) -> float:
        """By how many s its velocity lags behind a command."""

    @property
    def joints(self) -> tuple[str, ...]:
        """The joints that belong to it while it walks: those of the legs, or the wheels."""

    @property
    def limits(self) -> WalkVelocity:
        """The highest velocity of each kind without the others; 0 if it cannot, as sideways on wheels."""

    def command(self, velocity: WalkVelocity) -> None:
        """Walk at a velocity until the next command; all 0 ends the walk, on both feet if it has feet.

        Raises InvalidCommand when it cannot walk now: it is not on its feet, or its joints are limp.
        """

    def commanded(self) -> WalkVelocity:
        """Return the newest command; all 0 once it has ended, also by a fall."""

    @property
    def ended(self) -> str:
        """Why the robot itself ended the newest walk, as text; empty if it did not, or does not say."""

    @property
    def failed(self) -> bool:
        """Whether it ended that walk as a part of it failed, so that it had better not walk again."""

    @property
    def walking(self) -> bool:
        """Whether it moves its joints: from a command until it stands again."""

    @property
    def balances(self) -> bool:
        """Whether it keeps a robot upright that stands: its joints then obey motions and postures only."""

    def odometry(self) -> Odometry:
        """Return where the robot believes it is, according to its joints and its inertial unit."""


class Support(Enum):
    """The feet over which a robot keeps its center of mass; values are NAOqi's names."""

    LEGS = "Legs"
    """Those that carry it."""
    LEFT = "LLeg"
    RIGHT = "RLeg"


@runtime_checkable
class Balancer(Protocol):
    """Small corrections of the legs, beside the commanded angles, that keep a standing robot upright."""

    def command(self, support: Support | None) -> None:
        """Keep the center of mass over feet until the next command; None ends it."""

    def support(self) -> Support | None:
        """Return the newest command."""


@dataclass(frozen=True, slots=True)
class InertialReading:
    """A reading of the inertial unit in the torso, in the torso's frame: by default upright at rest."""

    acceleration: Vector = (0.0, 0.0, 9.81)
    """Specific force in m/s2: (0, 0, 9.81) while it stands upright at rest."""
    angular_velocity: Vector = (0.0, 0.0, 0.0)
    """In rad/s."""
    roll: float = 0.0
    """Angle of the torso to the vertical in rad, positive to the right side."""
    pitch: float = 0.0
    """Angle of the torso to the vertical in rad, positive forwards."""

    @property
    def up(self) -> Vector:
        """Unit vector upwards: (0, 0, 1) upright, (-1, 0, 0) on the belly, (1, 0, 0) on the back."""
        across = math.cos(self.pitch)
        return -math.sin(self.pitch), math.sin(self.roll) * across, math.cos(self.roll) * across

    @property
    def tilt(self) -> float:
        """Angle between the torso's z axis and the vertical in rad."""
        return math.acos(max(-1.0, min(1.0, self.up[2])))


@dataclass(frozen=True, slots=True)
class FootReading:
    """Forces on the sensors of a sole in N, none below 0."""

    front_left: float = 0.0
    front_right: float = 0.0
    rear_left: float = 0.0
    rear_right: float = 0.0

    @property
    def total(self) -> float:
        """Load of the foot in N: the sum of the four."""
        return self.front_left + self.front_right + self.rear_left + self.rear_right


@dataclass(frozen=True, slots=True)
class SonarReading:
    """Distances in m to the nearest obstacle; infinite when nothing is in range."""

    left: float = math.inf
    right: float = math.inf


@dataclass(frozen=True, slots=True)
class BatteryReading:
    """The state of the battery."""

    charge: float = math.nan
    """From 0 to 1; nan when the robot reports none."""
    current: float = 0.0
    """In A, negative while it discharges."""
    temperature: float = math.nan
    """In degrees Celsius."""
    plugged: bool = False


@dataclass(frozen=True, slots=True)
class SenseReading:
    """Readings of all senses except joints and cameras at one moment.

    What the body lacks keeps its default: `Body` says which senses it has.
    """

    time: float
    """Robot time in s."""
    inertial: InertialReading = InertialReading()
    left_foot: FootReading = FootReading()
    right_foot: FootReading = FootReading()
    sonar: SonarReading = SonarReading()
    touched: frozenset[str] = frozenset()
    """Names of the pressed touch sensors, out of `Senses.touch_names`."""
    battery: BatteryReading = BatteryReading()


class Senses(Protocol):
    """The senses of a robot, except joints and cameras."""

    @property
    def touch_names(self) -> tuple[str, ...]:
        """The names of the touch sensors: those of the body, such as a button or a bumper."""

    @property
    def sonar_range(self) -> tuple[float, float] | None:
        """Nearest and farthest distance that the sonar measures, in m; None for a robot without one."""

    @property
    def sonar_cone(self) -> float:
        """Full angle of the sonar's cone in rad."""

    def read(self) -> SenseReading:
        """Return the newest snapshot without blocking."""

    def inertial(self) -> InertialReading:
        """Return the reading of the inertial unit only: a simulation need not measure distances for it."""


@dataclass(frozen=True, slots=True)
class SeenThing:
    """Something that a camera shows; the fields are those of `nao::SeenThing`."""

    kind: str
    name: str
    certainty: float
    camera: str
    time: float
    left: float
    down: float
    pan: float
    tilt: float
    distance: float
    distance_error: float
    x: float
    y: float


@dataclass(frozen=True, slots=True)
class SightReading:
    """What is seen in the newest picture of each camera."""

    time: float
    """Robot time of the newest picture in s."""
    things: tuple[SeenThing, ...] = ()


class Eyes(Protocol):
    """What knows without pictures what the cameras show: a simulation does."""

    def look(self) -> SightReading:
        """Return what is seen now; the same reading until there would be another picture."""

    @property
    def field(self) -> Field:
        """The soccer field that they look for, by default that of the Standard Platform League."""


Color = tuple[float, float, float]
"""Red, green and blue from 0 to 1."""


class Lights(Protocol):
    """The lights of a robot, in groups of one colour each."""

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the groups: those of the body."""

    def set(self, name: str, color: Color, seconds: float) -> None:
        """Fade a group to a colour within some seconds of robot time."""

    def reset(self) -> None:
        """Return every light to its colour after the start."""

    def colors(self) -> Mapping[str, Color]:
        """Return the present colour of each group."""


@dataclass(frozen=True, slots=True)
class Utterance:
    """The present or the last utterance."""

    text: str = ""
    speaking: bool = False
    count: int = 0
    """Number of texts begun since the start."""


class Voice(Protocol):
    """The voice of a robot."""

    def say(self, text: str) -> None:
        """Say a text after the earlier ones."""

    def stop(self) -> None:
        """Fall silent, and discard everything not yet said."""

    def utterance(self) -> Utterance:
        """Return the present utterance."""


@dataclass(frozen=True, slots=True)
class Tone:
    """A tone of a frequency in Hz, or a rest of frequency 0, for some seconds."""

    frequency: float
    seconds: float


@dataclass(frozen=True, slots=True)
class Sound:
    """Tones one after the other."""

    name: str
    tones: tuple[Tone, ...]
    description: str = ""
    """A line for people."""

    @property
    def duration(self) -> float:
        """Its length in s."""
        return sum(tone.seconds for tone in self.tones)


@dataclass(frozen=True, slots=True)
class Playback:
    """The present or the last sound."""

    name: str = ""
    tones: tuple[Tone, ...] = ()
    loudness: float = 0.0
    """From 0 to 1."""
    playing: bool = False
    count: int = 0
    """Number of sounds begun since the start."""
    samples: bytes = b""
    """Those that are due, of a sound that consists of samples."""
    place: int = -1
    """How many samples of the sound come before these; -1 while none are due."""


SAMPLE_RATE: Final = 16_000
"""Samples a second; each has 16 bits, little endian, of one channel."""


class Loudspeaker(Protocol):
    """Plays sounds, one at a time, beside what the voice says."""

    def play(self, sound: Sound, loudness: float) -> None:
        """Begin a sound at a loudness from 0 to 1; the sound before ends."""

    def play_samples(self, name: str, samples: bytes) -> int:
        """Play samples after those of the same name, or begin with them; return the count of the sound.

        Raises InvalidCommand for half a sample and for too many that wait, CommandRefused if it cannot.
        """

    def stop(self) -> None:
        """End the sound."""

    def playback(self) -> Playback:
        """Return the present sound."""


@dataclass(frozen=True, slots=True)
class Pose:
    """Position and orientation of an object in the world."""

    position: Vector
    """In m."""
    orientation: tuple[float, float, float, float]
    """Unit quaternion w, x, y, z."""

    @property
    def heading(self) -> float:
        """The direction of its x axis on the floor in rad, positive to the left."""
        w, x, y, z = self.orientation
        return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


@dataclass(frozen=True, slots=True)
class Truth:
    """True positions of everything in the world's frame, which only a simulation knows."""

    time: float
    """Robot time in s."""
    torso: Pose
    velocity: Vector
    """Velocity of the torso in m/s."""
    angular_velocity: Vector
    """Angular velocity of the torso in rad/s, in the world's frame."""
    objects: Mapping[str, Pose]
    """The balls and all other movable objects, by name."""


@dataclass(frozen=True, slots=True)
class WorldShape:
    """A visible shape of the world, with the members of `nao::WorldShape`."""

    kind: Literal["Plane", "Box", "Sphere", "Capsule", "Ring"]
    size: Vector
    pose: Pose
    color: Color
    opacity: float = 1.0
    object: str = ""


@runtime_checkable
class Stage(Protocol):
    """The scene around a simulated robot: only a simulation has one."""

    @property
    def shapes(self) -> Sequence[WorldShape]:
        """Everything visible except the robot."""

    @property
    def objects(self) -> tuple[str, ...]:
        """The names of the objects that can be placed."""

    def truth(self) -> Truth:
        """Return where everything is."""

    def reset(self) -> None:
        """Put the robot and everything else back to their start; time continues."""

    def place_object(self, name: str, position: Vector) -> None:
        """Put an object at rest at a position, turned as at the start. Raises InvalidCommand if it cannot."""

    def place_robot(
        self, x: float, y: float, heading: float, end_motion: Callable[[], None] = lambda: None
    ) -> None:
        """Put the robot on its feet at a place on the floor; call `end_motion` before, if there is room."""

    def push(self, force: Vector, seconds: float) -> None:
        """Push the torso with a force in N in the world's frame, for some seconds of robot time."""

    def press(self, sensor: str, seconds: float) -> None:
        """Press a touch sensor for some seconds of robot time."""


@dataclass(frozen=True, slots=True)
class PostureProgress:
    """Progress of the way to a posture."""

    name: str = ""
    moving: bool = False
    reached: bool = False
    message: str = ""
    """Why it was not reached, as text."""


class OwnPostures(Protocol):
    """A robot that can itself go from any posture into another, as NAOqi does.

    For other robots, the server's own key frames do so (`naoserver.moves`).
    """

    @property
    def names(self) -> tuple[str, ...]:
        """The postures that it can go to."""

    def go(self, name: str, fraction: float) -> None:
        """Begin to go to a posture at a fraction of full pace."""

    def stop(self) -> None:
        """Stop on the way to a posture."""

    def current(self) -> str:
        """Return the posture that it is in; empty when it is in none."""

    def progress(self) -> PostureProgress:
        """Return the progress of the newest way."""
