"""The state of the robot, as far as its servers stream it; any of them may be missing."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Final, NamedTuple

import msgspec

from codegen.messages import Message
from hfsm_runtime.recording_file.messages import Fault
from interfaces.jderobot import CameraPrx
from interfaces.nao import (
    ClockPrx,
    HealthPrx,
    HealthReport,
    JointLimits,
    JointsPrx,
    PoseHeadPrx,
    SafetyPrx,
    SoundsPrx,
    SoundState,
    SpeechPrx,
    SpeechState,
)
from visualhfsm._monitor.realm.body import BODY, STALE, BodyMonitor, Others
from visualhfsm._monitor.realm.description import DescribedRobot
from visualhfsm._monitor.realm.faults import FaultMonitor
from visualhfsm._monitor.realm.realm import DRY_RUN_PREFIX, MONITOR_PREFIX, Newest, PolledValue, has_interface
from visualhfsm._monitor.realm.world import Placement, WorldMonitor
from zenoh_ice import Communicator
from zenoh_ice.data.text import printable

_STALE_HEALTH: Final = 2.0
"""Wall seconds after which a report of health or safety, which are sent twice a second, is too old."""
_LONGEST_REASON: Final = 200
LONGEST_TEXT: Final = 2000
LONGEST_NAME: Final = 100
_PARTS: Final = frozenset({BODY, "Health", "Head"})
"""Identities of which every robot has one."""
_ANNOUNCED: Final = "Safety"
"""The identity of what every robot has: when it is there, it has announced all that it serves."""


class RobotState(msgspec.Struct, frozen=True, rename="camel"):
    """The state of the robot; fields that are unknown or too old are empty."""

    joints: dict[str, float] = {}
    """Angles in rad by joint, and of those that slide, places in m."""
    pan: float | None = None
    """Yaw of the head in rad, positive to the left."""
    tilt: float | None = None
    """Pitch of the head in rad, positive downwards."""
    health: HealthReport | None = None
    torso: Placement | None = None
    """The place of the torso, known only in a simulation."""
    objects: dict[str, Placement] = {}
    """The places of the balls and other movable objects, by name."""
    trouble: str = ""
    """Why the joints of a present robot are unknown."""
    sliding: tuple[str, ...] = ()
    """The joints that slide instead of turning."""
    says: str = ""
    """The text that is being said."""
    sound: str = ""
    """The name of the sound that is being played."""
    failing: tuple[Fault, ...] = ()
    """What somebody has made to fail."""


def posed_robot(joints: dict[str, float], described: DescribedRobot) -> RobotState:
    """Return the state of a robot of which only the joints are known, such as the fake one of a dry run."""
    return RobotState(joints, *described.head(joints), sliding=described.sliding)


def audible(speech: SpeechState | None, sound: SoundState | None) -> tuple[str, str]:
    """Return the text that is said and the name of the sound that is played, cut to their bounds."""
    return (
        printable(speech.text, LONGEST_TEXT) if speech is not None and speech.speaking else "",
        printable(sound.name, LONGEST_NAME) if sound is not None and sound.playing else "",
    )


class RobotPresence(NamedTuple):
    """Whether the realm has a robot, and what kind of robot it is."""

    present: bool = False
    simulated: bool = False
    speed: float = 0.0
    """Measured robot seconds per second of wall time, in tenths."""
    has_balls: bool = False
    """True if it has balls that can be moved."""
    stopped: str | None = None
    """Why its emergency stop is latched; empty while it is not, None while that is not known."""
    title: str = ""
    """Its name for people, if it is known."""
    postures: tuple[str, ...] = ()
    """The postures that it can be brought into, as far as they are known."""
    others: tuple[tuple[str, str], ...] = ()
    """The other robots of its world, each with its realm, and its name for people."""
    serves: tuple[str, ...] = ()
    """The identities of what it and others serve in its realm, once it has announced all."""


class RobotFacts(msgspec.Struct, frozen=True, rename="camel"):
    """Constants: the cameras' names, and the limits of the joints once they are known."""

    cameras: list[str]
    limits: list[JointLimits]


class RobotMonitor:
    """Listen to the robot of a realm; `update` it a few times a second."""

    def __init__(self, communicator: Communicator) -> None:
        self._communicator = communicator
        proxy = communicator.stringToProxy
        self._head = Newest(PoseHeadPrx.uncheckedCast(proxy("Head")).getPose.latest)
        self._body = BodyMonitor(communicator, communicator.realm)
        self._health = Newest(HealthPrx.uncheckedCast(proxy("Health")).getHealth.latest)
        self._safety = Newest(
            SafetyPrx.uncheckedCast(proxy("Safety")).getSafetyState.latest, oldest=_STALE_HEALTH
        )
        self._clock = Newest(ClockPrx.uncheckedCast(proxy("Clock")).getTime.latest)
        self._limits = PolledValue(JointsPrx.uncheckedCast(proxy(BODY)).getJointLimits.begin)
        self.world: Final = WorldMonitor(communicator)
        self.others: Final = Others(communicator)
        """The other robots of its world, which who draws them updates."""
        self.faults: Final = FaultMonitor(communicator)
        self._speech = Newest(SpeechPrx.uncheckedCast(proxy("Speech")).getSpeech.latest)
        self._sound = Newest(SoundsPrx.uncheckedCast(proxy("Sounds")).getSound.latest)

    def update(self) -> None:
        """Request missing data; without a robot, request nothing."""
        self.world.update()
        self.faults.update()
        self._body.update()
        if self._body.is_present:
            self._limits.poll()
        else:
            self._safety.forget()  # another robot may appear
            self._limits.forget()

    @property
    def described(self) -> DescribedRobot | None:
        """The robot as it is drawn, as `BodyMonitor` has it."""
        return self._body.described

    @property
    def undescribed(self) -> Message:
        """Why a present robot cannot be drawn; empty for one that can, or that is not known yet."""
        return self._body.undescribed

    def facts(self) -> RobotFacts:
        """Return the constants."""
        return RobotFacts(self.cameras(), list(self._limits.value or ()))

    def cameras(self) -> list[str]:
        """Return the identities of the present cameras."""
        return [
            identity
            for identity in self._communicator.identities()
            if has_interface(self._communicator, identity, CameraPrx.ice_interface.type_id)
        ]

    def joints(self, oldest: float = STALE) -> dict[str, float]:
        """Return the angles of the joints in rad by name; none when unknown or older than `oldest` s."""
        return self._body.joints(oldest)

    def tilt(self) -> float | None:
        """Return the angle between the torso's z axis and the vertical in rad; None when it is unknown."""
        health = self.read().health
        return health.torsoTilt if health is not None and math.isfinite(health.torsoTilt) else None

    def presence(self) -> RobotPresence:
        """Return whether the realm has a robot, without waiting."""
        identities = self._communicator.identities()
        if _PARTS.isdisjoint(identities):
            return RobotPresence()
        clock, health = self._clock(), self._health()
        simulated = clock is not None and clock.value.simulated
        factor = math.nan if health is None else health.value.realTimeFactor
        described = self.described
        return RobotPresence(
            present=simulated or factor != 0.0,  # the server stays present while a real robot is lost
            simulated=simulated,
            speed=round(factor, 1) if math.isfinite(factor) else 0.0,
            has_balls="BallRedMotors" in identities,
            stopped=self.stop_reason(),
            title=described.title if described else "",
            postures=described.postures if described else (),
            others=tuple((name, each.title) for name, (_, each) in self.others.bodies().items()),
            serves=_serves(identities),
        )

    def stop_reason(self) -> str | None:
        """Return why the robot's emergency stop is latched; empty while it is not, None if it is unknown."""
        safety = self._safety()
        if safety is None or not safety.value.stopped:
            return None if safety is None else ""
        return printable(safety.value.reason)[:_LONGEST_REASON] or "emergency stop"

    def age(self) -> float:
        """Return the wall seconds since the robot sent anything; infinite when it never did."""
        samples = (self._head(), self._body.state(), self._health())
        return min((sample.age for sample in samples if sample is not None), default=math.inf)

    def read(self, *, stale: bool = False) -> RobotState:
        """Return the present state without waiting; with `stale`, include old values."""
        oldest, oldest_health = (math.inf, math.inf) if stale else (STALE, _STALE_HEALTH)
        head, health = self._head(), self._health()
        pose = head.value if head is not None and head.age <= oldest else None
        says, sound = self.heard()
        return RobotState(
            joints=self.joints(oldest),
            pan=pose.pan if pose else None,
            tilt=pose.tilt if pose else None,
            health=health.value if health is not None and health.age <= oldest_health else None,
            torso=self.world.torso(),
            objects=self.world.objects(),
            trouble=self._trouble(),
            sliding=described.sliding if (described := self.described) else (),
            says=says,
            sound=sound,
            failing=self.faults.now(),
        )

    def heard(self) -> tuple[str, str]:
        """Return the text that is said and the name of the sound that is played; empty ones in silence."""
        present = self._communicator.identities()
        speech = self._speech() if "Speech" in present else None
        sound = self._sound() if "Sounds" in present else None
        return audible(speech.value if speech else None, sound.value if sound else None)

    def _trouble(self) -> str:
        """Return why the joints of a present robot are unknown, such as an interface that differs."""
        if not self._body.is_present:
            return ""
        return printable(self._body.state.trouble or self._body.names.trouble)[:_LONGEST_REASON]


def _serves(identities: Collection[str]) -> tuple[str, ...]:
    if _ANNOUNCED not in identities:
        return ()
    return tuple(sorted(each for each in identities if not each.startswith((MONITOR_PREFIX, DRY_RUN_PREFIX))))
