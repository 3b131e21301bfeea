"""Servants, and the dispatch of calls to them in turn."""

from __future__ import annotations

import inspect
import logging
import threading
import time
from abc import ABC
from collections import deque
from collections.abc import Callable
from contextlib import ExitStack, suppress
from functools import cached_property, partial
from typing import Any, ClassVar, Final, Literal, TypeVar

import msgspec

from zenoh_ice.data import exceptions
from zenoh_ice.data.codec import (
    DECODE_ERRORS,
    ENCODE_ERRORS,
    Buffer,
    misfit,
    not_encoded,
    to_msgpack,
    too_large,
)
from zenoh_ice.data.interface import OBJECT_INTERFACE, Interface, Operation
from zenoh_ice.data.keys import Target, servant_token
from zenoh_ice.data.reflection import schema_of
from zenoh_ice.data.status import ServantStatus
from zenoh_ice.data.text import sentence
from zenoh_ice.data.wire import (
    ATTACHMENT_LIMIT,
    NO_ATTACHMENT,
    Attachment,
    decode_attachment,
    encode_error,
    read_attachment,
    unknown_exception,
)
from zenoh_ice.objects.home import Home
from zenoh_ice.objects.proxy import ObjectPrx
from zenoh_ice.objects.streams import Publisher
from zenoh_ice.routes.failing import FailingLink
from zenoh_ice.threads.pool import Job, JobKind
from zenoh_ice.transport import Answer, Ended, Outlet, Registration, Reply

V = TypeVar("V")

_MOST_WAITING: Final = 64  # calls of a servant
_MOST_FROZEN: Final = 1024  # the same, of frozen operations: a flood of others must not keep out a stop
_CONCURRENT_CALLS: Final = 4  # of a servant that lets its calls overlap
_TOKEN_LIMIT: Final = 1.0  # s to wait for the report of our own tokens' end
# Fraction of its limit after which the caller may have given up: the request took some time, too.
_DOUBTFUL: Final = 0.5

_NO_ARGUMENTS: Final = b"\x80"  # an empty map
_TURN: Final = "_ice_turn"

# System exceptions that a servant may raise itself, as in Ice.
_OF_SERVANTS: Final = (exceptions.ObjectNotExistException, exceptions.OperationNotExistException)

_logger = logging.getLogger(__name__)


class Current(msgspec.Struct):  # creating it takes a third of the time of a dataclass
    """The call that a servant serves."""

    identity: str
    """Identity under which the servant was called."""
    operation: str
    """Name of the operation."""
    call_id: str
    """Id of the call, for logs."""
    timeout: float
    """Seconds after which the caller gives up; 0 if unknown."""
    communicator: Home
    """Communicator of the servant."""

    @property
    def client(self) -> str:
        """Id of the calling session, as `onClientLost` reports it; empty when the caller gave none.

        The caller sets it: it helps honest programs, and proves nothing.
        """
        return self.call_id.partition("/")[0]


class Object(ABC):  # noqa: B024 - the abstract methods are those of the generated subclasses
    """The root of servants: the operations that each has besides those of its interface.

    Subclass the generated servant of an interface and implement its operations. Calls of one servant run one
    at a time, on threads of the communicator, unless `ice_concurrent` is set on the class or the servant.
    """

    ice_interface: ClassVar[Interface] = OBJECT_INTERFACE
    ice_concurrent: bool = False
    """Calls of this servant may overlap."""
    ice_urgent: bool = False
    """Its calls, all of them quick, are executed even while the process can start no thread.

    Other calls may be refused then, with BusyException, but no operation marked `["stop"]`.
    """
    ice_frozen: ClassVar[frozenset[str]] = frozenset()
    """Operations that never change, and that callers of every version may call.

    What a caller says of its call is not read: neither another fingerprint nor a limit that has passed, nor
    an unreadable attachment, has such a call refused, and `Current` knows nothing of the caller.
    """

    def __init_subclass__(cls, *, proxy: type[ObjectPrx] | None = None, **options: Any) -> None:  # noqa: ANN401
        super().__init_subclass__(**options)
        if proxy is not None:
            cls.ice_interface = proxy.ice_interface

    def ice_ping(self, current: Current) -> None:  # noqa: B027 - the answer is all it does
        """Do nothing: the answer shows that the servant is present."""

    def ice_isA(self, id: str, current: Current) -> bool:  # noqa: ARG002
        """Return whether the servant has the interface of a type id."""
        return id in self.ice_interface.type_ids

    def ice_id(self, current: Current) -> str:  # noqa: ARG002
        """Return the type id of the servant's own interface."""
        return self.ice_interface.type_id

    def ice_ids(self, current: Current) -> list[str]:  # noqa: ARG002
        """Return the type ids of all interfaces of the servant, sorted."""
        return list(self.ice_interface.type_ids)

    def ice_describe(self, current: Current) -> str:  # noqa: ARG002
        """Return the schema of the servant's interface as JSON, which `ObjectPrx.ice_describe` reads.

        Raises ConfigurationException when codegen did not write one.
        """
        return schema_of(self.ice_interface).as_json()

    def ice_publisher(self, operation: Operation[..., V]) -> Publisher[V]:
        """Return the publisher of a streamed operation; nobody listens before the servant is served."""
        # Servants need not call our constructor, as in Ice, so there is none.
        publishers: dict[str, Publisher[Any]] = self.__dict__.setdefault("_ice_publishers", {})
        return publishers.setdefault(operation.name, Publisher(operation, self.ice_interface.fingerprint))


def publisher(operation: Operation[..., V]) -> cached_property[Publisher[V]]:
    """Return an attribute for servants: the publisher of a streamed operation."""
    return cached_property(lambda servant: servant.ice_publisher(operation))


class _Here(threading.local):
    turns: tuple[_Turn, ...] = ()  # of the servants whose calls this thread runs, the innermost last


_here: Final = _Here()


class _Turn:
    """The running calls of a servant, under all its identities: a limited number; others wait in order."""

    def __init__(self, width: int) -> None:
        self.width: Final = width
        self.lock: Final = threading.Lock()
        self.changed: Final = threading.Condition(self.lock)
        self.running = 0
        self.waiting: deque[_Call] = deque()
        self.waiting_bytes = 0


class _Method(msgspec.Struct, frozen=True, eq=False):
    """An operation of a servant, with what a call of it needs."""

    operation: Operation[..., Any]
    what: str
    function: Callable[..., Any]  # the servant's method
    limit: int  # bytes that the arguments may have
    decode: Callable[[bytes], msgspec.Struct]  # of the arguments; raises MarshalException or DECODE_ERRORS
    make_result: Callable[[Any], msgspec.Struct] | None  # of one value without byte sequences
    fingerprints: frozenset[str] | None  # of the callers' interfaces; None if they do not matter
    frozen: bool  # attachments of its calls do not matter
    stops: bool  # it stops something: such a call is executed even if its caller gave it up
    kind: JobKind


class _Call(msgspec.Struct, eq=False):
    """A received call."""

    served: ServedObject
    method: _Method
    payload: bytes
    about: Attachment
    reply: Reply
    since: float  # the moment of the monotonic clock at which it arrived
    ended: Ended | None = None  # asked before it runs, if it had to wait for its turn


_Stage = Literal["admitted", "executed", "returned"]
"""Stage of a call: a failure means something different in each."""


class ServedObject:
    """A servant under one identity: takes its calls from the transport, and answers each of them."""

    def __init__(self, communicator: Home, target: Target, servant: Object) -> None:
        interface = servant.ice_interface
        self.target: Final = target
        self.servant: Final = servant
        self.fingerprints: Final = {known.type_id: known.fingerprint for known in interface.lineage}
        self._communicator: Final = communicator
        self._interface: Final = interface
        self._accepted: Final = frozenset((*self.fingerprints.values(), ""))
        self._methods: Final[dict[str, _Method]] = {}
        self._refusals: Final = communicator.pool.kind()
        for operation in interface.all_operations.values():
            refusable = not (operation.stop or servant.ice_urgent)
            self._add_method(operation, self._accepted, refusable=refusable)
        for operation in OBJECT_INTERFACE.operations:
            self._add_method(operation, None, refusable=False)
        width = _CONCURRENT_CALLS if servant.ice_concurrent else 1
        self._turn: Final[_Turn] = servant.__dict__.setdefault(_TURN, _Turn(width))
        self._executed = 0
        self._failed = 0
        self._refused = 0
        self._running = 0
        self._withdrawn = False
        self._closed = False
        self._outlets: Final[dict[str, Outlet]] = {}  # of its streams
        self._tokens: Final[list[Registration]] = []
        self._tokens_lock: Final = threading.Lock()
        self._undo: Final = ExitStack()

    # The path of a call.

    def admit(
        self,
        name: str,
        payload: Buffer | None,
        attachment: Buffer | None,
        reply: Reply,
        *,
        gone: bool = False,
        ended: Ended | None = None,
    ) -> Job | None:
        """Give a call its turn, and return the function that executes or refuses it; None if it waits."""
        about, turn = NO_ATTACHMENT, self._turn
        try:
            method = self._methods.get(name)
            # First, whatever refuses this call: those that its client gave up are not to begin after it.
            if attachment is not None:
                if method is None or method.frozen:
                    self._note_given_up(attachment)
                else:
                    if len(attachment) > ATTACHMENT_LIMIT:
                        raise too_large(len(attachment), ATTACHMENT_LIMIT, "attachment")
                    about = read_attachment(bytes(attachment))
                    if about.given_up:
                        self._communicator.given_up.add(about)
            if method is None:
                raise exceptions.OperationNotExistException(
                    f"{self.target.identity}, a {self._interface.type_id}, has no operation {name!r}"
                )
            # The size before anything is copied.
            if payload is not None and len(payload) > method.limit:
                raise too_large(len(payload), method.limit, f"{method.what}: request")
            data = _NO_ARGUMENTS if payload is None else bytes(payload)
            if gone and not method.stops:
                raise _given_up(method)
            call = _Call(self, method, data, about, reply, time.monotonic())
            with turn.lock:
                if self._withdrawn:
                    raise exceptions.ObjectNotExistException(f"{self.target.identity} is no longer served")
                # A servant that calls itself must not wait for its own turn.
                if turn.running >= turn.width and turn not in _here.turns:
                    call.ended = ended
                    self._enqueue(call)
                    return None
                turn.running += 1
                self._running += 1
                self._executed += 1
        except exceptions.ZenohIceError as error:
            return self._refusals, partial(reply, *self._refuse(error))
        except DECODE_ERRORS as error:
            return self._refusals, partial(reply, *self._refuse(misfit(error, "attachment")))
        return method.kind, partial(self._run, call)

    def _arrive(self, *call: Any, **about: Any) -> None:  # noqa: ANN401 - those of `admit`
        """Admit a call that has passed a failing link, and have it executed."""
        if (job := ServedObject.admit(self, *call, **about)) is not None:
            kind, run = job
            self._communicator.pool.submit(run, kind)

    def _run(self, call: _Call, refusal: exceptions.BusyException | None = None) -> None:
        """Execute or refuse, and answer, a call whose turn it is; then let the next one have the turn."""
        # Inlined: in a small call, each further function call would cost more than the work done in it.
        method = call.method
        payload = call.payload
        about = call.about
        reply = call.reply
        operation = method.operation
        timeout = about.timeout
        communicator = self._communicator
        turn = self._turn
        turns = _here.turns
        stage: _Stage = "admitted"
        try:
            if refusal is not None:
                raise exceptions.BusyException(f"{method.what} was not executed: {refusal}")
            client = about.call_id.partition("/")[0]
            if not method.stops and (
                about.sequence in communicator.given_up.numbers.get(client, ())
                or (call.ended is not None and call.ended())
            ):
                raise _given_up(method)
            if method.fingerprints is not None and about.fingerprint not in method.fingerprints:
                own = self._interface
                raise exceptions.InterfaceMismatchException.between(
                    method.what, own.type_id, about.fingerprint, own.fingerprint
                )
            if timeout > 0 and communicator.pool.has_threads:  # else its caller is here, and waits
                now = time.monotonic()
                late = now - call.since >= timeout * _DOUBTFUL
                if late or communicator.pool.pulse.running_since <= now - timeout:
                    _check_patience(call)
            arguments = msgspec.structs.astuple(method.decode(payload))
            stage = "executed"
            current = Current(self.target.identity, operation.name, about.call_id, timeout, communicator)
            watches = communicator.client_watches
            for watch in watches:
                if client not in watch.present:
                    watch.note_call(client)
            _here.turns = (*turns, turn)
            try:
                result = method.function(*arguments, current)
            finally:
                _here.turns = turns
                for watch in watches:  # its client may have ended meanwhile
                    if client not in watch.present:
                        watch.note_call(client)
            stage = "returned"
            if method.make_result is not None:
                reply(True, to_msgpack(method.make_result(result)))
            else:
                reply(True, operation.result.gather_result(result, method.what))
        except BaseException as error:  # noqa: BLE001 - answered; not even CancelledError may end the thread
            reply(*self._failure(error, call, stage))
        finally:
            with turn.lock:
                turn.running -= 1
                self._running -= 1
                if self._withdrawn:
                    turn.changed.notify_all()  # `drain` waits for the end of calls
                following = turn.waiting.popleft() if turn.waiting and turn.running < turn.width else None
                if following is not None:
                    turn.waiting_bytes -= len(following.payload)
                    turn.running += 1
                    following.served._running += 1
                    following.served._executed += 1
            if following is not None:
                communicator.pool.submit(partial(following.served._run, following), following.method.kind)

    def _note_given_up(self, attachment: Buffer) -> None:
        """Note what the attachment of a frozen or an unknown call says of other calls, if it can be read."""
        with suppress(exceptions.MarshalException):
            about = decode_attachment(attachment)
            if about.given_up:
                self._communicator.given_up.add(about)

    def _enqueue(self, call: _Call) -> None:
        """Let a call wait for its turn; raises BusyException when too many do. Needs the turn's lock."""
        turn, size = self._turn, len(call.payload)
        most = _MOST_FROZEN if call.method.frozen else _MOST_WAITING
        full = turn.waiting_bytes + size > self._communicator.limits.waiting_bytes
        if len(turn.waiting) >= most or (turn.waiting and full):
            raise exceptions.BusyException(
                sentence(
                    f"{call.method.what}: {len(turn.waiting)} calls are already waiting; "
                    "this one was not executed"
                )
            )
        turn.waiting.append(call)
        turn.waiting_bytes += size

    # Failures.

    def _refuse(self, error: exceptions.ZenohIceError) -> Answer:
        """Count a call that is not executed, and return the answer that says why."""
        with self._turn.lock:
            self._refused += 1
        return False, encode_error(error)

    def _failure(self, error: BaseException, call: _Call, stage: _Stage) -> Answer:
        """Return the answer to a call that raised an exception at some stage."""
        method = call.method
        if stage == "admitted":
            if isinstance(error, DECODE_ERRORS):
                error = misfit(error, method.what)
            if isinstance(error, exceptions.ZenohIceError):
                with self._turn.lock:
                    self._executed -= 1
                return self._refuse(error)
        declared: tuple[type[exceptions.ZenohIceError], ...] = (*method.operation.exceptions, *_OF_SERVANTS)
        if stage == "executed" and isinstance(error, declared):
            return False, encode_error(error)
        with self._turn.lock:
            self._failed += 1
        if stage == "returned" and isinstance(error, ENCODE_ERRORS):
            error = not_encoded(error, method.what)
        if stage == "returned" and isinstance(error, exceptions.MarshalException):
            error = exceptions.MarshalException(f"result of {error}", error.path)
            _logger.error("%s", error)
            return False, encode_error(error)
        client = call.about.client or "a stranger"
        _logger.error("%s failed, called by %r", method.what, client, exc_info=error)
        return False, encode_error(unknown_exception(error))

    def _add_method(
        self, operation: Operation[..., Any], fingerprints: frozenset[str] | None, *, refusable: bool
    ) -> None:
        # Before the first call: a type that cannot be decoded is to fail at the start of the servant.
        communicator, arguments = self._communicator, operation.arguments
        what = f"{self.target.identity}.{operation.name}"
        frozen = operation.name in self.servant.ice_frozen
        function = getattr(self.servant, operation.method)
        if inspect.iscoroutinefunction(function):
            raise exceptions.ConfigurationException(
                f"{what} is a coroutine: a servant answers a call when its method returns"
            )
        self._methods[operation.name] = _Method(
            operation,
            what,
            function,
            arguments.size_limit,
            arguments.decode or partial(arguments.unpack, what=what, resolve=communicator.stringToProxy),
            operation.result.make_single,
            None if frozen else fingerprints,
            frozen,
            frozen or operation.stop,
            communicator.pool.kind(refusable=refusable and not frozen),
        )

    # Its life.

    @property
    def runs_here(self) -> bool:
        """Return whether the current thread runs a call of the servant."""
        return self._turn in _here.turns

    def open(self) -> None:
        """Accept calls from now on; clients see it after `announce`."""
        communicator, later = self._communicator, self._undo.callback
        for operation in self._interface.all_operations.values():
            if operation.streamed:
                publisher = self.servant.ice_publisher(operation)
                publisher.clock = communicator.transport.clock
                outlet = communicator.transport.publish(self.target, operation)
                later(outlet.close)
                publisher.attach(outlet)
                later(publisher.detach, outlet)
                self._outlets[operation.name] = outlet
        communicator.pool.reserve(self._turn.width)
        later(communicator.pool.reserve, -self._turn.width)
        later(communicator.transport.serve(self.target, self).close)

    def impair(self, link: FailingLink | None) -> None:
        """Let calls and samples pass a link that fails, or pass freely again.

        The link stands in place of methods here, so that nothing is in the way while nothing fails.
        """
        vars(self).pop("admit", None)
        if link is not None:
            vars(self)["admit"] = partial(link.admit, self._arrive)
        for outlet in self._outlets.copy().values():
            vars(outlet).pop("put", None)
            if link is not None:
                vars(outlet)["put"] = partial(link.put, outlet.put)

    def announce(self) -> None:
        """Announce the servant to everybody, unless it was closed."""
        since, communicator = time.time(), self._communicator
        with self._tokens_lock:
            if self._closed or self._tokens:
                return
            # Its own interface last: a client that waits for that one finds the others, too.
            for known in reversed(self._interface.lineage):
                token = servant_token(
                    self.target,
                    known.type_id,
                    known.fingerprint,
                    communicator.client_id,
                    since,
                    address=communicator.transport.local_address,
                )
                self._tokens.append(communicator.transport.announce(token))

    def hide(self) -> None:
        """Withdraw the announcement; calls that arrive are still accepted."""
        with self._tokens_lock, ExitStack() as steps:  # all, the last first, whatever they raise
            while self._tokens:
                steps.callback(self._tokens.pop(0).close)

    def close(self) -> None:
        """Withdraw the announcement, then accept no more calls."""
        with self._tokens_lock:
            self._closed = True
        self._outlets.clear()
        with ExitStack() as steps:  # both, whatever they raise
            steps.callback(self._undo.close)
            steps.callback(self.hide)

    def drain(self, deadline: float) -> None:
        """Wait for running calls, except one of this thread, until a moment of the monotonic clock.

        Calls that still wait for their turn then are not executed.
        """
        turn, left = self._turn, max(0.0, deadline - time.monotonic())
        expected = sum(each is turn for each in _here.turns)

        def ended() -> bool:
            waits = any(call.served is self for call in turn.waiting)
            return self._running <= expected and not waits

        with turn.lock:
            self._withdrawn = True
            done = turn.changed.wait_for(ended, left)
            dropped = [call for call in turn.waiting if call.served is self]
            for call in dropped:
                turn.waiting.remove(call)
                turn.waiting_bytes -= len(call.payload)
        for call in dropped:
            error = exceptions.ObjectNotExistException(f"{self.target.identity} is no longer served")
            call.reply(*self._refuse(error))
        if not done:
            _logger.error("a call of %s still runs", self.target)
        # Our own token must not look like another process's when the identity is added again.
        presence, own = self._communicator.presence, self._communicator.client_id
        presence.wait_until_gone(self.target, left + _TOKEN_LIMIT, own)

    def status(self) -> ServantStatus:
        """Return its load, and the counts of its calls since it was added."""
        with self._turn.lock:
            return ServantStatus(
                type_id=self._interface.type_id,
                calls=self._executed,
                failed=self._failed,
                refused=self._refused,
                running=self._running,
                waiting=sum(call.served is self for call in self._turn.waiting),
                listened=tuple(name for name, outlet in self._outlets.copy().items() if outlet.listening),
            )


def _given_up(method: _Method) -> exceptions.TimeoutException:
    return exceptions.TimeoutException(f"{method.what} was not executed: its caller gave it up")


def _check_patience(call: _Call) -> None:
    """Refuse a call whose caller stopped waiting for it: its command is obsolete.

    How long it was on its way is not known, nor when it came if the process stood still meanwhile. Only where
    that may have been too long, the caller's wall clock is believed, which may be wrong on another machine.
    """
    waited = time.monotonic() - call.since
    waited = waited if waited >= call.about.timeout else time.time() - call.about.wall_time
    if waited >= call.about.timeout:
        raise exceptions.TimeoutException(
            f"{call.method.what} waited {waited:.3g} s for its turn and was not executed"
        )
