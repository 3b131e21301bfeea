"""A NAOqi in the test's process with scripted answers, for what a healthy robot never does."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import replace
from typing import Any

from naoserver.bodies.nao import H25
from naoserver.hardware.connection import CallFailed, HardwareLimits, LinkLost
from tests.support.limits import CALL_LIMIT
from tests.support.robot_server import clock_at, eventually
from visualhfsm_naoqi.robot._robot import LifecycleOptions, NaoqiRobot
from visualhfsm_naoqi.robot.calls import CallTimeout

__all__ = ["DEVICES", "HASTY", "PATIENT", "ScriptedNaoqi", "nao_memory"]

HASTY = HardwareLimits(retry=0.05, repetition=0.05)
"""Of a robot that is found and answers at once."""
PATIENT = replace(HASTY, answer=CALL_LIMIT)
"""For tests in which no command is to be sent before the one before is answered."""

DEVICES = "Device/SubDeviceList/"


def nao_memory(*, newer: bool = True) -> dict[str, Any]:
    """Return the ALMemory of a standing NAO, with the former spelling for one older than the NAO5."""
    memory: dict[str, Any] = {
        "RobotConfig/Body/Type": "nao",
        "RobotConfig/Head/BaseVersion": "V6.0" if newer else "V4.0",
        f"{DEVICES}Battery/Charge/Sensor/Value": 0.8,
        f"{DEVICES}Battery/Current/Sensor/Value": -1.5,
    }
    for joint, angle in H25.postures["StandInit"].angles.items():
        memory[f"{DEVICES}{joint}/Position/Sensor/Value"] = angle
        memory[f"{DEVICES}{joint}/Position/Actuator/Value"] = angle
        memory[f"{DEVICES}{joint}/Hardness/Actuator/Value"] = 1.0
        memory[f"{DEVICES}{joint}/Temperature/Sensor/Value"] = 40
    acceleration, velocity = ("Accelerometer", "Gyroscope") if newer else ("Acc", "Gyr")
    for axis, rest in zip("XYZ", (0.0, 0.0, -9.8), strict=True):
        memory[f"{DEVICES}InertialSensor/{acceleration}{axis}/Sensor/Value"] = rest
        memory[f"{DEVICES}InertialSensor/{velocity}{axis}/Sensor/Value"] = 0.0
    for axis in "XY":
        memory[f"{DEVICES}InertialSensor/Angle{axis}/Sensor/Value"] = 0.0
    for foot in ("LFoot", "RFoot"):
        for edge in ("FrontLeft", "FrontRight", "RearLeft", "RearRight"):
            memory[f"{DEVICES}{foot}/FSR/{edge}/Sensor/Value"] = 0.5
    return memory


class ScriptedNaoqi:
    """Answers calls from `answers`, and lists them; `limits` are those of its robots,
    whose time passes at `speed`. Calls that are `held` are answered when released."""

    def __init__(self, limits: HardwareLimits = HASTY, speed: float = 1.0) -> None:
        self.limits = limits
        self.speed = speed
        self.memory = nao_memory()
        self.answers: dict[str, Any] = {
            "ALMemory.getDataListName": lambda: list(self.memory),
            "ALMemory.getListData": lambda keys: [self.memory.get(key) for key in keys],
            "ALMemory.getData": lambda key: self.memory[key],
            "ALMotion.getRobotPosition": lambda _sensors: [0.0, 0.0, 0.0],
            "ALMotion.moveIsActive": False,
            "ALMotion.getMoveConfig": lambda _which: [["MaxStepX", 0.04], ["MaxStepY", 0.14]],
            "ALRobotPosture.getPostureList": ["Stand", "Crouch"],
            "ALRobotPosture.getPosture": "Stand",
            "ALRobotPosture.goToPosture": True,
            "ALAutonomousLife.getState": "solitary",
            "ALVideoDevice.hasCamera": True,
            "ALVideoDevice.subscribeCamera": "handle",
            "ALVideoDevice.getHorizontalFOV": 0.98,
        }
        self.calls: list[tuple[Any, ...]] = []
        self.held: set[str] = set()
        self.reachable = True
        self.refused = 0
        """Attempts to connect while it was not reachable."""
        self.links: list[ScriptedLink] = []

    def connect(self, _timeout: float) -> ScriptedLink:
        """Connect like `visualhfsm_naoqi.robot._libqi_link.connect`."""
        if not self.reachable:
            self.refused += 1
            raise LinkLost("cannot connect: nobody is there")
        self.links.append(ScriptedLink(self))
        return self.links[-1]

    @contextmanager
    def robot(self, options: LifecycleOptions | None = None) -> Iterator[NaoqiRobot]:
        """Start the robot on this NAOqi; close it at the end."""
        with closing(
            NaoqiRobot(self.connect, options, clock=clock_at(self.speed), limits=self.limits)
        ) as robot:
            robot.start()
            yield robot

    def called(self, operation: str) -> list[tuple[Any, ...]]:
        """Return the arguments of each call of an operation, in order."""
        return [call[1:] for call in self.calls if call[0] == operation]

    def wait_for_call(self, operation: str, count: int = 1) -> tuple[Any, ...]:
        """Wait for a number of calls of an operation; return the arguments of the last one."""
        eventually(lambda: len(self.called(operation)) >= count)
        return self.called(operation)[count - 1]

    def let_go(self, operation: str) -> None:
        """Answer the held calls of an operation, and hold no further ones."""
        self.held.discard(operation)
        for link in self.links:
            for reply in list(link.open):
                if reply.operation == operation:
                    reply.answer()

    def lose(self) -> None:
        """Break every connection, and refuse new ones."""
        self.reachable = False
        for link in self.links:
            link.lost.set()
            for reply in list(link.open):
                reply.answer()


class ScriptedLink:
    """A connection. Implements Link."""

    def __init__(self, naoqi: ScriptedNaoqi) -> None:
        self.lost = threading.Event()
        self.open: list[ScriptedReply] = []
        self._naoqi = naoqi

    def begin(self, operation: str, *arguments: object) -> ScriptedReply:
        """Start a call."""
        self._naoqi.calls.append((operation, *arguments))
        reply = ScriptedReply(self, self._naoqi, operation, arguments)
        if operation in self._naoqi.held and not self.lost.is_set():
            self.open.append(reply)
        else:
            reply.answer()
        return reply

    def close(self) -> None:
        """Disconnect."""
        self.lost.set()
        for reply in list(self.open):
            reply.answer()


class ScriptedReply:
    """An answer. Implements Reply."""

    def __init__(
        self, link: ScriptedLink, naoqi: ScriptedNaoqi, operation: str, arguments: tuple[object, ...]
    ) -> None:
        self.operation = operation
        self._link = link
        self._naoqi = naoqi
        self._arguments = arguments
        self._come = threading.Event()
        self._result: Any = None

    @property
    def done(self) -> bool:
        """Whether it has arrived."""
        return self._come.is_set()

    def answer(self) -> None:
        """Make it arrive."""
        if self in self._link.open:
            self._link.open.remove(self)
        try:
            if self._link.lost.is_set():
                raise LinkLost("Socket is not connected")
            answer = self._naoqi.answers.get(self.operation)
            self._result = answer(*self._arguments) if callable(answer) else answer
        except (CallFailed, LinkLost) as error:
            self._result = error
        self._come.set()

    def result(self, timeout: float) -> Any:
        """Return the answer."""
        if not self._come.wait(timeout):
            raise CallTimeout(f"{self.operation}: no answer within {timeout:g} s")
        if isinstance(self._result, Exception):
            raise self._result
        return self._result
