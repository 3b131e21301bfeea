"""The transport of a replayed component: the recording answers its calls and has its samples."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from functools import partial
from typing import Any, Final, NoReturn

import msgspec

from hfsm_runtime.recording_file.messages import Missing, Reading, Result
from zenoh_ice import ConfigurationException, MarshalException, ObjectPrx, Settings, ZenohIceError
from zenoh_ice.data import exceptions, typed
from zenoh_ice.data.exceptions import SystemException, TimeoutException, UnknownException
from zenoh_ice.data.interface import Operation
from zenoh_ice.data.keys import Target
from zenoh_ice.data.wire import decode_error
from zenoh_ice.threads.clock import VirtualClock
from zenoh_ice.transport import Arrived, Caller, Inlet, Outcome

from .._recording.clocks import InterceptedClock
from .._recording.results import put_bytes
from .._recording.transport import ObservedTransport, encoded_sample, target_of
from ..component import Component, proxies_of
from .answers import Answers
from .script import NothingRecordedError, Recording, ReplayError, TimedMessage, Want

_NOTHING: Final = b"\x80"
"""The encoded result of an operation that returns nothing."""


class ReplayTransport(ObservedTransport):
    """Answer calls and deliver samples from a recording."""

    def __init__(self, recording: Recording, answers: Answers) -> None:
        try:
            settings = Settings(realm=recording.metadata.get("realm") or "recording")
        except ConfigurationException as error:
            raise ReplayError(f"the recording is malformed: {error}") from error
        self.clock = InterceptedClock(VirtualClock(), answers.ask)
        super().__init__(settings)
        self.answers: Final = answers
        self.recording: Final = recording
        self.names: Final[dict[Target, str]] = {}
        """The names by which the recording identifies servants: the attributes of the recorded component."""
        with suppress(msgspec.MsgspecError, ConfigurationException):
            proxies = typed.from_json(recording.metadata.get("proxies", "{}"), dict[str, str])
            for name, identity in proxies.items():
                self.names.setdefault(target_of(self.communicator.stringToProxy(identity)), name)

    def connect(self, component: Component) -> None:
        """Give a component the proxies that it has not taken over from another version of it."""
        for name, declared in proxies_of(component).items():
            if isinstance(vars(component).get(name), ObjectPrx):
                continue
            if not issubclass(declared.type, ObjectPrx):
                raise ReplayError(f"self.{name} is not a proxy that can be replayed")
            proxy = declared.type.uncheckedCast(self.communicator.stringToProxy(declared.identity))
            self.names.setdefault(target_of(proxy), name)
            vars(component)[name] = proxy

    def call_through(self, target: Target, operation: Operation[..., Any], timeout: float) -> Caller:
        return _ReplayedCaller(self, target, operation, timeout)

    def subscribe(self, target: Target, operation: Operation[..., Any], queue: int = 1) -> Inlet:  # noqa: ARG002
        """Return a listening end of a stream."""
        return _ReplayedInlet(self, target, operation)

    def find(self, target: Target, type_id: str, timeout: float) -> NoReturn:  # noqa: ARG002
        """Raise ReplayError: presence is not recorded."""
        raise ReplayError(f"whether {target} is a {type_id} was not recorded: cast its proxy unchecked")

    def wait(self, future: Future[Any], timeout: float | None) -> None:  # noqa: ARG002
        """Wait until the recorded result has arrived."""
        self.answers.ask("future")


class _Replayed:
    """One operation of a servant."""

    def __init__(self, transport: ReplayTransport, target: Target, operation: Operation[..., Any]) -> None:
        self._transport: Final = transport
        self._answers: Final = transport.answers
        self._resolve: Final = transport.communicator.stringToProxy
        self._target: Final = target
        self._operation: Final = operation
        self._name: Final = transport.names.get(target, str(target))

    def _want(self, kind: str) -> Want:
        """Return the request for the recording."""
        return Want(kind, self._name, self._operation.name)

    def _failure(self, message: Result) -> ZenohIceError:
        """Return the exception that was recorded."""
        name, _, text = message.error.partition(": ")
        known = getattr(exceptions, name, None)
        if isinstance(known, type) and issubclass(known, SystemException) and known is not MarshalException:
            return known(text)
        if message.packed_error is None:
            return UnknownException(message.error)
        return decode_error(
            message.packed_error, self._operation.exceptions, self._operation.name, self._resolve
        )

    def _payload(self, message: Result, want: Want) -> bytes:
        """Return the result, or the sample, that was recorded."""
        packed = _NOTHING if message.packed is None else message.packed
        try:
            if message.too_large:
                raise ReplayError(
                    f"{want}: a value of {message.too_large} bytes was too large to be recorded"
                )
            if message.missing:
                packed = self._with_bytes(packed, message.missing, want)
            if not message.error:  # otherwise it did not fit then, either
                self._operation.result.unpack(packed, str(want), self._resolve)
        except MarshalException as error:
            text = f"a recorded value does not fit the interface: {error}; has it changed since?"
            self._answers.give_up(ReplayError(text))
        except (msgspec.MsgspecError, LookupError, TypeError) as error:
            self._answers.give_up(ReplayError(f"a recorded value of {want} is malformed: {error}"))
        except ReplayError as error:
            self._answers.give_up(error)
        return packed

    def _with_bytes(self, packed: bytes, missing: list[Missing], want: Want) -> bytes:
        plain = typed.from_msgpack(packed)
        for each in missing:
            data = self._transport.recording.image(each.hash)
            if data is None:
                raise ReplayError(
                    f"{want} returned {each.size} bytes that are not in the recording: code that looks at "
                    "images can be replayed when the run was recorded with --record-images"
                )
            put_bytes(plain, each, data)
        return msgspec.msgpack.encode(plain)


class _ReplayedCaller(_Replayed):
    """Call an operation: the outcome is the recorded one, or the newest that is known."""

    def __init__(
        self, transport: ReplayTransport, target: Target, operation: Operation[..., Any], timeout: float
    ) -> None:
        super().__init__(transport, target, operation)
        self.timeout: Final = timeout

    def call(self, payload: bytes) -> Outcome:
        want = self._want("call")
        outcome = self._outcome(want, self._answers.fetch(want, payload))
        if isinstance(outcome, SystemException):
            raise outcome
        return outcome

    def begin(
        self, payload: bytes, done: Callable[[Outcome | SystemException], object]
    ) -> Callable[[], object]:

        def settle(record: TimedMessage | None) -> None:
            done(self._outcome(self._want("async"), record))

        record = self._answers.fetch(self._want("begin"), payload, park=False)
        if record is None:
            settle(None)
        else:
            self._answers.expected[f"future {result_in(record).ticket}"] = settle
        return lambda: None

    def _outcome(self, want: Want, record: TimedMessage | None) -> Outcome | SystemException:
        record = record or self._answers.guess(want)
        if record is None:
            if not self._operation.result.fields:
                return True, _NOTHING
            raise NothingRecordedError(
                f"nobody had read {want} by then, so the recording has no value for it"
            )
        message = result_in(record)
        if not message.error or message.packed is not None:
            return True, self._payload(message, want)
        failure = self._failure(message)
        return failure if isinstance(failure, SystemException) else (False, message.packed_error or b"")


class _ReplayedInlet(_Replayed):
    """The listening end of a stream: returns a record where the recorded code saw a new sample."""

    def __init__(self, transport: ReplayTransport, target: Target, operation: Operation[..., Any]) -> None:
        super().__init__(transport, target, operation)
        self._newest: TimedMessage | None = None  # that the reader has
        self._context = ""

    def poll(self) -> TimedMessage | None:
        want = self._want("latest")
        # Not parked: the reader is locked meanwhile, and no other code ran in between.
        record = self._answers.fetch(want, park=False)
        if record is None or (result_in(record).same and self._newest is None):
            record = self._answers.guess(want)
            if record is None or record is self._newest:
                return None
        message = result_in(record)
        if message.same:
            return None
        if message.packed is None and not message.too_large:
            if message.error:
                raise self._failure(message)
            self._newest = None
            self._transport.forget(self._target, self._operation)
            return None
        self._newest = record
        return record

    def wait(self, changed: threading.Condition, holds: Callable[[], bool], timeout: float) -> bool:  # noqa: ARG002
        """Wait, as in the recording, until a function that polls returns true."""
        want = self._want("wait")
        while not holds():
            record = self._answers.fetch(want)
            if record is None:
                self._answers.wait(timeout)
                raise TimeoutException(f"no new sample of {want} was recorded")
            if result_in(record).error:
                raise self._failure(result_in(record))
        return True

    def deliver(self, callback: Callable[[Any], object], rate: float | None = None) -> None:  # noqa: ARG002
        """Call a function with the samples of a subscription."""
        record = self._answers.fetch(self._want("subscribe"), park=False)
        if record is not None:
            self._context = f"subscription {result_in(record).ticket}"
            self._answers.expected[self._context] = callback

    def open(self, record: TimedMessage) -> Arrived:
        """Return the value of a sample, with its recorded ages."""
        message = result_in(record)
        payload = self._payload(message, self._want(message.kind))
        return encoded_sample(
            self._operation, payload, msgspec.structs.asdict(message), partial(self._age, record)
        )

    def close(self, timeout: float = 0.0) -> bool:  # noqa: ARG002
        self._answers.expected.pop(self._context, None)
        return True

    def _age(self, record: TimedMessage) -> float:
        found = self._answers.fetch(Want("age"))
        if found is not None:
            value = found.message.value if isinstance(found.message, Reading) else None
            return float(value) if isinstance(value, int | float) else 0.0
        passed = max(0, self._answers.now() - record.time) / 1e9
        return (result_in(record).age or 0.0) + passed


def result_in(record: TimedMessage) -> Result:
    """Return the message of a record about an operation."""
    assert isinstance(record.message, Result)
    return record.message
