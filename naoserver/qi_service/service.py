"""Listen as a NAOqi that serves a robot."""

from __future__ import annotations

import logging
import threading
from collections.abc import Mapping
from types import TracebackType
from typing import Final, Self

import qi

from naoserver.errors import RobotError
from naoserver.qi_service.access import Access
from naoserver.qi_service.calls import Calls
from naoserver.qi_service.faults import Faults, FaultsService
from naoserver.qi_service.joint_motion import JointMotion
from naoserver.qi_service.leds import ALLeds
from naoserver.qi_service.libqi import start_libqi
from naoserver.qi_service.life import ALAutonomousLife, ALBattery, ALSystem
from naoserver.qi_service.memory import ALMemory, MemoryPump
from naoserver.qi_service.motion import ALMotion
from naoserver.qi_service.posture import ALRobotPosture
from naoserver.qi_service.postures import Postures
from naoserver.qi_service.sonar import ALSonar, Sonar
from naoserver.qi_service.speech import ALAnimatedSpeech, ALTextToSpeech
from naoserver.qi_service.video import ALVideoDevice
from naoserver.qi_service.walking import Walking

__all__ = ["DEFAULT_URL", "NaoqiService"]

_logger = logging.getLogger(__name__)

DEFAULT_URL: Final = "tcp://127.0.0.1:9559"
"""Where a NAOqi listens, on loopback."""
_LONGEST_BREAK: Final = 60.0
_ANSWERING: Final = 0.05  # s: who asks for a break gets its answer


class NaoqiService:
    """A robot served as NAOqi; leaving the `with` block ends calls and connections.

    With `faults`, a service of this name lets tests make things go wrong.
    """

    def __init__(self, access: Access, url: str = DEFAULT_URL, *, faults: bool = False) -> None:
        """Listen at `url`, where port 0 lets the system pick. Raises RobotError when that cannot be."""
        start_libqi()
        self._url = url
        self._faults = Faults(enabled=faults)
        self._calls = Calls(access.robot.clock, self._faults)
        robot = access.robot
        sonar = Sonar(robot.senses)
        memory = ALMemory(access, sonar)
        motion = JointMotion(access.body, robot.clock)
        postures = Postures(access, motion)
        self._walking = Walking(access.walk)
        speech = ALTextToSpeech(robot.voice, memory)
        services: dict[str, object] = {
            "ALAnimatedSpeech": ALAnimatedSpeech(speech),
            "ALAutonomousLife": ALAutonomousLife(memory),
            "ALBattery": ALBattery(robot.senses),
            "ALLeds": ALLeds(robot.lights),
            "ALMemory": memory,
            "ALMotion": ALMotion(access, motion, postures, self._walking),
            "ALRobotPosture": ALRobotPosture(postures),
            "ALSonar": ALSonar(sonar),
            "ALSystem": ALSystem(robot.name),
            "ALTextToSpeech": speech,
            "ALVideoDevice": ALVideoDevice(robot, self._faults),
        }
        if faults:
            services["Faults"] = FaultsService(self._faults, self.interrupt)
        self._facades: Mapping[str, object] = {
            name: self._calls.facade(name, service) for name, service in services.items()
        }
        self._pump = MemoryPump(memory)
        self._lock = threading.Lock()
        self._session: qi.Session | None = None
        self._break: threading.Thread | None = None
        self._closed = False
        self._closing = threading.Event()
        self._listen()
        self._pump.start()

    @property
    def url(self) -> str:
        """Where it listens, with the port that the system picked."""
        return self._url

    def interrupt(self, seconds: float) -> None:
        """Close every connection soon, and listen again after some wall seconds, at most a minute."""
        if not 0.0 <= seconds <= _LONGEST_BREAK:
            raise RobotError(f"seconds is {seconds:g}: it must be from 0 to {_LONGEST_BREAK:g}")
        with self._lock:
            if self._closed or (self._break is not None and self._break.is_alive()):
                return
            self._break = threading.Thread(
                target=self._take_a_break, args=(seconds,), name="break", daemon=True
            )
            self._break.start()

    def close(self) -> None:
        """Break off the calls that go on, and close every connection; does nothing the second time."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
        self._closing.set()
        if self._break is not None:
            self._break.join()
        self._pump.close()
        self._calls.close()
        self._walking.close()
        self._hang_up()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _listen(self) -> None:
        session = qi.Session()
        try:
            session.listenStandalone(self._url)
        except RuntimeError as error:
            raise RobotError(f"cannot listen at {self._url}: {error}; give another address") from None
        for name, facade in self._facades.items():
            session.registerService(name, facade)
        self._url = str(session.endpoints()[0])
        self._session = session

    def _hang_up(self) -> None:
        session, self._session = self._session, None
        if session is not None:
            session.close()

    def _take_a_break(self, seconds: float) -> None:
        self._closing.wait(_ANSWERING)
        self._hang_up()
        if not self._closing.wait(seconds):
            try:
                self._listen()
            except RobotError:
                _logger.exception("NAOqi is not served any more")
