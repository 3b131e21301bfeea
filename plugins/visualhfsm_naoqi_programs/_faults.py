"""Faults and events with which people test their programs: what `--faults` adds."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from naoserver.bodies.capabilities import SonarReading
from naoserver.errors import HardwareFailure
from naoserver.fake.robot import FakeSenses
from naoserver.protocol.robot import Robot
from naoserver.serving.assembly import Assembly

from ._access import Access, S
from ._arguments import number, number_within, text, texts
from ._calls import Calls, Operation
from ._clients import Call, CallTable, Client
from ._memory import ALMemory
from ._sensors import Part
from ._video import SIGNATURE, ALVideoDevice, Picture


class Faults:
    """The service `Faults`: delay calls or make them fail, and set what a fake robot feels.

    Patterns of the names of calls, such as `ALMotion::setAngles`, and of keys are shell patterns.
    """

    def __init__(self, access: Access) -> None:
        self._access = access
        self.clear()

    def clear(self) -> None:
        """End all faults."""
        self._delays: dict[str, float] = {}  # wall seconds, by pattern
        self._errors: dict[str, str] = {}  # messages, by pattern; empty for none
        self._forgotten: set[str] = set()
        self._blind = False

    def slow(self, pattern: object, seconds: object) -> None:
        """Make calls such as `ALMotion::*` late by some wall seconds; 0 ends it."""
        self._delays[text(pattern, "pattern")] = number(seconds, "seconds")

    def fail(self, pattern: object, message: object) -> None:
        """Make calls fail with a message; an empty one ends it."""
        self._errors[text(pattern, "pattern")] = text(message, "message")

    def forget(self, pattern: object) -> None:
        """Hide keys that match from ALMemory, as other robots and versions lack them."""
        self._forgotten.add(text(pattern, "pattern"))

    def blind(self, yes: object) -> None:
        """Make the cameras return no image."""
        self._blind = bool(yes)

    def disconnect(self, seconds: object) -> None:
        """Close every connection, and listen again after some wall seconds, at most a minute."""
        self._access.interrupt(number_within(seconds, "seconds", 0.0, 60.0))

    def touch(self, names: object) -> None:
        """Touch a fake robot at some sensors, such as HeadFront, and at no other."""
        self._fake.feel(touched=frozenset(texts(names, "names")))

    def near(self, left: object, right: object) -> None:
        """Put something in front of the sonar of a fake robot, at distances in m."""
        self._fake.feel(sonar=SonarReading(number(left, "left"), number(right, "right")))

    def say(self, sentence: object) -> str:
        """Say something to the robot; return what ALSpeechRecognition recognized."""
        return self._access.hearing.hear(text(sentence, "sentence"))

    def tilt(self, roll: object, pitch: object) -> None:
        """Tilt the torso of a fake robot, in rad, as its inertial unit feels it."""
        before = self._fake.read().inertial
        self._fake.feel(inertial=replace(before, roll=number(roll, "roll"), pitch=number(pitch, "pitch")))

    @property
    def _fake(self) -> FakeSenses:
        senses = self._access.robot.senses
        if not isinstance(senses, FakeSenses):
            raise HardwareFailure("this robot feels by itself")
        return senses

    # Calls read copies, because a client may change the faults meanwhile.

    def _delay(self, name: str) -> float:
        """Return the delay of a call in wall seconds."""
        delays = self._delays.copy()
        return max((delays[pattern] for pattern in delays if fnmatchcase(name, pattern)), default=0.0)

    def _strike(self, name: str) -> None:
        """Raise HardwareFailure when a call is to fail."""
        for pattern, message in self._errors.copy().items():
            if message and fnmatchcase(name, pattern):
                raise HardwareFailure(message)

    def _knows(self, key: str) -> bool:
        """Return whether ALMemory may know something under a key."""
        return not any(fnmatchcase(key, pattern) for pattern in self._forgotten.copy())


class FaultyAccess(Access):
    """Access to a robot whose services have the faults of `Faults`."""

    def __init__(self, robot: Robot, assembly: Assembly, disk: Path) -> None:
        super().__init__(robot, assembly, disk)
        self.faults = Faults(self)
        self.others = {"Faults": [self.faults]}

    def make_calls(self) -> Calls:
        """Return what runs the operations, late or not at all."""
        return _FaultyCalls(self.calls, self.faults)

    def service(self, kind: type[S]) -> S:
        """Return the only service of a kind."""
        found = super().service(_FAULTY.get(kind, kind))
        assert isinstance(found, kind)
        return found


class _FaultyCalls(Calls):
    def __init__(self, calls: CallTable, faults: Faults) -> None:
        super().__init__(calls)
        self._faults = faults

    def invoke(
        self, operation: Operation, client: Client, *arguments: object, awaited: bool = True
    ) -> object:
        """Perform an operation after its delay, unless it is to fail."""
        name, delay = operation.name, self._faults._delay(operation.name)

        def late(call: Call, *given: object) -> object:
            call.stopped.wait(delay)
            return struck(*([call] if operation.long else []), *given)

        def struck(*given: object) -> object:
            self._faults._strike(name)
            return operation.method(*given)

        method, long = (late, True) if delay > 0.0 else (struck, operation.long)
        return super().invoke(
            operation._replace(method=method, long=long), client, *arguments, awaited=awaited
        )

    def _described(self, operation: Operation) -> Callable[..., Any]:
        described: Any = super()._described(operation)
        if described.__qi_return_signature__ is not None:  # or no value, which only newer clients understand
            described.__qi_return_signature__ = f"+{described.__qi_return_signature__}"
        return described  # type: ignore[no-any-return]


class _ForgetfulMemory(ALMemory):
    def getDataListName(self) -> list[str]:
        return [key for key in super().getDataListName() if self._knows(key)]

    def _look(
        self, key: str, read: Callable[[Part], Mapping[str, Any]] = operator.call
    ) -> tuple[bool, object]:
        return super()._look(key, read) if self._knows(key) else (False, None)

    def _knows(self, key: str) -> bool:
        assert isinstance(self._access, FaultyAccess)
        return self._access.faults._knows(key)


class _BlindVideo(ALVideoDevice):
    def getImageRemote(self, call: Call, handle: object) -> Picture | None:
        assert isinstance(self._access, FaultyAccess)
        self._get(handle)
        return None if self._access.faults._blind else super().getImageRemote(call, handle)

    getImageRemote.__qi_return_signature__ = SIGNATURE  # type: ignore[attr-defined]


_FAULTY: dict[type[Any], type[Any]] = {ALMemory: _ForgetfulMemory, ALVideoDevice: _BlindVideo}
