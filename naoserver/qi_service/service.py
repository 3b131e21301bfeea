"""Listen as a NAOqi that serves a robot."""

from __future__ import annotations

from types import TracebackType
from typing import Final, Self

from naoserver.qi_service.access import Access
from naoserver.qi_service.behaviors import ALBehaviorManager
from naoserver.qi_service.calls import Calls
from naoserver.qi_service.faults import Faults, FaultsService
from naoserver.qi_service.joint_motion import JointMotion
from naoserver.qi_service.leds import ALLeds
from naoserver.qi_service.life import ALAutonomousLife, ALBattery, ALSystem
from naoserver.qi_service.listener import Listener
from naoserver.qi_service.memory import ALMemory, MemoryPump
from naoserver.qi_service.motion import ALMotion
from naoserver.qi_service.posture import ALRobotPosture
from naoserver.qi_service.postures import Postures
from naoserver.qi_service.sonar import ALSonar, Sonar
from naoserver.qi_service.speech import ALAnimatedSpeech, ALTextToSpeech
from naoserver.qi_service.video import ALVideoDevice
from naoserver.qi_service.walking import Walking

__all__ = ["DEFAULT_URL", "NaoqiService"]

DEFAULT_URL: Final = "tcp://127.0.0.1:9559"
"""Where a NAOqi listens, on loopback."""


class NaoqiService:
    """A robot served as NAOqi; leaving the `with` block ends calls and connections.

    With `faults`, a service of this name lets tests make things go wrong.
    """

    def __init__(self, access: Access, url: str = DEFAULT_URL, *, faults: bool = False) -> None:
        """Listen at `url`, where port 0 lets the system pick. Raises RobotError when that cannot be."""
        self._faults = Faults(enabled=faults)
        self._calls = Calls(access.robot.clock, self._faults)
        robot = access.robot
        sonar = Sonar(robot.senses)
        memory = ALMemory(access, sonar, self._faults)
        motion = JointMotion(access.body, robot.clock)
        postures = Postures(access)
        self._walking = Walking(access)
        speech = ALTextToSpeech(robot.voice, memory)
        services: dict[str, object] = {
            "ALAnimatedSpeech": ALAnimatedSpeech(speech),
            "ALAutonomousLife": ALAutonomousLife(memory),
            "ALBehaviorManager": ALBehaviorManager(access),
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
            services["Faults"] = FaultsService(self._faults, robot.senses, self._interrupt)
        self._pump = MemoryPump(memory)
        self._closed = False
        self._listener = Listener(
            url, {name: self._calls.facade(name, service) for name, service in services.items()}
        )
        self._pump.start()

    @property
    def url(self) -> str:
        """Where it listens, with the port that the system picked."""
        return self._listener.url

    def close(self) -> None:
        """Break off the calls that go on, and close every connection; does nothing the second time."""
        if self._closed:
            return
        self._closed = True
        self._pump.close()
        self._calls.close()
        self._walking.close()
        self._listener.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _interrupt(self, seconds: float) -> None:
        self._listener.interrupt(seconds)
