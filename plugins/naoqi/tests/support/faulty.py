"""The fake robot as NAOqi with faults: `python -m plugins.naoqi.tests.support.faulty`, with the options of the plug-in.

Its service `Faults` delays calls or makes them fail, and sets what the robot feels.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from fnmatch import fnmatchcase
from typing import Any, ClassVar, Final
from unittest.mock import patch

from naoserver.errors import HardwareFailure
from naoserver.fake.robot import FakeSenses
from visualhfsm_naoqi.programs import _service
from visualhfsm_naoqi.programs.__main__ import main as serve
from visualhfsm_naoqi.programs._access import Access, S, Service
from visualhfsm_naoqi.programs._arguments import number, text, texts
from visualhfsm_naoqi.programs._calls import Calls, Operation
from visualhfsm_naoqi.programs._clients import Call, Client
from visualhfsm_naoqi.programs._connections import Connections, Offer
from visualhfsm_naoqi.programs._memory import ALMemory
from visualhfsm_naoqi.programs._sensors import Part
from visualhfsm_naoqi.programs._video import SIGNATURE, ALVideoDevice, Picture

__all__ = ["main"]

_ANSWERING: Final = 0.05
"""Wall seconds for the answer to a call that ends its own connection."""


class Faults(Service):
    """Delay calls or make them fail, and let a robot feel and hear.

    Patterns of the names of calls, such as `ALMotion::setAngles`, and of keys are shell patterns.
    """

    served: ClassVar[Faults]
    """Those of this process, which serves one robot."""

    def __init__(self, access: Access) -> None:
        super().__init__(access)
        Faults.served = self
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

    def disconnect(self) -> None:
        """Close every connection, as soon as this call is answered."""
        _BrittleConnections.served.disconnect()

    def touch(self, names: object) -> None:
        """Touch the robot at some sensors, such as HeadFront, and at no other."""
        senses = self._access.robot.senses
        assert isinstance(senses, FakeSenses)
        senses.feel(touched=frozenset(texts(names, "names")))

    def say(self, sentence: object) -> str:
        """Say something to the robot; return what ALSpeechRecognition recognized."""
        return self._access.hearing.hear(text(sentence, "sentence"))

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


class _FaultyAccess(Access):
    def service(self, kind: type[S]) -> S:
        """Return the only service of a kind."""
        found = super().service(_FAULTY.get(kind, kind))
        assert isinstance(found, kind)
        return found


class _BrittleConnections(Connections):
    served: ClassVar[_BrittleConnections]

    def __init__(self, url: str, offer: Offer, lose: Callable[[Client], None]) -> None:
        super().__init__(url, offer, lose)
        _BrittleConnections.served = self

    def disconnect(self) -> None:
        self._loop.call_soon_threadsafe(self._loop.call_later, _ANSWERING, self._break)

    def _break(self) -> None:
        for task in self._open:
            task.cancel()


class _FaultyCalls(Calls):
    def invoke(
        self, operation: Operation, client: Client, *arguments: object, awaited: bool = True
    ) -> object:
        """Perform an operation after its delay, unless it is to fail."""
        name, delay = operation.name, Faults.served._delay(operation.name)

        def late(call: Call, *given: object) -> object:
            call.stopped.wait(delay)
            return struck(*([call] if operation.long else []), *given)

        def struck(*given: object) -> object:
            Faults.served._strike(name)
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
        return [key for key in super().getDataListName() if Faults.served._knows(key)]

    def _look(
        self, key: str, read: Callable[[Part], Mapping[str, Any]] = operator.call
    ) -> tuple[bool, object]:
        return super()._look(key, read) if Faults.served._knows(key) else (False, None)


class _BlindVideo(ALVideoDevice):
    def getImageRemote(self, call: Call, handle: object) -> Picture | None:
        self._get(handle)
        return None if Faults.served._blind else super().getImageRemote(call, handle)

    getImageRemote.__qi_return_signature__ = SIGNATURE  # type: ignore[attr-defined]


_FAULTY: dict[type[Any], type[Any]] = {ALMemory: _ForgetfulMemory, ALVideoDevice: _BlindVideo}


def main() -> None:
    """Serve it."""
    faulty: dict[str, Any] = {
        "Access": _FaultyAccess,
        "Calls": _FaultyCalls,
        "Connections": _BrittleConnections,
        "SERVICES": {**_service.SERVICES, "Faults": (Faults,)},
    }
    with patch.multiple(_service, **faulty):
        serve()


if __name__ == "__main__":
    main()
