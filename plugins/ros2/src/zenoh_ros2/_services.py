"""The ends of services: their clients, and the services themselves."""

from __future__ import annotations

import contextlib
import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, InvalidStateError
from concurrent.futures import TimeoutError as FutureTimeoutError
from functools import partial
from typing import Any, Final, NamedTuple

import zenoh
from zenoh.handlers import Callback

from zenoh_ice.data.text import encodable, printable, text_of
from zenoh_ice.objects.callbacks import CallFuture

from ._codec import LARGEST_MESSAGE
from ._endpoint import Endpoint, Handler, Owner, attachment_of, bytes_of
from ._graph import Sender
from ._refusals import Refusals
from ._wire import HASHLESS, Attachment, Entity
from ._workers import END_LIMIT, Job, Line, make_pool
from .exceptions import CallError, CallTimeoutError, MessageError, NodeClosedError, RosError

LONGEST_CALL: Final = 24 * 3600.0
"""Limit in s of a call without a given limit, such as waiting for an action's result."""

LARGEST_COMMAND: Final = 64 << 10
"""Maximum bytes of a request unless its service takes larger ones; also fit for topics that command."""

_MOST_REQUESTS: Final = 256  # that wait for one service
_GRACE: Final = 0.5  # s by which a call may end after its limit
_TIMED_OUT: Final = "Timeout"  # Zenoh's own error

_logger = logging.getLogger(__name__)


class _Request(NamedTuple):
    """A request that waits for its turn."""

    query: zenoh.Query
    attachment: Attachment
    data: bytes
    humble: bool


class Client(Endpoint):
    """Calls a service."""

    def __init__(self, node: Owner, entity: Entity) -> None:
        super().__init__(node, entity)
        self._calls: set[Future[Any]] = set()
        self._lock: Final = threading.Lock()
        self._announce()

    @property
    def ready(self) -> bool:
        """Return whether a server is present."""
        return bool(self.others.fitting())

    def wait(self, timeout: float) -> None:
        """Wait until a server is present; raises CallTimeoutError."""
        if not self.node.discovery.wait(lambda: self.ready, timeout):
            raise CallTimeoutError(f"{self.name}: no server within {timeout:g} s")

    def call(self, request: object = None, /, *, timeout: float = 2.0, **fields: object) -> Any:  # noqa: ANN401
        """Call the service and return its response.

        Raises MessageError for a request that does not fit, CallTimeoutError without a response in time,
        and CallError when there is no server, or it fails.
        """
        future = self._start(self.node.receiving.submit, request, timeout, fields)
        try:
            return future.result(timeout + _GRACE)
        except FutureTimeoutError as error:
            raise CallTimeoutError(f"{self.name}: no response within {timeout:g} s") from error

    def call_async(
        self, request: object = None, /, *, timeout: float = LONGEST_CALL, **fields: object
    ) -> Future[Any]:
        """Call the service; return the future of its response, whose callbacks run on the node's threads."""
        return self._start(self.node.workers.submit, request, timeout, fields)

    def _start(
        self, run: Callable[[Job], object], request: object, timeout: float, fields: Mapping[str, object]
    ) -> Future[Any]:
        """Send a request; `run` runs the job that ends its future."""
        self._check_open()
        types = self.node.types
        servers = self.others.fitting()
        humble = bool(servers) and all(each.type_hash == HASHLESS for each in servers)
        data = types.encode(types.coerce(f"{self.type_name}_Request", request, **fields), humble=humble)
        number, attachment = self._attachment()
        deadline = time.monotonic() + timeout
        future: Future[Any] = CallFuture()
        with self._lock:
            self._calls.add(future)
        future.add_done_callback(self._calls.discard)
        replies: deque[zenoh.Reply] = deque(maxlen=1)  # the first response, or else the newest error

        def answered() -> bool:
            return bool(replies) and replies[0].ok is not None

        def receive(reply: zenoh.Reply) -> None:
            if not answered():
                replies.append(reply)
                if answered():
                    run(end)  # another server of the service may be slow, or silent

        def end() -> None:
            try:
                response = (
                    self._response(replies[0], number, humble) if replies else self._no_response(deadline)
                )
            except RosError as error:
                fail(future, error)
            else:
                with contextlib.suppress(InvalidStateError):  # closing ended it
                    future.set_result(response)

        handler = Callback(receive, lambda: None if answered() else run(end), indirect=False)
        try:
            self.node.session.get(
                self._keys[humble],
                handler,
                target=zenoh.QueryTarget.ALL_COMPLETE,
                consolidation=zenoh.ConsolidationMode.NONE,
                payload=data,
                attachment=attachment,
                timeout=timeout,
            )
        except zenoh.ZError as error:
            fail(future, CallError(f"{self.name}: {error}"))
        return future

    def _response(self, reply: zenoh.Reply, number: int, humble: bool) -> Any:  # noqa: ANN401
        if reply.ok is None:
            why = reply.err.payload.to_bytes().decode(errors="replace") if reply.err else ""
            if why == _TIMED_OUT:
                raise CallTimeoutError(f"{self.name}: no response in time")
            raise CallError(f"{self.name}: {printable(why)[:500]}")
        answered = attachment_of(reply.ok.attachment)
        if answered is None or (answered.sequence, answered.gid) != (number, self._gid):
            raise CallError(f"{self.name}: a response came that belongs to another request")
        name = f"{self.type_name}_Response"
        data = bytes_of(reply.ok.payload, LARGEST_MESSAGE, name)
        return self.node.types.decode(data, name, humble=humble)

    def _no_response(self, deadline: float) -> Any:  # noqa: ANN401
        if time.monotonic() >= deadline:
            raise CallTimeoutError(f"{self.name}: no response in time")
        there = "its server was lost, or does not answer" if self.ready else "there is no server"
        raise CallError(f"{self.name}: {there}")

    def close(self) -> None:
        """Stop; pending calls fail."""
        super().close()
        with self._lock:
            calls = [*self._calls]
        for each in calls:
            fail(each, NodeClosedError(f"{self.name}: it was closed during the call"))


class Service(Endpoint):
    """Serves a service."""

    def __init__(
        self,
        node: Owner,
        entity: Entity,
        handler: Handler,
        largest: int = LARGEST_COMMAND,
        *,
        urgent: bool = False,
        with_sender: bool = False,
    ) -> None:
        super().__init__(node, entity)
        self._handler: Final = handler
        self._with_sender: Final = with_sender
        self._largest: Final = min(largest, node.types.largest(f"{entity.type_name}_Request"))
        self._refusals: Final = Refusals(self.name, "a malformed request is refused")
        self._own: Final = make_pool(1, f"{self.name} callbacks") if urgent else None
        self._line: Final = Line(self.name, self._own or node.workers, _MOST_REQUESTS, self._handle)
        for humble, key in self._keys.items():
            receive = Callback(partial(self._receive, humble), indirect=False)
            self._declared.append(node.session.declare_queryable(key, receive, complete=True))
        self._announce()

    @property
    def malformed(self) -> int:
        """Return the number of requests refused because they did not follow their type."""
        return self._refusals.count

    @contextlib.contextmanager
    def seen_from_outside(self) -> Iterator[Callable[[], bool]]:
        """Yield a function that says whether the node's separate session for discovery reaches the service.

        A router may keep others from it without a word. Nothing is called.
        """
        session: Any = self.node.discovery.session  # the annotations of queriers are wrong
        querier = session.declare_querier(self._keys[False])
        try:
            yield lambda: bool(querier.matching_status.matching)
        finally:
            querier.undeclare()

    def close(self) -> None:
        """Stop serving."""
        super().close()
        if self._own is not None:
            self._own.close(END_LIMIT)

    def _receive(self, humble: bool, query: zenoh.Query) -> None:
        """Take a request from Zenoh's thread."""
        attachment = attachment_of(query.attachment)
        try:
            if attachment is None or query.payload is None:
                raise MessageError("a request has a payload, and an attachment of 33 bytes")
            data = bytes_of(query.payload, self._largest, f"{self.type_name}_Request")
        except MessageError as error:
            self._reject(query, error)
            return
        dropped = self._line.put(_Request(query, attachment, data, humble))
        if dropped is not None:
            self._refuse(dropped.query, f"more than {_MOST_REQUESTS} requests wait")

    def _reject(self, query: zenoh.Query, error: RosError) -> None:
        self._refusals.add(error)
        self._refuse(query, str(error))

    def _refuse(self, query: zenoh.Query, why: str) -> None:
        try:
            query.reply_err(encodable(why).encode())
        except zenoh.ZError as error:  # the client is gone
            _logger.debug("%s: %s", self.name, error)
        finally:
            query.drop()

    def _handle(self, request: _Request) -> None:
        """Decode a request, run its handler, and answer now or when its future is done."""
        try:
            message = self.node.types.decode(request.data, f"{self.type_name}_Request", humble=request.humble)
        except RosError as error:
            self._reject(request.query, error)
            return
        try:
            given: tuple[object, ...] = (message,)
            if self._with_sender:
                given = (message, Sender(self.others, request.attachment.gid))
            response = self._handler(*given)
        except BaseException as error:  # noqa: BLE001 - logged, and answered
            self._fail(request, error)
            return
        if isinstance(response, Future):
            response.add_done_callback(lambda done: self._answer_future(request, done))
        else:
            self._answer(request, response)

    def _answer_future(self, request: _Request, done: Future[Any]) -> None:
        if done.cancelled():
            self._refuse(request.query, "it was cancelled")
        elif (error := done.exception()) is not None:
            self._fail(request, error)
        else:
            self._answer(request, done.result())

    def _fail(self, request: _Request, error: BaseException) -> None:
        """Log what a handler raised, and refuse its request: not even SystemExit leaves a client waiting."""
        _logger.error("%s: its handler failed", self.name, exc_info=error)
        self._refuse(request.query, f"the handler failed: {type(error).__name__}: {text_of(error)}")

    def _answer(self, request: _Request, response: object) -> None:
        name = f"{self.type_name}_Response"
        try:
            data = self.node.types.encode(self.node.types.coerce(name, response), humble=request.humble)
        except MessageError as error:
            _logger.error("%s: its handler returned what is no response: %s", self.name, error)
            self._refuse(request.query, str(error))
            return
        except BaseException as error:  # noqa: BLE001 - a response may be an object of user code
            self._fail(request, error)
            return
        asked = request.attachment
        try:
            attachment = Attachment(asked.sequence, time.time_ns(), asked.gid).encode()
            request.query.reply(self._keys[request.humble], data, attachment=attachment)
        except zenoh.ZError as error:  # the client is gone
            _logger.debug("%s: %s", self.name, error)
        finally:
            request.query.drop()


def fail(future: Future[Any], error: Exception) -> None:
    """End a future with an error, unless it has ended."""
    with contextlib.suppress(InvalidStateError):
        future.set_exception(error)
