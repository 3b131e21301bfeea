"""What the robot measures: one call a cycle, kept as snapshots that never block."""

from __future__ import annotations

import logging
import math
import threading
from collections import deque
from collections.abc import Iterable, Mapping
from typing import Final

from naoserver.body import H25
from naoserver.capabilities import SenseReading
from naoserver.errors import HardwareFailure
from naoserver.robot import FALLEN_TILT, BodyState, JointReading
from naoserver_naoqi.connection import SILENCE
from naoserver_naoqi.link import CallFailed, Link, call, is_nao6
from naoserver_naoqi.memory_keys import FARTHEST, Measurements, MemoryLayout
from naoserver_naoqi.setpoints import Setpoints
from zenoh_ice import Clock

__all__ = ["NaoqiSenses", "NaoqiSonar", "NaoqiState"]

_WINDOW: Final = 4
"""Measurements over which a velocity is taken that the robot does not tell: its cycle and ours drift."""
_LISTING: Final = 5.0
"""Seconds that the robot gets to list its keys, of which there are some thousand."""


class NaoqiState:
    """The newest measurements of a robot, and where its setpoints are."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._layout: MemoryLayout | None = None
        self._setpoints = Setpoints(H25.joints)
        self._lock = threading.Lock()  # of setpoints; held for microseconds
        self._history: deque[tuple[float, tuple[float, ...]]] = deque(maxlen=_WINDOW)
        self._newest: tuple[float, Measurements, tuple[float, ...]] | None = None  # replaced as a whole
        self._frozen: float | None = None

    def open(self, link: Link) -> None:
        """Find out which keys the robot has. Raises HardwareFailure when it is no Nao H25."""
        known = call(link, "ALMemory.getDataListName", timeout=_LISTING)
        nao6 = is_nao6(link)
        try:
            self._layout = MemoryLayout(known, nao6=nao6)
        except KeyError as error:
            kind = _kind(link)
            message = f"the robot, a {kind}, has no joint {error.args[0]}; only the Nao H25 can be served"
            raise HardwareFailure(message) from None
        self._history.clear()
        self._frozen = None

    def tick(self, link: Link) -> None:
        """Measure. Raises CallFailed, CallTimeout or LinkLost."""
        layout = self._layout
        assert layout is not None
        begun = self._clock.now()
        values = call(link, "ALMemory.getListData", layout.keys, timeout=SILENCE)
        time = (begun + self._clock.now()) / 2
        try:
            measured = layout.read(values, time)
        except (TypeError, ValueError) as error:
            raise CallFailed(f"ALMemory.getListData: {error}") from None
        self._history.append((time, measured.positions))
        first, positions = self._history[0]
        elapsed = time - first
        moved = zip(measured.velocities, measured.positions, positions, strict=True)
        velocities = tuple(
            velocity if not math.isnan(velocity) else (now - before) / elapsed if elapsed > 0.0 else 0.0
            for velocity, now, before in moved
        )
        with self._lock:
            self._setpoints.report(measured.commands, measured.positions, measured.stiffnesses, time)
        self._newest = (time, measured, velocities)

    def freeze(self) -> None:
        """Keep setpoints where they are from now on: the robot is lost."""
        self._frozen = self._clock.now()

    def joints(self) -> JointReading:
        """Return the newest reading of the joints; the setpoints are those of this moment."""
        time, measured, velocities = self._require()
        return JointReading(
            time=time,
            positions=measured.positions,
            velocities=velocities,
            commands=self.commands(),
            torques=measured.torques,
            stiffnesses=measured.stiffnesses,
            temperatures=measured.temperatures,
        )

    def commands(self) -> tuple[float, ...]:
        """Return the setpoint of every joint now."""
        with self._lock:
            return self._setpoints.at(self._now())

    def send(self, ways: Mapping[str, tuple[float, float]]) -> list[str]:
        """Let setpoints go to targets at speeds from now on, by joint; returns which of them that changes."""
        with self._lock:
            now = self._now()
            changed = [
                joint
                for joint, (target, _) in ways.items()
                if self._setpoints.moving(joint, now) or self._setpoints.value(joint, now) != target
            ]
            for joint in changed:
                self._setpoints.send(joint, *ways[joint], now)
        return changed

    def hold(self, joints: Iterable[str]) -> None:
        """Let setpoints stay where they are now."""
        with self._lock:
            now = self._now()
            for joint in joints:
                self._setpoints.hold(joint, now)

    def senses(self) -> SenseReading:
        """Return the newest reading of the senses."""
        return self._require()[1].senses

    def body(self) -> BodyState:
        """Return how the body is, by the inertial unit."""
        inertial = self.senses().inertial
        cosine = math.cos(inertial.roll) * math.cos(inertial.pitch)
        tilt = math.acos(min(1.0, max(-1.0, cosine)))
        return BodyState(torso_tilt=tilt, fallen=tilt > FALLEN_TILT, real_time_factor=1.0, lag=0.0)

    def _now(self) -> float:
        return self._clock.now() if self._frozen is None else self._frozen

    def _require(self) -> tuple[float, Measurements, tuple[float, ...]]:
        newest = self._newest
        if newest is None:
            raise HardwareFailure("the robot has not been asked yet: start it first")
        return newest


class NaoqiSenses:
    """The senses of the robot. Implements Senses."""

    touch_names = H25.touch_sensors
    sonar_range = (0.25, FARTHEST)
    sonar_cone = math.radians(60.0)

    def __init__(self, state: NaoqiState) -> None:
        self._state = state

    def read(self) -> SenseReading:
        """Return the newest snapshot."""
        return self._state.senses()


def _kind(link: Link) -> str:
    try:
        return str(call(link, "ALMemory.getData", "RobotConfig/Body/Type"))[:40]
    except HardwareFailure:
        return "robot of unknown kind"


_logger = logging.getLogger(__name__)

_NAME: Final = "naoserver-naoqi"


class NaoqiSonar:
    """Turn the sonar on, and off again."""

    def open(self, link: Link) -> None:
        """Turn it on; a robot without one has nothing near."""
        try:
            call(link, "ALSonar.subscribe", _NAME)
        except CallFailed as error:
            _logger.info("the sonar stays off: %s", error)

    def close(self, link: Link | None) -> None:
        """Turn it off, unless somebody else wants it."""
        if link is None:
            return
        try:
            call(link, "ALSonar.unsubscribe", _NAME, timeout=1.0)
        except HardwareFailure as error:
            _logger.debug("the sonar stays as it is: %s", error)
