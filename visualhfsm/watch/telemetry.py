"""Listen to a component and its robot, and keep what was heard."""

from __future__ import annotations

import math
import threading
from collections.abc import Mapping, Sequence
from types import TracebackType
from typing import Final, Self, TypeVar

from interfaces.hfsm import ComponentSnapshot, HfsmMonitorPrx
from interfaces.jderobot import CameraPrx
from interfaces.nao import HealthPrx, JointsPrx, PoseHeadPrx
from visualhfsm.watch.album import Album, picture_from
from visualhfsm.watch.automata import Automata
from visualhfsm.watch.discovery import MONITOR_PREFIX
from visualhfsm.watch.fact import Fact
from visualhfsm.watch.recording import ARM_JOINTS, Ball, Recording, RobotReading, read_ball
from visualhfsm.watch.scene import STALE, STALE_HEALTH, Aged, Scene
from visualhfsm.watch.streams import Newest
from zenoh_ice import Communicator, ObjectPrx, Sample

__all__ = ["Telemetry"]

_CHANGES_SHOWN: Final = 100
_CAMERA: Final = "Camera"
_IMAGE_SIZE: Final = (320, 240)
_RGB8: Final = "RGB8"
_ARMS: Final = frozenset(side + name for side in "LR" for name in ARM_JOINTS)

T = TypeVar("T")


class Telemetry:
    """What is known of a component and its robot; `update` it about ten times a second.

    Nothing needs to be there when it begins, and what goes away is found again. A component that is started
    anew begins a new recording, one that is reloaded goes on in the same.
    """

    def __init__(self, communicator: Communicator, component: str, *, pictures: bool) -> None:
        def proxy(identity: str) -> ObjectPrx:
            return communicator.stringToProxy(identity)

        self._component = component
        self._endpoint = ", ".join(communicator.settings.connect)
        self._monitor = HfsmMonitorPrx.uncheckedCast(proxy(f"{MONITOR_PREFIX}{component}"))
        self._head = PoseHeadPrx.uncheckedCast(proxy("Head"))
        self._body = JointsPrx.uncheckedCast(proxy("Body"))
        self._health = HealthPrx.uncheckedCast(proxy("Health"))
        self._camera = CameraPrx.uncheckedCast(proxy(_CAMERA))
        self._outside = CameraPrx.uncheckedCast(proxy("CameraOutside"))

        self._snapshot = Newest(self._monitor.getSnapshot.latest)
        self._pose = Newest(self._head.getPose.latest)
        self._joints = Newest(self._body.getJointState.latest)
        self._condition = Newest(self._health.getHealth.latest)
        self._picture = Newest(self._camera.getImageData.latest, STALE)
        self._structure = Fact(self._monitor.getStructureAsync)
        self._image = Fact(self._camera.getImageDescriptionAsync)
        self._joint_names = Fact(self._body.getJointNamesAsync)
        self._joint_limits = Fact(self._body.getJointLimitsAsync)
        self._outside_image = Fact(lambda: self._outside.getImageDataAsync(_RGB8))

        self._lock = threading.Lock()
        self._recording: Recording | None = None
        self._outdated = self._reloaded = False
        self._pictures = pictures
        self.camera_album = Album()
        self.outside_album = Album()
        self._subscription = self._monitor.getSnapshot.subscribe(self._on_snapshot)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Stop listening; what was recorded stays."""
        self._subscription.close()

    @property
    def recording(self) -> Recording | None:
        """The recording, or None before the component has told its structure."""
        return self._recording

    @property
    def image_size(self) -> tuple[int, int]:
        """Width and height in pixels of the robot's camera image; those of a Nao until the robot has told."""
        image = self._image.value
        return (image.width, image.height) if image and image.width > 0 < image.height else _IMAGE_SIZE

    @property
    def outside_trouble(self) -> str:
        """Why there is no picture from outside; empty when there is none to tell."""
        return self._outside_image.trouble

    def update(self, elapsed: float = 0.0, seconds: float = 0.0) -> Scene:
        """Ask for what is missing and return what is known now."""
        self._update_structure()
        self._update_outside()
        self._image.poll()
        names, limits = self._joint_names.poll(), self._joint_limits.poll()
        head, body, health, snapshot = self._pose(), self._joints(), self._condition(), self._snapshot()
        with self._lock:
            recording = self._recording
            changes = list(recording.changes)[-_CHANGES_SHOWN:] if recording else []
        fits = recording is not None and snapshot is not None and recording.knows(snapshot.value)
        return Scene(
            component=self._component,
            endpoint=self._endpoint,
            elapsed=elapsed,
            seconds=seconds,
            automata=recording.automata if recording else None,
            snapshot=_aged(snapshot) if fits else None,
            ball=read_ball(recording.automata, snapshot.value) if recording and snapshot and fits else None,
            changes=changes,
            head=_aged(head),
            joints=Aged(_joints(names, body.value.positions), body.age) if body else None,
            limits={one.name: (one.lower, one.upper) for one in limits or ()},
            health=Aged(health.value, health.age, STALE_HEALTH) if health else None,
            image_size=self.image_size,
        )

    def _update_structure(self) -> None:
        if self._outdated:
            self._outdated = False
            self._structure.forget()
            with self._lock:
                self._recording = None
        elif self._reloaded:
            self._reloaded = False
            known, recording = self._structure.value, self._recording
            if known is not None and recording and known.generation == recording.automata.generation:
                self._structure.forget()  # once: what is on its way is not of before
        structure = self._structure.poll()
        recording = self._recording
        if structure is not None and recording is not None:
            if structure.generation != recording.automata.generation:
                with self._lock:
                    recording.automata = Automata(structure)
        elif structure is not None:
            with self._lock:
                self._recording = Recording(Automata(structure))
                self.camera_album, self.outside_album = Album(), Album()

    def _update_outside(self) -> None:
        """Take a picture from outside when one is due; it is rendered only for this call."""
        recording = self._recording
        if not self._pictures or recording is None or recording.newest is None:
            return
        now = recording.newest.time
        if not self.outside_album.due(now):
            return
        image = self._outside_image.poll()
        if image is None:
            return
        self._outside_image.forget()
        caption = " > ".join(recording.automata.current_path(recording.newest))
        picture = picture_from(image, now, caption)
        if picture is not None:
            self.outside_album.add(picture)

    def _on_snapshot(self, sample: Sample[ComponentSnapshot]) -> None:
        snapshot = sample.value
        with self._lock:
            recording = self._recording
            if recording is None:
                return
            if not recording.follows(snapshot):
                self._reloaded = recording.continued_by(snapshot)
                self._outdated = not self._reloaded
                return
            recording.add(snapshot, self._read_robot())
            ball = recording.rows[-1].ball
        if self._pictures and self.camera_album.due(snapshot.time):
            self._take_camera_picture(recording, snapshot, ball)

    def _take_camera_picture(
        self, recording: Recording, snapshot: ComponentSnapshot, ball: Ball | None
    ) -> None:
        image = self._picture()
        if image is None:
            return
        mark = None
        if ball is not None and ball.seen:
            width, height = image.value.description.width, image.value.description.height
            mark = ((width - 1) / 2 + ball.error_u, (height - 1) / 2 + ball.error_v)
        caption = " > ".join(recording.automata.current_path(snapshot))
        picture = picture_from(image.value, snapshot.time, caption, mark)
        if picture is not None:
            self.camera_album.add(picture)

    def _read_robot(self) -> RobotReading:
        head, body, health = self._pose(), self._joints(), self._condition()
        head = head if head and head.age <= STALE else None
        body = body if body and body.age <= STALE else None
        health = health if health and health.age <= STALE_HEALTH else None
        return RobotReading(
            pan=_finite(head.value.pan) if head else None,
            tilt=_finite(head.value.tilt) if head else None,
            joints=_joints(self._joint_names.value, body.value.positions) if body else {},
            real_time_factor=_finite(health.value.realTimeFactor) if health else None,
            lag=_finite(health.value.lag) if health else None,
            torso_tilt=_finite(health.value.torsoTilt) if health else None,
            camera_rate=_finite(health.value.cameraRates.get(_CAMERA)) if health else None,
        )


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None


def _joints(names: Sequence[str] | None, positions: Sequence[float]) -> Mapping[str, float]:
    """Return the angles of the arms, which are all that is shown and recorded."""
    pairs = zip(names or (), positions, strict=False)
    return {name: angle for name, angle in pairs if name in _ARMS and math.isfinite(angle)}


def _aged(sample: Sample[T] | None) -> Aged[T] | None:
    return None if sample is None else Aged(sample.value, sample.age)
