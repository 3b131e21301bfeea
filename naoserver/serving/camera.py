"""Servant of a camera: images on request, a stream, and the places on the floor that they show."""

from __future__ import annotations

import io
import math
import threading
from collections import deque
from collections.abc import Callable
from importlib.util import find_spec
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from interfaces import jderobot
from interfaces.nao import Severity
from naoserver.bodies.kinematics import Matrix, kinematics_of, matrix_of
from naoserver.bodies.parts import CameraFacts
from naoserver.errors import HardwareFailure, RobotError
from naoserver.options import CameraOptions
from naoserver.protocol.jobs import Job, Periodic
from naoserver.protocol.robot import Frame, Robot
from naoserver.safety._event_log import EventLog
from naoserver.serving._shared import MOST_QUOTED, require_finite, to_time
from zenoh_ice import Current
from zenoh_ice.data.text import sentence

Moment = NDArray[np.float64]
"""The robot time in s, roll and pitch of the torso, and the angles of all joints in rad."""

_PERIOD: Final = 0.02
_MOST_MOMENTS: Final = 50
"""Moments that are kept: those of a second."""
_WANTED: Final = 1.0
"""Seconds after a picture for which moments are noted, for the next one."""
_GAP: Final = 0.2
"""Seconds without a moment after which those before say nothing about the next picture."""


class BodyHistory:
    """Note the moments of the body while pictures are taken, and return that of a time.

    `job` notes them every 20 ms of robot time from the first picture on, until none was taken for a second;
    `begins` is called when it has something to do again. A picture that is older than all moments counts
    as taken in the oldest one. Thread-safe.
    """

    def __init__(self, robot: Robot, begins: Callable[[], None]) -> None:
        self._robot = robot
        self._kinematics = kinematics_of(robot.body)
        self._begins = begins
        self._lock = threading.Lock()
        self._past: deque[Moment] = deque(maxlen=_MOST_MOMENTS)
        self._used = -math.inf
        self.job: Final[Job] = Periodic(
            "places of the body", robot.clock, lambda: _PERIOD, self.note, thread="state", wanted=self._wanted
        )

    def note(self) -> Moment:
        """Note and return the present moment."""
        joints, senses = self._robot.read(), self._robot.senses
        inertial = senses.inertial() if senses else None
        tilt = (inertial.roll, inertial.pitch) if inertial else (0.0, 0.0)
        moment = np.array([joints.time, *tilt, *joints.positions])
        with self._lock:
            if self._past and moment[0] - self._past[-1][0] > _GAP:
                self._past.clear()
            if not self._past or self._past[-1][0] < moment[0]:
                self._past.append(moment)
        return moment

    def at(self, time: float) -> Moment:
        """Return the moment at a time of a picture in s, between the noted ones."""
        rested = not self._wanted()
        self._used = self._robot.clock.now()
        if rested:
            self._begins()
        with self._lock:
            past = list(self._past)
        after = next((index for index, each in enumerate(past) if each[0] >= time), len(past) - 1)
        first, second = past[max(after - 1, 0)], past[after]
        share = (time - float(first[0])) / max(float(second[0] - first[0]), 1e-6)
        return np.asarray(first + min(max(share, 0.0), 1.0) * (second - first), np.float64)

    def _wanted(self) -> bool:
        return self._robot.clock.now() - self._used < _WANTED

    def places_in(self, moment: Moment, link: str) -> tuple[Matrix, Matrix]:
        """Return where the torso is in the robot's frame, and a link in the torso's."""
        _, roll, pitch, *positions = moment.tolist()
        angles = dict(zip((joint.name for joint in self._robot.joints), positions, strict=True))
        root = self._kinematics.torso_place(angles, roll, pitch)
        return root, self._kinematics.link_place(link, angles)


Pixels = NDArray[np.uint8]

JPEG_QUALITY: Final = 85
"""A picture of 320x240 takes about 10 kB, a twentieth of its pixels."""


def _gray(rgb: Pixels) -> bytes:
    """Return the luma of ITU-R BT.601 in 8-bit fixed point."""
    red, green, blue = (rgb[:, :, channel].astype(np.uint16) for channel in range(3))
    return ((77 * red + 150 * green + 29 * blue) >> 8).astype(np.uint8).tobytes()


def _yuv422(rgb: Pixels) -> bytes:
    """Return Y U Y V for each two pixels of a row: ITU-R BT.601 in video range, in 8-bit fixed point."""
    height, width = rgb.shape[:2]
    red, green, blue = (rgb[:, :, channel].astype(np.int32) for channel in range(3))
    packed = np.empty((height, width // 2, 4), np.uint8)
    packed[:, :, 0::2] = (((66 * red + 129 * green + 25 * blue + 128) >> 8) + 16).reshape(height, -1, 2)
    red, green, blue = (channel[:, 0::2] + channel[:, 1::2] for channel in (red, green, blue))
    packed[:, :, 1] = ((-38 * red - 74 * green + 112 * blue + 256) >> 9) + 128
    packed[:, :, 3] = ((112 * red - 94 * green - 18 * blue + 256) >> 9) + 128
    return packed.tobytes()


def _jpeg(rgb: Pixels) -> bytes:
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(rgb).save(buffer, "JPEG", quality=JPEG_QUALITY)
    return buffer.getvalue()


PIXEL_FORMATS: Final[dict[str, Callable[[Pixels], bytes]]] = {
    "RGB8": lambda rgb: rgb.tobytes(),
    "BGR8": lambda rgb: rgb[:, :, ::-1].tobytes(),
    "GRAY8": _gray,
    "YUV422": _yuv422,
}
"""Converters of a frame of shape (height, width, 3), width even, to a format's bytes, rows from the top."""
if find_spec("PIL") is not None:  # not in a plain installation of a server
    PIXEL_FORMATS["JPEG"] = _jpeg

STREAMED_FORMAT: Final = "RGB8"
STREAMED_BYTES_A_PIXEL: Final = 3


WINDOW: Final = 2.0
"""Seconds over which a rate is measured."""
_MOST_COUNTED: Final = 1000


class RateMeter:
    """Return the rate of events over the last `WINDOW` seconds of the clock `now`. Thread-safe."""

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self._times: deque[float] = deque(maxlen=_MOST_COUNTED)

    def count(self, time: float) -> None:
        """Count an event at a time in s."""
        self._times.append(time)

    @property
    def rate(self) -> float:
        """Events a second."""
        now = self._now()
        return sum(0.0 <= now - time < WINDOW for time in tuple(self._times)) / WINDOW


class _Shot(NamedTuple):
    """How an image was taken: its size in pixels, and the body at its time."""

    width: int
    height: int
    moment: Moment


class CameraI(jderobot.Camera):
    """Serve one camera of a robot.

    No image is taken while nobody calls, listens or has started streaming with startCameraStreaming. A call
    returns the newest image if that was taken less than one period ago, else it takes a new one.
    """

    def __init__(
        self, robot: Robot, facts: CameraFacts, options: CameraOptions, events: EventLog, history: BodyHistory
    ) -> None:
        """Serve the camera `facts` of `robot`; raises RobotError for options that it does not support."""
        if problem := _problem(facts, options):
            raise RobotError(problem)
        self.facts = facts
        self._robot = robot
        self._link = next((on.link for on in robot.body.cameras if on.name == facts.name), None)
        """The link that carries it; None for a camera beside the robot."""
        self._options = options
        self._events = events
        self._history = history
        self._settings = options  # replaced as a whole, so that it may be read without a lock
        self._streaming: set[str] = set()
        """The clients that have started streaming. Each operation on the set is atomic: it needs no lock."""
        self._newest: Frame | None = None
        self._taken = -math.inf
        """When it was taken, in robot time: its own time is that of the exposure, which may be earlier."""
        self._shot: _Shot | None = None  # replaced as a whole, too
        """How the newest image was taken."""
        self._place: tuple[Moment | None, Matrix, Matrix] = (None, np.eye(4), np.eye(4))
        """A moment, the place of the torso, and the camera's in its frame: points of an image share them."""
        self._taking = threading.Lock()  # held while an image is taken: a waiting caller gets that image
        self._sent = math.nan  # the time of the newest image that listeners got
        self._meter = RateMeter(robot.clock.now)
        self.job: Final[Job] = Periodic(
            f"images of {facts.name}",
            robot.clock,
            lambda: 1.0 / self._settings.rate,
            self.publish,
            wanted=lambda: self.wanted,
        )

    # -- operations --------------------------------------------------------------------------------------

    def getImageDescription(self, current: Current) -> jderobot.ImageDescription:
        width, height = self._settings.width, self._settings.height
        return jderobot.ImageDescription(
            width=width, height=height, size=width * height * STREAMED_BYTES_A_PIXEL, format=STREAMED_FORMAT
        )

    def getImageFormat(self, current: Current) -> list[str]:
        return list(PIXEL_FORMATS)

    def getImageData(self, format: str, current: Current) -> jderobot.ImageData:
        if format not in PIXEL_FORMATS:
            known = ", ".join(PIXEL_FORMATS)
            message = sentence(f"{self.facts.name} has no format {format[:MOST_QUOTED]!r}; it has {known}")
            if format == "JPEG":
                message += "; " + sentence("JPEG needs Pillow where the server runs: pip install pillow")
            raise jderobot.ConfigurationNotExistException(message)
        return _image(self._fresh(), format)

    def getCameraDescription(self, current: Current) -> jderobot.CameraDescription:
        settings, facts = self._settings, self.facts
        focal = self.facts.focal_length(settings.width)
        return jderobot.CameraDescription(
            name=facts.name,
            shortDescription=f"{settings.width}x{settings.height}, {settings.rate:g} images/s of robot time",
            streamingUri=_key(current) if self.wanted else "",
            width=settings.width,
            height=settings.height,
            rate=settings.rate,
            fdistx=focal,
            fdisty=focal,
            u0=(settings.width - 1) / 2,
            v0=(settings.height - 1) / 2,
            skew=0.0,
            posx=facts.position[0],
            posy=facts.position[1],
            posz=facts.position[2],
            tilt=facts.tilt,
        )

    def setCameraDescription(self, description: jderobot.CameraDescription, current: Current) -> int:
        settings = CameraOptions(description.width, description.height, description.rate)
        if problem := _problem(self.facts, settings):
            raise jderobot.ConfigurationNotExistException(problem)
        self._settings = settings
        return 0

    def startCameraStreaming(self, current: Current) -> str:
        self._streaming.add(current.client)  # before the wait for an image: the client may die meanwhile
        try:
            self._fresh()
        except jderobot.HardwareFailedException:
            self._streaming.discard(current.client)
            raise
        return _key(current)

    def stopCameraStreaming(self, current: Current) -> None:
        self._streaming.discard(current.client)

    def getFloorPoint(self, u: float, v: float, height: float, current: Current) -> jderobot.FloorPoint:
        require_finite(u=u, v=v, height=height)
        if self._link is None:
            raise jderobot.ConfigurationNotExistException(
                sentence(f"{self.facts.name} is not on the robot, but beside it")
            )
        settings = self._settings
        shot = self._shot or _Shot(settings.width, settings.height, self._history.note())
        moment, torso, camera = self._place
        if moment is not shot.moment:
            torso, link = self._history.places_in(shot.moment, self._link)
            camera = link @ matrix_of((*self.facts.position, 0.0, self.facts.tilt, 0.0))
            self._place = shot.moment, torso, camera
        focal = self.facts.focal_length(shot.width)
        right, down = u - (shot.width - 1) / 2, v - (shot.height - 1) / 2
        ahead, left, up = (camera[:3, :3] @ (1.0, -right / focal, -down / focal)).tolist()
        pan, tilt = math.atan2(left, ahead), math.atan2(-up, math.hypot(ahead, left))
        eye, ray = torso @ camera[:, 3], torso[:3, :3] @ (ahead, left, up)
        way = float((height - eye[2]) / ray[2]) if ray[2] else math.inf
        if not 0.0 < way < math.inf:
            return jderobot.FloorPoint(math.inf, math.inf, math.inf, pan, tilt)
        x, y, _ = (eye[:3] + way * ray).tolist()
        return jderobot.FloorPoint(x, y, way * float(np.linalg.norm(ray)), pan, tilt)

    def reset(self, current: Current) -> None:
        self._settings = self._options
        self._streaming.discard(current.client)

    # -- for the server ----------------------------------------------------------------------------------

    @property
    def wanted(self) -> bool:
        """Whether images are to be taken without calls."""
        return bool(self._streaming) or self.getImageDataPublisher.listening

    @property
    def delivered_rate(self) -> float:
        """Images taken in a second of robot time, over the last two."""
        return self._meter.rate

    def drop_client(self, client: str) -> None:
        """Stop streaming on behalf of a lost client."""
        self._streaming.discard(client)

    def publish(self) -> bool:
        """Take an image and send it to the listeners, unless they have it; return whether there was one."""
        try:
            with self._taking:
                frame = self._capture()
        except HardwareFailure as failure:
            self._report(failure)
            return False
        # On a busy machine, a late image and the one that follows may show the same moment.
        if self.getImageDataPublisher.listening and frame.time != self._sent:
            self.getImageDataPublisher.publish(_image(frame, STREAMED_FORMAT), time=frame.time)
            self._sent = frame.time
        return True

    def _fresh(self) -> Frame:
        with self._taking:
            frame, settings = self._newest, self._settings
            if (
                frame is not None
                and (frame.width, frame.height) == (settings.width, settings.height)
                and 0.0 <= self._robot.clock.now() - self._taken < 1.0 / settings.rate
            ):
                return frame
            try:
                return self._capture()
            except HardwareFailure as failure:
                self._report(failure)
                raise jderobot.HardwareFailedException(str(failure)) from failure

    def _capture(self) -> Frame:
        settings = self._settings
        self._newest = None  # not kept if the next capture fails
        self._history.note()
        frame = self._robot.capture(self.facts.name, settings.width, settings.height)
        self._history.note()
        self._newest, self._taken = frame, self._robot.clock.now()
        self._shot = _Shot(frame.width, frame.height, self._history.at(frame.time))
        self._meter.count(self._taken)
        return frame

    def _report(self, failure: HardwareFailure) -> None:
        self._events.add(Severity.Error, self.facts.name, str(failure), "camera")


def usual_settings(facts: CameraFacts) -> CameraOptions:
    """Return the settings with which a camera starts that is given none: its first, if not the usual ones."""
    usual = CameraOptions()
    if not _problem(facts, usual):
        return usual
    return CameraOptions(*facts.sizes[0], min(usual.rate, facts.rates[0]))


def _problem(facts: CameraFacts, settings: CameraOptions) -> str:
    """Return why a camera cannot have the settings; empty when it can."""
    rates = dict(zip(facts.sizes, facts.rates, strict=True))
    highest, size = rates.get((settings.width, settings.height)), f"{settings.width}x{settings.height}"
    if highest is None:
        sizes = ", ".join(f"{width}x{height}" for width, height in facts.sizes)
        return sentence(f"{facts.name} has no size {size}; it has {sizes}")
    if not 0.0 < settings.rate <= highest:
        what = sentence(f"{facts.name} gives no {settings.rate:g} images/s at {size}")
        return f"{what}; " + sentence(f"it gives more than 0, up to {highest:g}")
    return ""


def _image(frame: Frame, format: str) -> jderobot.ImageData:
    pixels = PIXEL_FORMATS[format](frame.pixels)
    return jderobot.ImageData(
        description=jderobot.ImageDescription(
            width=frame.width, height=frame.height, size=len(pixels), format=format
        ),
        timeStamp=to_time(frame.time),
        pixelData=pixels,
    )


def _key(current: Current) -> str:
    return f"{current.communicator.realm}/{current.identity}/getImageData"
