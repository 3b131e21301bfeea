"""Listen as a NAOqi that serves a robot."""

from __future__ import annotations

import logging
import threading
import time
import weakref
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Final

import qi

from naoserver.assembly import Assembly
from naoserver.errors import RobotError
from naoserver.jobs import JobThreads, Periodic
from naoserver.libqi import start_libqi
from naoserver.robot import Robot
from naoserver_qi.access import RENEWAL, Access, Walking
from naoserver_qi.calls import Calls, Faults
from naoserver_qi.effectors import EffectorMotion
from naoserver_qi.footsteps import FootSteps
from naoserver_qi.leds import ALLeds
from naoserver_qi.life import ALAutonomousLife, ALBattery, ALSystem
from naoserver_qi.memory import NOTIFYING, ALMemory
from naoserver_qi.motion import ALMotion
from naoserver_qi.postures import ALBehaviorManager, ALRobotPosture
from naoserver_qi.refused import REFUSED, refused_service
from naoserver_qi.sensors import ALSonar, ALTouch
from naoserver_qi.sound import ALAudioDevice, ALAudioPlayer, ALAudioRecorder, Disk
from naoserver_qi.speech import ALAnimatedSpeech, ALTextToSpeech
from naoserver_qi.tracker import ALTracker
from naoserver_qi.video import ALVideoDevice
from naoserver_qi.vision import (
    LOOKING,
    ALColorBlobDetection,
    ALFaceDetection,
    ALLandMarkDetection,
    ALRedBallDetection,
)
from naoserver_qi.whole_body import WholeBody
from zenoh_ice import WallClock

PARTS_OF_MOTION: Final = (EffectorMotion, FootSteps, WholeBody)
"""Further operations of ALMotion."""

_logger = logging.getLogger(__name__)

_ANSWERING: Final = 0.05
"""Wall seconds in which the client that asks for a break gets its answer."""
_RELEASING: Final = 2.0
"""Wall seconds that libqi gets to release the services."""
_POLL: Final = 0.005
_GRACE: Final = 0.05
"""Wall seconds that libqi gets to release what it lent to clients."""


@contextmanager
def serve(robot: Robot, assembly: Assembly, url: str, *, disk: Path, faults: bool) -> Iterator[str]:
    """Serve a robot as NAOqi in a `with` block, which gets the URL; see `naoserver_qi.serve_as_naoqi`."""
    access = Access(robot, assembly)
    made_to_fail = Faults(
        robot.senses,
        lambda seconds: listener.interrupt(seconds),  # noqa: PLW0108 - it does not exist yet
        enabled=faults,
    )
    calls = Calls(robot.clock, made_to_fail)
    walking = Walking(access)
    sonar = ALSonar(robot.senses)
    memory = ALMemory(
        access,
        sonar._distances,
        made_to_fail,
        find=lambda name: listener.find(name),  # noqa: PLW0108 - it does not exist yet
    )
    postures = ALRobotPosture(access)
    speech = ALTextToSpeech(robot.voice, memory)
    motion = ALMotion(access, postures, walking)
    files = Disk(disk)
    recorder = ALAudioRecorder(files, robot.clock)
    ball, landmarks, faces, blobs = detectors = (
        ALRedBallDetection(robot, access, memory),
        ALLandMarkDetection(robot, access, memory),
        ALFaceDetection(robot, access, memory),
        ALColorBlobDetection(robot, access, memory),
    )
    targets = {"RedBall": ball, "LandMark": landmarks, "Face": faces}
    tracker = ALTracker(access, motion, walking, targets)
    services: dict[str, object] = {
        "ALAnimatedSpeech": ALAnimatedSpeech(speech),
        "ALAudioDevice": ALAudioDevice(recorder),
        "ALAudioPlayer": ALAudioPlayer(files, robot.clock),
        "ALAudioRecorder": recorder,
        "ALAutonomousLife": ALAutonomousLife(memory),
        "ALBehaviorManager": ALBehaviorManager(access),
        "ALBattery": ALBattery(robot.senses),
        "ALColorBlobDetection": blobs,
        "ALFaceDetection": faces,
        "ALLandMarkDetection": landmarks,
        "ALLeds": ALLeds(robot.lights),
        "ALMemory": memory,
        "ALRedBallDetection": ball,
        "ALRobotPosture": postures,
        "ALSonar": sonar,
        "ALSystem": ALSystem(robot.name),
        "ALTextToSpeech": speech,
        "ALTracker": tracker,
        "ALTouch": ALTouch(robot.senses),
        "ALVideoDevice": ALVideoDevice(robot, made_to_fail),
        **{name: refused_service(name) for name in REFUSED},
        **({"Faults": made_to_fail} if faults else {}),
    }
    parts: dict[str, tuple[object, ...]] = {name: (service,) for name, service in services.items()}
    parts["ALMotion"] = (motion, EffectorMotion(access, motion), WholeBody(access), FootSteps(motion))
    listener = _Listener(url, {name: calls.facade(name, own) for name, own in parts.items()})
    wall = WallClock()
    jobs = (
        Periodic("ALMemory", wall, lambda: NOTIFYING, memory._notify, thread="NAOqi"),
        *(
            Periodic(
                each.KEY, robot.clock, lambda: LOOKING, each._look, thread="NAOqi sight", wanted=each._wanted
            )
            for each in detectors
        ),
        Periodic(
            "ALTracker",
            robot.clock,
            lambda: LOOKING,
            tracker._follow,
            thread="NAOqi sight",
            wanted=tracker.isActive,
        ),
        Periodic("the walk", wall, lambda: RENEWAL, walking.renew, thread="NAOqi"),
    )
    with ExitStack() as steps:  # run from the last to the first, each whatever the others raise
        steps.callback(listener.close)
        steps.callback(walking.close)
        steps.callback(tracker.stopTracker)
        steps.callback(calls.close)
        steps.enter_context(JobThreads(jobs))
        yield listener.url


class _Listener:
    """Offer services at a URL until it is closed."""

    def __init__(self, url: str, services: Mapping[str, Callable[[], object]]) -> None:
        """Offer services by their names, each made by a function. Raises RobotError when it cannot listen."""
        start_libqi()
        self.url = url
        """The address it listens on, with the port that the system picked."""
        self._services = services
        self._lock = threading.Lock()
        self._session: qi.Session | None = None
        self._offered: list[weakref.ref[object]] = []
        self._break: threading.Thread | None = None
        self._closing = threading.Event()
        self._listen()

    def interrupt(self, seconds: float) -> None:
        """Close every connection soon, and listen again after some wall seconds.

        Does nothing during such a break.
        """
        with self._lock:
            if self._closing.is_set() or (self._break is not None and self._break.is_alive()):
                return
            self._break = threading.Timer(_ANSWERING, self._take_a_break, (seconds,))
            self._break.daemon = True
            self._break.start()

    def find(self, name: str) -> qi.Future:
        """Begin to look up a service, also one of a client. Raises RuntimeError during a break."""
        session = self._session
        if session is None:
            raise RuntimeError("nobody is connected")
        return session.service(name, _async=True)

    def close(self) -> None:
        """Close every connection."""
        with self._lock:
            self._closing.set()
            pause = self._break
        if pause is not None:
            pause.join()
        self._hang_up()

    def _listen(self) -> None:
        session = qi.Session()
        try:
            session.listenStandalone(self.url)
        except RuntimeError as error:
            raise RobotError(f"cannot listen at {self.url}: {error}; give another address") from None
        for name, make in self._services.items():
            service = make()
            self._offered.append(weakref.ref(service))
            session.registerService(name, service)
        self.url = str(session.endpoints()[0])
        self._session = session

    def _hang_up(self) -> None:
        session, self._session = self._session, None
        if session is None:
            return
        session.close()
        del session
        # libqi releases the services on its own thread. A process that ends meanwhile hangs: that
        # thread waits for Python's lock, which is held while libqi waits for its threads.
        limit = time.monotonic() + _RELEASING
        while any(service() is not None for service in self._offered):
            if time.monotonic() > limit:
                _logger.warning("libqi has not released the services within %g s", _RELEASING)
                break
            time.sleep(_POLL)
        self._offered = []
        time.sleep(_GRACE)

    def _take_a_break(self, seconds: float) -> None:
        self._hang_up()
        if not self._closing.wait(seconds):
            try:
                self._listen()
            except RobotError:
                _logger.exception("NAOqi is not served any more")
