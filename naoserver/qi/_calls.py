"""Calls of libqi to the services: one wrapper for errors, long calls and injected faults.

It handles these pitfalls of libqi in Python: a blocking method occupies one of its few threads, so long
calls return a future and run in a pool; an exception exposes the path and line of the code, so errors are
failed futures, which expose only their text; every method of a registered object can be called, so a bare
facade with only the operations is registered.
"""

from __future__ import annotations

import inspect
import logging
import math
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import replace
from fnmatch import fnmatchcase
from typing import Any, Final
from weakref import WeakSet

import qi

from naoserver.capabilities import Senses, SonarReading
from naoserver.errors import HardwareFailure, InvalidCommand, RobotError
from naoserver.expression import Hearing
from naoserver.fake.robot import FakeSenses
from naoserver.qi._arguments import number, number_within, text, texts
from naoserver.qi._clients import (
    MOST_WAITING,
    MOST_WAITING_URGENT,
    Call,
    CallTable,
    Client,
    QiLimits,
    running,
)
from naoserver.qi._modules import Module, Operation, operation_of
from zenoh_ice import Clock

_logger = logging.getLogger(__name__)


class Faults:
    """The service `Faults`: delay calls or make them fail, and set what a fake robot feels.

    Patterns of the names of calls, such as `ALMotion::setAngles`, and of keys are shell patterns. There are
    no faults unless requested.
    """

    def __init__(
        self, senses: Senses | None = None, hearing: Hearing | None = None, *, enabled: bool = False
    ) -> None:
        """Serve a robot with some senses."""
        self.enabled: Final = enabled
        """Whether clients can reach this service."""
        self.interrupt: Callable[[float], None] = lambda _seconds: None
        """Close all connections for some wall seconds."""
        self._senses = senses
        self._hearing = hearing or Hearing()
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
        self.interrupt(number_within(seconds, "seconds", 0.0, 60.0))

    def touch(self, names: object) -> None:
        """Touch a fake robot at some sensors, such as HeadFront, and at no other."""
        self._fake.feel(touched=frozenset(texts(names, "names")))

    def near(self, left: object, right: object) -> None:
        """Put something in front of the sonar of a fake robot, at distances in m."""
        self._fake.feel(sonar=SonarReading(number(left, "left"), number(right, "right")))

    def say(self, sentence: object) -> str:
        """Say something to the robot; return what ALSpeechRecognition recognized."""
        return self._hearing.hear(text(sentence, "sentence"))

    def tilt(self, roll: object, pitch: object) -> None:
        """Tilt the torso of a fake robot, in rad, as its inertial unit feels it."""
        before = self._fake.read().inertial
        self._fake.feel(inertial=replace(before, roll=number(roll, "roll"), pitch=number(pitch, "pitch")))

    @property
    def _fake(self) -> FakeSenses:
        if not isinstance(self._senses, FakeSenses):
            raise HardwareFailure("this robot feels by itself")
        return self._senses

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


class Calls:
    """Run the operations of services for libqi.

    Short operations run in the thread of libqi that received the call, so a stop waits for nobody. Long ones
    run in the threads of their client.
    """

    def __init__(
        self, clock: Clock, calls: CallTable, faults: Faults, limits: QiLimits | None = None
    ) -> None:
        self._clock = clock
        self._end_limit = (limits or QiLimits()).end
        self._calls = calls
        self._faults = faults
        self._clients: WeakSet[Client] = WeakSet()
        self._lock = threading.Lock()
        self._closed = False

    def facade(self, name: str, parts: Sequence[object]) -> Callable[[Client], object]:
        """Return the factory of a client's object with only the public methods of some parts, as `name`."""
        operations: dict[str, Operation] = {}
        description = (inspect.getdoc(type(parts[0])) or "").partition("\n\n")[0]
        module = Module(name, description, operations, self.invoke, self._calls)
        for each in (module, *parts):  # the service's own win
            for method in dir(type(each)):
                if not method.startswith("_") and inspect.isfunction(getattr(type(each), method)):
                    operations[method] = operation_of(f"{name}::{method}", getattr(each, method))
        methods = {method: self._described(operation) for method, operation in operations.items()}
        made = qi.multiThreaded()(type(name, (), methods))

        def make(client: Client) -> object:
            facade = made()
            facade._client = client
            result: object = facade
            return result

        return make

    def close(self) -> None:
        """Stop the running calls, begin no others, and wait, with a limit, for their end."""
        with self._lock:
            self._closed = True
            clients = list(self._clients)
        with self._calls.stopping(lambda _call: True):
            pass
        for client in clients:
            client.close()
        if not self._calls.wait_for_end(self._end_limit):
            _logger.error("calls of programs did not end within %g s", self._end_limit)

    def invoke(
        self, operation: Operation, client: Client, *arguments: object, awaited: bool = True
    ) -> object:
        """Perform an operation for a client; return its result, or the future of a long or failed one."""
        name = operation.name
        try:
            operation.signature.bind(*arguments)
        except TypeError as error:
            return failed(f"{name}: {error}")
        delay = self._faults._delay(name)
        long = operation.long or delay > 0.0
        call = Call(self._clock, client, operation.activities, arguments, awaited=long and awaited)

        def work() -> object:
            call.stopped.wait(delay)
            self._faults._strike(name)
            with running(call):
                return operation.method(*([call] if operation.long else []), *arguments)

        if long:
            return self._begin(name, call, work, urgent=operation.urgent)
        try:
            return self._do(call, work)
        except Exception as error:  # noqa: BLE001 - whatever it is, the client hears of it
            return failed(_reported(name, error))

    def _described(self, operation: Operation) -> Callable[..., Any]:
        """Return the method of a facade with what libqi wants to know about it."""

        def called(facade: Any, *arguments: object) -> object:  # noqa: ANN401 - its class is made here
            return self.invoke(operation, facade._client, *arguments)

        parameters = operation.signature.parameters.values()
        plain = all(p.kind is p.POSITIONAL_OR_KEYWORD and p.default is p.empty for p in parameters)
        called.__qi_signature__ = f"({'m' * len(parameters)})" if plain else "m"  # type: ignore[attr-defined]
        result = getattr(operation.method, "__qi_return_signature__", None)
        if result is not None and self._faults.enabled:
            result = f"+{result}"  # or no value, which only newer clients understand
        called.__qi_return_signature__ = result  # type: ignore[attr-defined]
        called.__qi_name__ = None  # type: ignore[attr-defined]
        called.__doc__ = operation.description or None
        return called

    def _do(self, call: Call, work: Callable[[], object]) -> object:
        """Do the work of a short call, registered if it begins something."""
        if not call.activities:
            return work()
        self._calls.add(call, math.inf)
        try:
            return work()
        finally:
            self._calls.remove(call)

    def _begin(self, name: str, call: Call, work: Callable[[], object], *, urgent: bool) -> object:
        """Do the work of a long call in a thread of its client; return the future of its result."""
        promise = qi.Promise(lambda _promise: call.stop())

        def give_up() -> None:
            """Answer a call that was stopped before a thread took it."""
            if call.refusal:
                promise.setError(f"{name}: {call.refusal}")
            else:
                promise.setValue(None)

        def run() -> None:
            if call.stopped.is_set():
                give_up()
                return
            try:
                promise.setValue(work())
            except Exception as error:  # noqa: BLE001 - whatever it is, the client hears of it
                promise.setError(_reported(name, error))

        def ended(done: Future[None]) -> None:
            self._calls.remove(call)
            if done.cancelled():
                give_up()

        client = call.client
        with self._lock:
            if self._closed:
                return failed(f"{name}: the robot is shutting down")
            self._clients.add(client)
        try:
            self._calls.add(call, MOST_WAITING_URGENT if urgent else MOST_WAITING)
            call.work = (client.urgent_threads if urgent else client.threads).submit(run)
        except InvalidCommand as error:
            return failed(f"{name}: {error}")
        except RuntimeError as error:  # the program is gone, or no thread can start
            call.stop()
            self._calls.remove(call)
            return failed(f"{name}: {error}")
        call.work.add_done_callback(ended)
        if call.stopped.is_set():  # meanwhile
            call.stop()
        return promise.future()


def _reported(name: str, error: Exception) -> str:
    if isinstance(error, RobotError):
        return f"{name}: {error}"
    _logger.error("%s failed", name, exc_info=error)
    return f"{name}: {type(error).__name__}: {error}"


def failed(message: str) -> qi.Future:
    """Return the future of a call that failed."""
    promise = qi.Promise()
    promise.setError(message)
    return promise.future()
