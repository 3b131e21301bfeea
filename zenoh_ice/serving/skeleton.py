"""A servant made ready for calls: its operations with its methods, and whose turn it is."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import msgspec

from ..exceptions import InterfaceMismatchException, OperationNotExistException
from ..object import OBJECT_INTERFACE, Object
from ..operation import Operation

if TYPE_CHECKING:
    from ..communicator import Communicator
    from ..dispatch import Dispatcher

__all__ = ["Method", "Skeleton", "running", "runs_a_call"]

_CONCURRENT_CALLS: Final = 4  # of a servant that lets its calls overlap
_TURN: Final = "_ice_turn"


@dataclass(frozen=True, slots=True)
class Method:
    """An operation of a servant, with what a call of it needs."""

    operation: Operation[..., Any]
    servant: Object
    function: Callable[..., Any]
    """The servant's method."""
    limit: int
    """How many bytes the arguments may have."""
    decode: Callable[[bytes], msgspec.Struct]
    """Returns arguments that came; raises one of DECODE_ERRORS."""
    fingerprints: frozenset[str] | None
    """Of the interfaces from which callers may be generated; None for what every servant has."""

    def mismatch(self, fingerprint: str, what: str) -> InterfaceMismatchException:
        """Return what tells a caller that it was generated from another interface."""
        own = self.servant.ice_interface
        return InterfaceMismatchException(
            f"{what}: the caller was generated from {fingerprint}, the servant {own.type_id} from "
            f"{own.fingerprint}; generate both from the same IDL",
            expected=fingerprint,
            found=own.fingerprint,
        )


class Running(threading.local):
    """What the current thread is doing."""

    def __init__(self) -> None:
        self.servants: list[Object] = []
        """The servants whose calls it runs, the innermost last."""


running: Final = Running()


def runs_a_call() -> bool:
    """Return whether the current thread runs a call of any servant."""
    return bool(running.servants)


class Skeleton:
    """The operations of a servant, its own and those that every servant has."""

    def __init__(self, communicator: Communicator, servant: Object) -> None:
        self.servant: Final = servant
        self.interface: Final = servant.ice_interface
        self.fingerprints: Final = {known.type_id: known.fingerprint for known in self.interface.lineage}
        self._communicator: Final = communicator
        self._accepted: Final = frozenset((*self.fingerprints.values(), ""))
        self._methods: Final[dict[str, Method]] = {}  # those that were called
        self.width: Final = _CONCURRENT_CALLS if servant.ice_concurrent else 1
        # The servant's own: it may be served under several identities and facets.
        self._lock: Final[threading.Lock | None] = (
            None if servant.ice_concurrent else servant.__dict__.setdefault(_TURN, threading.Lock())
        )
        self.turn: Final[AbstractContextManager[object]] = self._lock or nullcontext()

    @property
    def runs_here(self) -> bool:
        """Whether the current thread runs a call of the servant: it must not wait for its own turn."""
        return any(servant is self.servant for servant in running.servants)

    @contextmanager
    def turn_in_pool(self, dispatcher: Dispatcher) -> Iterator[None]:
        """Wait for the turn on a thread of a pool, which has one more meanwhile.

        A servant that calls itself has it already.
        """
        lock = self._lock
        if lock is None or self.runs_here:
            yield
            return
        if not lock.acquire(blocking=False):
            with dispatcher.blocked():
                lock.acquire()
        try:
            yield
        finally:
            lock.release()

    def method(self, name: str, owner: str) -> Method:
        """Return an operation by name; raises OperationNotExistException, which names the owner."""
        return self._methods.get(name) or self._prepare(name, owner)

    def _prepare(self, name: str, owner: str) -> Method:
        of_every_servant = OBJECT_INTERFACE.all_operations.get(name)
        operation = of_every_servant or self.interface.all_operations.get(name)
        if operation is None:
            raise OperationNotExistException(
                f"{owner}, a {self.interface.type_id}, has no operation {name!r}"
            )
        arguments = operation.arguments
        method = self._methods[name] = Method(
            operation,
            self.servant,
            getattr(self.servant, operation.method),
            self._communicator.size_limit(arguments),
            arguments.decoder(self._communicator),
            self._accepted if of_every_servant is None else None,
        )
        return method
