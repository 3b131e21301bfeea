"""Listen to a component and its robot, and keep the data of the view and the report."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import TracebackType
from typing import Final, Self

from interfaces.hfsm import ComponentSnapshot, Mark
from interfaces.jderobot import CameraPrx, ImageData
from visualhfsm.monitoring.automata import Automata, Change
from visualhfsm.monitoring.follower import Follower
from visualhfsm.monitoring.realm import Newest, PolledValue, has_interface
from visualhfsm.monitoring.robot import STALE, RobotMonitor, RobotState
from visualhfsm.monitoring.run_log import RunLog
from zenoh_ice import Communicator

CAMERA: Final = "Camera"
"""The camera that is shown as long as no mark is on another one."""
IMAGE_SIZE: Final = (320, 240)
_CHANGES_SHOWN: Final = 100
_RGB8: Final = "RGB8"
_FIRST_INTERVAL: Final = 1.0
_MOST_PICTURES: Final = 9


@dataclass(frozen=True, slots=True)
class WatchState:
    """A component and its robot at one moment; what has not arrived yet is None or empty.

    `elapsed` counts the wall seconds of watching, `seconds` is its end, 0 for never; ages are wall seconds
    since the last sample. `limits` are in rad by joint, `image_size` is that of `camera` in pixels.
    """

    component: str
    endpoint: str
    elapsed: float = 0.0
    seconds: float = 0.0
    automata: Automata | None = None
    snapshot: ComponentSnapshot | None = None
    snapshot_age: float = math.inf
    changes: Sequence[Change] = ()
    robot: RobotState = field(default_factory=RobotState)
    robot_age: float = math.inf
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    camera: str = CAMERA
    image_size: tuple[int, int] = IMAGE_SIZE

    @property
    def marks(self) -> Sequence[Mark]:
        """What the component marks on the picture of the camera; nothing once it is lost."""
        if self.snapshot is None or self.snapshot_age > STALE:
            return ()
        return [mark for mark in self.snapshot.marks if mark.camera == self.camera]

    @property
    def trouble(self) -> str:
        """What does not answer and what to do about it; empty when all is well."""
        if self.robot_age == math.inf:
            return f"Waiting for a robot server at {self.endpoint}; naoserver-sim starts one"
        if self.robot_age > STALE:
            return (
                f"Robot server lost {self.robot_age:.0f} s ago; going on when it is back at {self.endpoint}"
            )
        if self.automata is None or self.snapshot is None:
            return f"Waiting for {self.component}; python -m behaviors.{self.component} starts it"
        if self.snapshot_age > STALE:
            return f"{self.component} lost {self.snapshot_age:.0f} s ago; going on when it is back"
        return ""


class Telemetry:
    """What is known of a component and its robot; `update` it about ten times a second.

    Both may be missing at the start, and are found again after they were lost. A component that is restarted
    begins a new log; one that is reloaded continues the same log.
    """

    def __init__(self, communicator: Communicator, component: str, *, pictures: bool) -> None:
        self._communicator = communicator
        self._endpoint = ", ".join(communicator.settings.connect)
        self._robot = RobotMonitor(communicator)
        self._follower = Follower(communicator, component, self._robot)
        self._log = self._follower.log
        self._automata: Automata | None = None
        self._pictures = pictures
        outside = CameraPrx.uncheckedCast(communicator.stringToProxy("CameraOutside"))
        self._outside_image = PolledValue(lambda: outside.getImageData.begin(_RGB8))
        self.camera_album = Album()
        self.outside_album = Album()
        self._look_through(CAMERA)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._follower.close()

    @property
    def log(self) -> RunLog:
        """What happened in the component's run."""
        return self._follower.log

    @property
    def automata(self) -> Automata | None:
        """The automata, or None before the component has sent its structure."""
        return self._automata

    @property
    def image_size(self) -> tuple[int, int]:
        """Width and height in pixels of the camera's image; those of a Nao until the robot has sent them."""
        image = self._image_description.value
        return (image.width, image.height) if image and image.width > 0 < image.height else IMAGE_SIZE

    @property
    def outside_trouble(self) -> str:
        """Why there is no picture from outside; empty when nothing is known to be wrong."""
        return self._outside_image.trouble

    def update(self, elapsed: float = 0.0, seconds: float = 0.0) -> WatchState:
        """Request what is missing and return what is known now."""
        self._robot.update()
        self._follower.update()
        self._image_description.poll()
        self._update_run()
        snapshot = self._snapshot()
        if snapshot is not None:
            self._choose_camera(snapshot)
        if self._pictures:
            self._take_pictures(snapshot)
        return WatchState(
            component=self._follower.component,
            endpoint=self._endpoint,
            elapsed=elapsed,
            seconds=seconds,
            automata=self._automata,
            snapshot=snapshot,
            snapshot_age=self._follower.age,
            changes=self.log.changes(_CHANGES_SHOWN),
            robot=self._robot.read(stale=self._robot.age() > STALE),
            robot_age=self._robot.age(),
            limits={one.name: (one.lower, one.upper) for one in self._robot.facts().limits},
            camera=self.camera,
            image_size=self.image_size,
        )

    def _update_run(self) -> None:
        live = self._follower.structure
        if live is not None and (self._automata is None or self._automata.structure is not live.structure):
            self._automata = Automata(live.structure)
        if self.log is not self._log:
            self._log = self.log
            self.camera_album, self.outside_album = Album(), Album()

    def _snapshot(self) -> ComponentSnapshot | None:
        """Return the newest snapshot, unless its automata are not known yet, as after a reload."""
        newest = self.log.newest
        known = newest is not None and self._automata is not None and self._automata.fit(newest.component)
        return newest.component if newest is not None and known else None

    def _choose_camera(self, snapshot: ComponentSnapshot) -> None:
        """Show a camera on which the component marks something."""
        marked = [mark.camera for mark in snapshot.marks]
        type_id = CameraPrx.ice_interface.type_id
        if marked and self.camera not in marked and has_interface(self._communicator, marked[-1], type_id):
            self._look_through(marked[-1])

    def _look_through(self, camera: str) -> None:
        self.camera = camera
        proxy = CameraPrx.uncheckedCast(self._communicator.stringToProxy(camera))
        self._image = Newest(proxy.getImageData.latest, STALE)
        self._image_description = PolledValue(proxy.getImageDescription.begin)

    def _take_pictures(self, snapshot: ComponentSnapshot | None) -> None:
        time = snapshot.time if snapshot is not None else 0.0
        path = self._automata.current_path(snapshot) if self._automata and snapshot is not None else []
        caption = " > ".join(path)
        image = self._image() if snapshot is not None and self.camera_album.due(time) else None
        if image is not None and snapshot is not None:
            marks = [(mark.u, mark.v) for mark in snapshot.marks if mark.camera == self.camera]
            self.camera_album.add(picture_from(image.value, time, caption, marks))
        if self.outside_album.due(time) and self._outside_image.poll() is not None:
            outside = self._outside_image.value
            self._outside_image.forget()
            if outside is not None:
                self.outside_album.add(picture_from(outside, time, caption))


@dataclass(frozen=True, slots=True)
class Picture:
    """An RGB8 image at a component time; `marks` are pixels, right and down from its top left corner."""

    time: float
    caption: str
    width: int
    height: int
    pixels: bytes
    marks: Sequence[tuple[float, float]] = ()


class Album:
    """At most 8 images: with one more, every other one is dropped, and the interval doubles."""

    def __init__(self) -> None:
        self.pictures: list[Picture] = []
        self._interval = _FIRST_INTERVAL
        self._next = 0.0

    def due(self, time: float) -> bool:
        """Whether a picture at this component time is wanted."""
        return time >= self._next

    def add(self, picture: Picture | None) -> None:
        """Put a picture in, if there is one."""
        if picture is None:
            return
        self.pictures.append(picture)
        if len(self.pictures) >= _MOST_PICTURES:
            del self.pictures[1::2]
            self._interval *= 2
        self._next = picture.time + self._interval


def picture_from(
    image: ImageData, time: float, caption: str, marks: Sequence[tuple[float, float]] = ()
) -> Picture | None:
    """Make a picture of an RGB8 image, or None of one whose size does not fit its pixels."""
    width, height = image.description.width, image.description.height
    if width <= 0 or height <= 0 or len(image.pixelData) != width * height * 3:
        return None
    return Picture(time, caption, width, height, bytes(image.pixelData), marks)


def picture_png(picture: Picture) -> bytes:
    """Encode a picture as PNG, with a cross hair at each mark; needs Pillow (the extra `demo`)."""
    from PIL import Image, ImageDraw

    image = Image.frombytes("RGB", (picture.width, picture.height), picture.pixels)
    draw = ImageDraw.Draw(image)
    arm = max(picture.width // 20, 6)
    for u, v in picture.marks:
        for width, color in ((3, "black"), (1, "white")):
            draw.line([(u - arm, v), (u + arm, v)], fill=color, width=width)
            draw.line([(u, v - arm), (u, v + arm)], fill=color, width=width)
    buffer = io.BytesIO()
    image.save(buffer, "PNG", optimize=True)
    return buffer.getvalue()
