"""Proxies, through which clients call servants and follow their streams.

A class with annotated methods declares the proxy of an interface:

    class PoseHeadPrx(ObjectPrx, id="::nao::PoseHead", fingerprint="8c1929ab33b66aff"):
        @operation(throws=(InvalidValueException,))
        def setPose(self, pan: float, tilt: float) -> HeadPose:
            \"\"\"Turn the head to a pose in rad.\"\"\"

`head.setPose(0.5, 0.0)` calls, `head.setPose.begin(0.5, 0.0)` returns a future.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, InvalidStateError
from contextlib import suppress
from typing import (
    TYPE_CHECKING,
    Any,
    ClassVar,
    Concatenate,
    Final,
    Generic,
    ParamSpec,
    Self,
    TypeVar,
    Unpack,
    cast,
    overload,
)

from zenoh_ice.data.codec import Parted, encode
from zenoh_ice.data.exceptions import (
    CommunicatorDestroyedException,
    ConfigurationException,
    InterfaceMismatchException,
    MarshalException,
    SystemException,
    ZenohIceError,
)
from zenoh_ice.data.interface import (
    ICE_DESCRIBE,
    ICE_ID,
    ICE_IDS,
    ICE_IS_A,
    ICE_PING,
    OBJECT_INTERFACE,
    Interface,
    Operation,
    OperationOptions,
)
from zenoh_ice.data.keys import Target
from zenoh_ice.data.reflection import Schema, describe_difference, parse_schema
from zenoh_ice.data.values import Reference
from zenoh_ice.data.wire import decode_error
from zenoh_ice.objects.home import Home
from zenoh_ice.objects.streams import Sample, Samples, StreamReader, Subscription
from zenoh_ice.transport import Caller, NoAnswer, Outcome

P = ParamSpec("P")
V = TypeVar("V")

_LONGEST_TIMEOUT: Final = 86_400.0  # s


class Call(Generic[P, V]):
    """An operation of a proxy: call it and wait for its outcome, or begin a call."""

    def __init__(self, proxy: ObjectPrx, operation: Operation[P, V]) -> None:
        arguments = operation.arguments
        self.__doc__ = operation.__doc__
        self._proxy: Final = proxy
        self._communicator: Final = proxy._communicator
        self._operation: Final = operation
        self._what: Final = f"{proxy._target.identity}.{operation.name}"
        self._reply: Final = f"reply of {self._what}"
        self._result: Final = operation.result
        self._resolve: Final = proxy._communicator.stringToProxy
        self._fingerprint: Final = proxy.ice_interface.fingerprint
        self._size_limit: Final = arguments.size_limit
        self._make: Final = arguments.make
        self._caller: Caller | None = None  # once its servant was found

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> V:
        """Call the operation and wait for its outcome.

        Raises the exceptions that the operation declares, or a SystemException; always within the limit.
        """
        answer = self._call(encode(self._make(*args, **kwargs), self._what))
        result = self._result
        return cast("V", result.value_of(result.unpack(answer, self._reply, self._resolve)))

    def begin(self, *args: P.args, **kwargs: P.kwargs) -> Future[V]:
        """Call the operation without waiting; the future has what the call would return or raise."""
        arguments = self._make(*args, **kwargs)
        return self._launch(lambda: encode(arguments, self._what), self._unpack)

    def call_encoded(self, payload: bytes) -> bytes | Parted:
        """Call with encoded arguments and return the encoded result; raises as the call does."""
        return self._call(payload)

    def begin_encoded(self, payload: bytes) -> Future[bytes | Parted]:
        """Call with encoded arguments without waiting; the future has what `call_encoded` would return."""
        return self._launch(lambda: payload, lambda answer: answer)

    def _call(self, payload: bytes) -> bytes | Parted:
        """Call and wait; return the encoded result."""
        caller = self._caller
        if caller is None:
            if self._proxy._line in self._communicator.pool.lines:  # it must not overtake waiting calls
                return self.begin_encoded(payload).result()
            caller = self._find(time.monotonic() + self._proxy._timeout)
        self._admit(payload)
        started = time.monotonic()
        try:
            ok, answer = caller.call(payload)
        except NoAnswer as end:
            ok, answer = self._retry(caller, payload, end, started)
        if not ok:
            raise self._failure(answer, started + caller.timeout)
        return answer

    def _launch(self, encode: Callable[[], bytes], finish: Callable[[bytes | Parted], object]) -> Future[Any]:
        """Call without waiting; `finish` makes the future's result of the encoded one."""
        communicator, line = self._communicator, self._proxy._line
        future = communicator.new_future()
        deadline = time.monotonic() + self._proxy._timeout

        def start() -> None:
            try:
                caller = self._caller
                if caller is None:
                    caller = self._find(deadline)
                    if future.done():  # cancelled meanwhile
                        return
                self._begin(caller, encode(), finish, future)
            except Exception as error:  # noqa: BLE001 - the future raises it
                fail(future, error)

        try:
            known = self._caller is not None or communicator.knows(self._proxy._target)
            if line in communicator.pool.lines or not known:
                communicator.pool.submit_in_line(line, start)  # it may take a while
            else:
                start()
        except ZenohIceError as error:
            fail(future, error)
        return future

    def _find(self, deadline: float) -> Caller:
        """Wait until the servant is present, and return its caller.

        The wait and the call together end at a moment of the monotonic clock, within the proxy's limit.
        """
        proxy = self._proxy
        operation = self._operation
        communicator = self._communicator
        target, limit = proxy._target, proxy._timeout
        if not communicator.knows(target):
            communicator.check()
            # A call of a servant that was lost fails at once, like every later one.
            if not communicator.presence.is_lost(target):
                communicator.find(target, None, deadline - time.monotonic(), since=deadline - limit)
        left = deadline - time.monotonic()
        if left < 0.99 * limit:  # in hundredths: each different limit needs another querier
            limit *= max(1, int(100 * left / limit)) / 100
        caller = communicator.transport.caller(
            target, operation, timeout=limit, fingerprint=self._fingerprint
        )
        # Later calls use it, too, but must not overtake those that wait for the servant.
        if limit == proxy._timeout and proxy._line not in communicator.pool.lines:
            self._caller = caller
        return caller

    def _admit(self, payload: bytes) -> None:
        """Raise the reason why a request is not sent, if there is one."""
        communicator = self._communicator
        communicator.check()
        if communicator.sends_only_stops and not self._operation.stop:
            raise CommunicatorDestroyedException(f"{self._what}: the component has ended")
        if len(payload) > self._size_limit:
            raise MarshalException(
                f"{self._what}: a request of {len(payload)} bytes; at most {self._size_limit} are sent"
            )

    def _unpack(self, answer: bytes | Parted) -> object:
        """Return what the operation returns."""
        return self._result.unpack_result(answer, self._reply, self._resolve)

    def _failure(self, answer: bytes | Parted, deadline: float) -> ZenohIceError:
        """Return what the operation raises; asks for the reason until a moment of the monotonic clock."""
        failure = decode_error(cast("bytes", answer), self._operation.exceptions, self._what, self._resolve)
        # Not for the call that asks for the difference: a servant that refuses it would be asked forever.
        if isinstance(failure, InterfaceMismatchException) and not failure.member and self._fingerprint:
            difference = _difference(self._proxy, deadline)
            return InterfaceMismatchException(
                f"{failure}; {difference}", failure.expected, failure.found, difference
            )
        return failure

    def _retry(
        self, caller: Caller, payload: bytes, end: NoAnswer, started: float, *, repeatable: bool = True
    ) -> Outcome:
        """Call an idempotent operation again if its server was lost and is back, or its connection alone was.

        Otherwise raise the reason why there was no answer.
        """
        presence, target = self._communicator.presence, self._proxy._target
        limit = self._proxy._timeout
        error = presence.explain_no_answer(target, self._what, started, caller.timeout, end, limit=limit)
        left = started + caller.timeout - time.monotonic()
        if not (repeatable and self._operation.idempotent) or end.timed_out or left <= 0:
            raise error
        restarted = presence.lost_since(target, started) or presence.came_since(target, started)
        if not restarted and not (end.broken and presence.is_served(target, left)):
            raise error
        if not presence.wait_for_return(target, min(self._communicator.limits.retry, left)):
            raise error
        again = time.monotonic()
        caller = self._find(started + caller.timeout)
        try:
            return caller.call(payload)
        except NoAnswer as second:
            raise presence.explain_no_answer(
                target, self._what, again, caller.timeout, second, limit=limit
            ) from None

    def _begin(
        self, caller: Caller, payload: bytes, finish: Callable[[bytes | Parted], object], future: Future[Any]
    ) -> None:
        """Call without waiting; a future gets the outcome."""
        self._admit(payload)
        started = time.monotonic()

        def done(outcome: Outcome | SystemException) -> None:  # on a thread of the pool
            if future.done():
                return
            try:
                if isinstance(outcome, NoAnswer):
                    with self._communicator.pool.blocked():
                        # Later calls may have been made meanwhile, which it must not follow unless it stops.
                        stops = self._operation.stop
                        outcome = self._retry(caller, payload, outcome, started, repeatable=stops)
                if isinstance(outcome, SystemException):
                    raise outcome
                ok, answer = outcome
                if not ok:
                    raise self._failure(answer, started + caller.timeout)
                result = finish(answer)
            except BaseException as error:  # noqa: BLE001 - the future raises it
                fail(future, error)
            else:
                with suppress(InvalidStateError):  # cancelled meanwhile
                    future.set_result(result)

        held = [caller.begin(payload, done)]

        def end(ended: Future[Any]) -> None:
            cancel = held.pop()  # which has the future
            if ended.cancelled():
                cancel()

        future.add_done_callback(end)


class StreamedCall(Call[P, V]):
    """A streamed operation of a proxy: call it for the value now, or follow its stream.

    The first use of the stream subscribes; the servant publishes from then on, until the last subscription is
    closed and nobody has asked for a sample for 10 s. The next request subscribes again.
    """

    _reader: StreamReader[V] | None = None

    def latest(self) -> Sample[V] | None:
        """Return the newest sample without a round trip, or None before the first has arrived.

        `value` of the sample is what the call returns, `age` its age in wall seconds. Raises MarshalException
        for a sample that does not fit the operation, InterfaceMismatchException for one of a servant with
        another version of the interface.
        """
        return (self._reader or self._open()).latest()

    def wait(self, after: Sample[V] | None = None, timeout: float | None = None) -> Sample[V]:
        """Return the next sample newer than `after`, or the newest at once without `after`.

        Waits for at most `timeout` s, by default the proxy's limit for calls. Raises TimeoutException;
        ConnectionLostException or ObjectNotExistException when the servant is gone; otherwise as `latest`.
        """
        return (self._reader or self._open()).wait(after, self._patience(timeout))

    def samples(self, timeout: float | None = None, *, rate: float | None = None) -> Samples[V]:
        """Return an iterator over samples, always the newest, for `for` and `async for`.

        With a rate, at most that many per second of wall time, or of virtual time. Waits at most `timeout` s
        for each, by default the proxy's limit for calls; raises as `wait` does. `async for` waits by the
        event loop, always in wall time.
        """
        return Samples(self._reader or self._open(), self._patience(timeout), rate)

    def subscribe(
        self, callback: Callable[[Sample[V]], Any], *, rate: float | None = None, queue: int = 1
    ) -> Subscription[V]:
        """Call a function with each sample, on a separate thread.

        While it runs, at most `queue` samples wait for it, and further ones replace the oldest. With 1 it
        always gets the newest; to miss none, it needs room for as many as arrive while it may be busy. `rate`
        is the maximum number of samples per second.

        It continues after a restart of the server. Exceptions of the function are logged.
        """
        return Subscription(self._reader or self._open(), callback, rate, queue)

    def _patience(self, timeout: float | None) -> float:
        if timeout is None:
            return self._proxy.ice_getInvocationTimeout() / 1000
        if not timeout >= 0.0:
            raise ConfigurationException(f"a wait lasts 0 s or more, not {timeout!r}")
        return min(timeout, threading.TIMEOUT_MAX)

    def _open(self) -> StreamReader[V]:
        self._reader = self._communicator.streams.reader(self._proxy._target, self._operation)
        return self._reader


class Method(Operation[P, V]):
    """An operation that a proxy's class declares; as an attribute of the proxy it is a `Call`."""

    @overload
    def __get__(self, proxy: None, owner: type | None = None) -> Self: ...
    @overload
    def __get__(self, proxy: ObjectPrx, owner: type | None = None) -> Call[P, V]: ...
    def __get__(self, proxy: ObjectPrx | None, owner: type | None = None) -> Self | Call[P, V]:
        """Return the `Call` of the operation; the proxy keeps it from then on."""
        if proxy is None:
            return self
        call = vars(proxy)[self.method] = (StreamedCall if self.streamed else Call)(proxy, self)
        return call

    def __call__(self, proxy: ObjectPrx, *args: P.args, **kwargs: P.kwargs) -> V:
        """Call the operation of a proxy: `PoseHeadPrx.getPose(head)`, as with any method in Python."""
        return self.__get__(proxy)(*args, **kwargs)


class StreamedMethod(Method[P, V]):
    """A method whose results are also published as a stream, under the same name."""

    if TYPE_CHECKING:

        @overload
        def __get__(self, proxy: None, owner: type | None = None) -> Self: ...
        @overload
        def __get__(self, proxy: ObjectPrx, owner: type | None = None) -> StreamedCall[P, V]: ...
        def __get__(self, proxy: ObjectPrx | None, owner: type | None = None) -> Self | StreamedCall[P, V]:
            """Return the `StreamedCall` of the operation."""


def operation(
    **options: Unpack[OperationOptions],
) -> Callable[[Callable[Concatenate[Any, P], V]], Method[P, V]]:
    """Declare an operation by a method of a proxy: its parameters, its results and its docs."""
    return lambda declared: Method(declared, **options)


def stream(
    **options: Unpack[OperationOptions],
) -> Callable[[Callable[Concatenate[Any, P], V]], StreamedMethod[P, V]]:
    """Declare an operation whose results are also published as a stream."""
    return lambda declared: StreamedMethod(declared, streamed=True, **options)


class ObjectPrx(Reference):
    """A proxy: it represents a servant, wherever that runs, and survives the restart of its server.

    Get one from `Communicator.stringToProxy`, and give it a type with `checkedCast` of a generated class.
    Proxies are immutable: methods that would change one return a copy.
    """

    ice_interface: ClassVar[Interface] = OBJECT_INTERFACE

    def __init_subclass__(cls, *, id: str = "", fingerprint: str = "", **options: Any) -> None:  # noqa: ANN401
        """Make the interface that a class declares by its type id and the digest of its canonical form."""
        super().__init_subclass__(**options)
        if id:
            extended = (base.ice_interface for base in cls.__bases__ if issubclass(base, ObjectPrx))
            cls.ice_interface = Interface(
                id,
                bases=tuple(each for each in extended if each is not OBJECT_INTERFACE),
                operations=tuple(each for each in vars(cls).values() if isinstance(each, Operation)),
                fingerprint=fingerprint,
                module=cls.__module__,
            )

    def __init__(self, communicator: Home, target: Target, timeout: float) -> None:
        self._communicator: Final = communicator
        self._target: Final = target
        self._timeout: Final = timeout
        # The line of calls that wait for the servant: none waits behind one with a longer limit.
        self._line: Final = target, timeout

    @classmethod
    def checkedCast(cls, proxy: ObjectPrx) -> Self:
        """Return a proxy of this type after making sure that its servant is present and has the interface.

        Raises ObjectNotExistException when the realm has no such servant, ConnectFailedException when nothing
        answers at the endpoints, ConnectionLostException when the server is lost, and
        InterfaceMismatchException when the servant has another interface or another version of it.
        """
        cast = cls.uncheckedCast(proxy)
        cast._check_interface()
        for operation in cls.ice_interface.all_operations.values():
            _ = operation.arguments, operation.result  # now, so that the first call is as fast as the others
        return cast

    @classmethod
    def uncheckedCast(cls, proxy: ObjectPrx) -> Self:
        """Return a proxy of this type without any check."""
        return cls(proxy._communicator, proxy._target, proxy._timeout)

    # What it refers to.

    def ice_getIdentity(self) -> str:
        """Return the identity of the servant."""
        return self._target.identity

    def ice_getRealm(self) -> str:
        """Return the realm of the servant."""
        return self._target.realm

    def ice_getCommunicator(self) -> Home:
        """Return the communicator of the proxy."""
        return self._communicator

    def ice_toString(self) -> str:
        """Return the proxy as text that `stringToProxy` takes."""
        return self.ice_toWire().removesuffix(f"@{self._communicator.realm}")

    def ice_toWire(self) -> str:
        """Return the proxy as text that means the same in every realm."""
        return f"{self._target.identity}@{self._target.realm}"

    def ice_endSubscriptions(self) -> None:
        """Close all subscriptions of this process to streams of the servant; wait for running callbacks."""
        self._communicator.streams.end_subscriptions(self._target)

    # How it calls.

    def ice_invocationTimeout(self, milliseconds: float) -> Self:
        """Return a copy whose calls end within another limit, in ms as in Ice."""
        seconds = milliseconds / 1000
        if not 0 < seconds <= _LONGEST_TIMEOUT:
            raise ConfigurationException(
                f"a call's limit is above 0 and at most {_LONGEST_TIMEOUT:g} s, not {seconds:g} s"
            )
        return type(self)(self._communicator, self._target, seconds)

    def ice_getInvocationTimeout(self) -> float:
        """Return the limit of calls in ms."""
        return self._timeout * 1000

    # Operations of every servant.

    def ice_ping(self) -> None:
        """Return once the servant has answered."""
        self.ice_invoke(ICE_PING)

    def ice_isA(self, id: str) -> bool:
        """Return whether the servant has the interface of a type id."""
        return self.ice_invoke(ICE_IS_A, id)

    def ice_id(self) -> str:
        """Return the type id of the servant's own interface."""
        return self.ice_invoke(ICE_ID)

    def ice_ids(self) -> list[str]:
        """Return the type ids of all interfaces of the servant."""
        return self.ice_invoke(ICE_IDS)

    def ice_describe(self) -> Schema:
        """Return the servant's own interface, its base interfaces, and every type that they use.

        Raises MarshalException when the answer of the servant is no such description.
        """
        return parse_schema(self.ice_invoke(ICE_DESCRIBE))

    def ice_invoke(self, operation: Operation[P, V], *args: P.args, **kwargs: P.kwargs) -> V:
        """Call an operation and wait for its outcome, as `Call` does."""
        return Call(self, operation)(*args, **kwargs)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ObjectPrx):
            return NotImplemented
        mine, theirs = ((p._communicator, p._target, p._timeout) for p in (self, other))
        return mine == theirs

    def __hash__(self) -> int:
        return hash(self._target)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.ice_toWire()}>"

    def _check_interface(self) -> None:
        wanted = self.ice_interface
        timeout = self._timeout
        started = time.monotonic()
        if wanted is OBJECT_INTERFACE:
            self._communicator.find(self._target, None, timeout)
            return
        found = self._communicator.find(self._target, wanted.type_id, timeout)
        presence = self._communicator.presence
        if presence.has_other_format(self._target):
            other = presence.other_version(self._target, started + timeout - time.monotonic())
            raise InterfaceMismatchException(f"cast of {self._target}: {other}", wanted.fingerprint)
        fingerprint = found.get(wanted.type_id)
        if fingerprint is None:
            raise InterfaceMismatchException(
                f"{self._target} is a {', '.join(sorted(found))}, not a {wanted.type_id}",
                expected=wanted.fingerprint,
            )
        if wanted.fingerprint and fingerprint != wanted.fingerprint:
            difference = _difference(self, started + timeout)
            other = presence.other_version(self._target, started + timeout - time.monotonic())
            raise InterfaceMismatchException.between(
                f"cast of {self._target}",
                wanted.type_id,
                wanted.fingerprint,
                fingerprint,
                difference,
                remedy=other,
            )


def _difference(proxy: ObjectPrx, deadline: float) -> str:
    """Return how the interface of a proxy differs from that of its servant; asks the servant."""
    left = deadline - time.monotonic()
    if left <= 0:
        return "there was no time left to ask the servant for its definition"
    plain = ObjectPrx(proxy._communicator, proxy._target, left)
    try:
        return describe_difference(plain.ice_describe(), proxy.ice_interface)
    except ZenohIceError as error:
        return f"the servant could not be asked for its definition ({error})"


def fail(future: Future[Any], error: BaseException) -> None:
    """Set the exception of a future, unless it already has an outcome."""
    if isinstance(error, ZenohIceError):
        error.__traceback__ = None  # its text tells all, and its frames have the future, which would stay
    with suppress(InvalidStateError):
        future.set_exception(error)
