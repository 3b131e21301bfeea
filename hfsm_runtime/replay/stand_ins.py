"""What a component sees in a replay in place of servants: proxies that answer from the recording."""

from __future__ import annotations

import builtins
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, ClassVar, Final, NoReturn, TypeVar, cast

import msgspec

from hfsm_recording.messages import Reading, Result
from zenoh_ice import ObjectPrx, Sample, Subscription, exceptions
from zenoh_ice.exceptions import MarshalException, SystemException, TimeoutException, UnknownException
from zenoh_ice.interface import Operation
from zenoh_ice.streams import Delivery, StreamReader
from zenoh_ice.transport import Target, decode_error

from ..component import Component, proxies_of
from ..recording.results import put_bytes
from .answers import Answers
from .errors import MissingImageError, NothingRecordedError, ReplayError
from .script import Record, Want

__all__ = ["connect"]

V = TypeVar("V")

_TIMEOUT: Final = 2.0


def connect(component: Component, answers: Answers) -> None:
    """Give a component proxies that answer from a recording."""
    for name, declared in proxies_of(component).items():
        if isinstance(vars(component).get(name), _Replayed):  # another version of the component had it
            continue
        if not issubclass(declared.type, ObjectPrx):
            raise ReplayError(f"self.{name} is no proxy that can be replayed")
        members = {"_answers": answers, "_attribute": name}
        made: Any = type(declared.type.__name__, (_Replayed, declared.type), members)
        identity, _, realm = declared.identity.partition("@")
        vars(component)[name] = made(_Nobody(), Target(realm or "recording", identity), _TIMEOUT)


class _ReplayedSample(Sample[V]):
    """A sample whose age is what it was."""

    __slots__ = ("_age", "_answers", "_arrived")

    def __init__(self, value: V, message: Result, arrived: int, answers: Answers) -> None:
        time = float("nan") if message.time is None else message.time
        super().__init__(value, message.sequence, time, message.wall_time)
        self._arrived = arrived
        self._age = message.age or 0.0
        self._answers = answers

    @property
    def age(self) -> float:
        """Wall seconds since it was sent."""
        record = self._answers.take(Want("age"))
        if record is not None:
            return _number(record)
        return self._age + max(0, self._answers.now() - self._arrived) / 1e9


class _Nobody:
    """Stands for the communicator of a proxy: nobody is there."""

    realm: Final = "recording"
    destroyed: Final = False

    def check_timeout(self, seconds: float) -> float:
        """Return a limit of calls, which means nothing here."""
        return seconds

    def stringToProxy(self, text: str) -> NoReturn:
        """Raise: a proxy that arrives in a value leads nowhere."""
        raise ReplayError(f"the proxy {text} came in a value of the recording, which cannot be replayed")

    def __getattr__(self, name: str) -> NoReturn:
        raise ReplayError(f"a communicator cannot be used in a replay: {name}")


class _Replayed(ObjectPrx):
    """A proxy that answers from the recording: mixed into the proxy's class, for one attribute."""

    _answers: ClassVar[Answers]
    _attribute: ClassVar[str]

    def ice_invoke(self, operation: Operation[..., V], *args: Any, **kwargs: Any) -> V:  # noqa: ANN401, ARG002
        """Return, or raise, what the call brought."""
        want = Want("call", self._attribute, operation.name)
        record = self._answers.take(want, args)
        return cast("V", self._outcome(operation, want, record))

    def ice_invokeAsync(self, operation: Operation[..., V], *args: Any, **kwargs: Any) -> Future[V]:  # noqa: ANN401, ARG002
        """Return a future that is settled when the outcome arrived."""
        future: Future[V] = _ReplayedFuture(self._answers)
        future.set_running_or_notify_cancel()

        def settle(record: Record | None) -> None:
            try:
                value = self._outcome(operation, Want("async", self._attribute, operation.name), record)
            except Exception as error:  # noqa: BLE001 - it is told by the future
                future.set_exception(error)
            else:
                future.set_result(cast("V", value))

        record = self._answers.take(Want("begin", self._attribute, operation.name), args)
        if record is None:
            settle(None)
        else:
            self._answers.expect(f"future {_result(record).ticket}", settle)
        return future

    def ice_stream(self, operation: Operation[..., V]) -> StreamReader[V]:
        """Return a reader of the recorded samples."""
        reader = _ReplayedReader(self._answers, self._attribute, operation, self._outcome)
        return cast("StreamReader[V]", reader)

    def ice_subscribe(
        self,
        reader: StreamReader[V],
        callback: Callable[[Sample[V]], Any],
        delivery: Delivery,  # noqa: ARG002 - what was delivered is recorded
    ) -> Subscription[V]:
        """Call a function with the samples that a subscription brought."""
        operation = cast("_ReplayedReader", reader).operation
        want = Want("sample", self._attribute, operation.name)

        def deliver(record: Record) -> None:
            value = cast("V", self._outcome(operation, want, record))
            callback(_ReplayedSample(value, _result(record), record.time, self._answers))

        record = self._answers.take(Want("subscribe", self._attribute, operation.name))
        context = f"subscription {_result(record).ticket}" if record is not None else ""
        if context:
            self._answers.expect(context, deliver)
        return cast("Subscription[V]", _ReplayedSubscription(self._answers, context))

    def _outcome(self, operation: Operation[..., Any], want: Want, record: Record | None) -> object:
        """Return or raise what was recorded, or the newest that is known."""
        if record is None:
            record = self._answers.guess(want)
            if record is None:
                if not operation.result.fields:
                    return None
                raise NothingRecordedError(
                    f"nobody had read {want} by then, so the recording has no value for it"
                )
        message = _result(record)
        if message.error:
            raise _error(message, operation, want)
        if message.too_large:
            self._answers.give_up(
                ReplayError(f"{want}: a value of {message.too_large} bytes was too large to be recorded")
            )
        packed = message.packed if message.packed is not None else b"\x80"
        if message.missing:
            packed = self._with_bytes(packed, message, want)
        try:
            return operation.result.unpack_result(packed, str(want), cast("Any", self._communicator))
        except MarshalException as error:
            self._answers.give_up(
                ReplayError(f"a recorded value does not fit the interface: {error}; has it changed since?")
            )

    def _with_bytes(self, packed: bytes, message: Result, want: Want) -> bytes:
        try:
            plain = msgspec.msgpack.decode(packed)
            for missing in message.missing:
                data = self._answers.image(missing.hash)
                if data is None:
                    self._answers.give_up(
                        MissingImageError(
                            f"{want} brought {missing.size} bytes that are not in the recording: "
                            "code that looks at images can be replayed when the run was recorded "
                            "with --record-images"
                        )
                    )
                put_bytes(plain, missing, data)
            return msgspec.msgpack.encode(plain)
        except (msgspec.MsgspecError, LookupError, TypeError) as error:
            self._answers.give_up(ReplayError(f"a recorded value of {want} is malformed: {error}"))


class _ReplayedReader:
    """A reader of recorded samples: what `StreamedCall` asks of one."""

    def __init__(
        self,
        answers: Answers,
        attribute: str,
        operation: Operation[..., Any],
        outcome: Callable[[Operation[..., Any], Want, Record | None], object],
    ) -> None:
        self.operation = operation
        self._answers = answers
        self._attribute = attribute
        self._outcome = outcome

    def latest(self) -> Sample[Any] | None:
        """Return the newest sample."""
        return self._sample("latest")

    def wait(self, after: Sample[Any] | None, timeout: float) -> Sample[Any]:  # noqa: ARG002
        """Return the sample that the wait brought."""
        sample = self._sample("wait")
        if sample is None:
            raise TimeoutException(f"no sample of self.{self._attribute}.{self.operation.name} was recorded")
        return sample

    def _sample(self, kind: str) -> Sample[Any] | None:
        want = Want(kind, self._attribute, self.operation.name)
        newest = self._answers.newest_samples
        key = self._attribute, self.operation.name
        record = self._answers.take(want)
        if record is None:
            record = self._answers.guess(want)
            if record is None:
                return None
        message = _result(record)
        if message.error:
            raise _error(message, self.operation, want)
        if message.same and key in newest:
            return newest[key]
        if message.packed is None and not message.too_large:
            return None
        value = self._outcome(self.operation, want, record)
        newest[key] = _ReplayedSample(value, message, record.time, self._answers)
        return newest[key]


class _ReplayedFuture(Future[V]):
    """A future that is settled in its time."""

    def __init__(self, answers: Answers) -> None:
        super().__init__()
        self._answers = answers

    def result(self, timeout: float | None = None) -> V:  # noqa: ARG002
        """Wait for the outcome."""
        self._wait()
        return super().result(0.0)

    def exception(self, timeout: float | None = None) -> BaseException | None:  # noqa: ARG002
        """Wait for the outcome."""
        self._wait()
        return super().exception(0.0)

    def _wait(self) -> None:
        if not self.done():
            self._answers.read("future")


class _ReplayedSubscription:
    """A subscription to recorded samples."""

    def __init__(self, answers: Answers, context: str) -> None:
        self._answers = answers
        self._context = context

    def close(self) -> None:
        """End it."""
        self._answers.expect(self._context, None)

    def __enter__(self) -> _ReplayedSubscription:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _result(record: Record) -> Result:
    assert isinstance(record.message, Result)
    return record.message


def _number(record: Record) -> float:
    value = record.message.value if isinstance(record.message, Reading) else None
    return float(value) if isinstance(value, int | float) else 0.0


def _error(message: Result, operation: Operation[..., Any], want: Want) -> Exception:
    """Return the exception that was recorded."""
    name, _, text = message.error.partition(": ")
    system = getattr(exceptions, name, None)
    if name == MarshalException.__name__ or not (
        isinstance(system, type) and issubclass(system, SystemException)
    ):
        if message.packed_error is not None:
            return decode_error(message.packed_error, operation.exceptions, str(want))
        builtin = getattr(builtins, name, None)
        if isinstance(builtin, type) and issubclass(builtin, Exception):
            return builtin(text)
        return UnknownException(message.error)
    return system(text)
