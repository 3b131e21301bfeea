"""What the proxies of a communicator share for their calls."""

from __future__ import annotations

import itertools
import secrets
import threading
from collections import deque
from typing import TYPE_CHECKING, Any, Final
from weakref import WeakSet, WeakValueDictionary

import zenoh

from ..dispatch import Lane
from ..exceptions import CommunicatorDestroyedException, ConnectionLostException, SystemException
from ..identity import Target
from ..operation import Interface, Operation
from .implicit_context import ImplicitContext
from .invocation import InvocationFuture, fail
from .manner import Manner, Mode
from .oneway import OnewayBatch, OnewayCall
from .outgoing import OutgoingCall
from .receiver import Receiver
from .searches import Searches

if TYPE_CHECKING:
    from ..communicator import Communicator

__all__ = ["AnyCall", "OutgoingCalls"]

AnyCall = OutgoingCall | OnewayCall
_Key = tuple[Target, Operation[..., Any], Interface, Manner]

_MAX_UNSENT: Final = 1024  # calls of one servant that wait to be sent
# Calls that are kept for the next proxy, even when no proxy has them any longer: each holds a querier.
_MOST_KEPT: Final = 256
_RECEIVER_LIMIT: Final = 2.0  # s in which the threads of the receiver end


class OutgoingCalls:
    """The calls that are ready to be made, those that run, and what they all tell their servants."""

    def __init__(self, communicator: Communicator) -> None:
        self._communicator: Final = communicator
        # Numbers do not begin anew when a session does that by chance has the id of another one.
        self.numbers: Final = itertools.count(secrets.randbits(32))
        self.implicit_context: Final = ImplicitContext()
        self.receiver: Final = Receiver(f"zenoh_ice {communicator.realm}", communicator.dispatcher)
        self._lock: Final = threading.Lock()
        self._calls: WeakValueDictionary[_Key, AnyCall] = WeakValueDictionary()
        self._kept: deque[AnyCall] = deque(maxlen=_MOST_KEPT)
        self._lanes: WeakValueDictionary[Target, Lane] = WeakValueDictionary()
        self.searches: Final = Searches(communicator.dispatcher)
        self._futures: set[InvocationFuture[Any]] = set()
        self._batches: WeakSet[OnewayBatch] = WeakSet()

    def get(
        self, target: Target, operation: Operation[..., Any], interface: Interface, manner: Manner
    ) -> AnyCall:
        """Return what calls an operation of a servant; proxies share it."""
        key = (target, operation, interface, manner)
        with self._lock:
            call = self._calls.get(key)
        if call is None:
            kind = OutgoingCall if manner.mode is Mode.TWOWAY else OnewayCall
            try:
                made = kind(self._communicator, *key)
            except zenoh.ZError as error:
                self._communicator.check()  # the session is closed meanwhile
                raise ConnectionLostException(f"{target.object}.{operation.name}: {error}") from error
            with self._lock:
                call = self._calls.setdefault(key, made)
                self._kept.append(call)
        return call

    def sending_lane(self, target: Target) -> Lane:
        """Return the lane in which calls of a servant are sent that must not be sent by their callers."""
        with self._lock:
            lane = self._lanes.get(target)
            if lane is None:
                dispatcher = self._communicator.dispatcher
                lane = Lane(dispatcher, f"sending to {target}", depth=_MAX_UNSENT)
                self._lanes[target] = lane
            return lane

    def new_future(self) -> InvocationFuture[Any]:
        """Return a future that has an outcome at the latest when the communicator is destroyed."""
        future: InvocationFuture[Any] = InvocationFuture(self.receiver)
        self._futures.add(future)
        future.add_done_callback(self._futures.discard)
        return future

    def new_batch(self) -> OnewayBatch:
        """Return a batch that `flush_batches` flushes."""
        batch = OnewayBatch()
        with self._lock:
            self._batches.add(batch)
        return batch

    def flush_batches(self) -> None:
        """Send what all batches hold; an error that says that a call cannot arrive comes after the others."""
        with self._lock:
            batches = list(self._batches)
        errors: list[SystemException] = []
        for batch in batches:
            try:
                batch.flush()
            except SystemException as error:
                errors.append(error)
        if errors:
            raise errors[0]

    def close(self) -> None:
        """Fail what has no outcome yet, after the session was closed."""
        self.receiver.close(_RECEIVER_LIMIT)
        for future in tuple(self._futures):
            fail(future, CommunicatorDestroyedException("the communicator was destroyed during the call"))
