"""A servant made ready for calls: its operations with its methods, and whose turn it is."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import TYPE_CHECKING, Any, Final

from ..exceptions import InterfaceMismatchException, OperationNotExistException
from ..object import OBJECT_INTERFACE, Object
from ..operation import Operation

if TYPE_CHECKING:
    from ..communicator import Communicator
    from ..dispatch import Dispatcher

__all__ = ["Method", "Skeleton", "runs_a_call"]

_CONCURRENT_CALLS: Final = 4  # of a servant that lets its calls overlap
_TURN: Final = "_ice_turn"

Method = tuple[Operation[..., Any], Callable[..., Any], int]
"""An operation, the servant's method, and how many bytes its arguments may have."""


class _Running(threading.local):
    """What the current thread is doing."""

    def __init__(self) -> None:
        self.servants: list[Object] = []
        """The servants whose calls it runs, the innermost last."""


_running: Final = _Running()


def runs_a_call() -> bool:
    """Return whether the current thread runs a call of any servant."""
    return bool(_running.servants)


class Skeleton:
    """The operations of a servant, its own and those that every servant has."""

    def __init__(self, communicator: Communicator, servant: Object) -> None:
        self.servant: Final = servant
        self.interface: Final = servant.ice_interface
        self.fingerprints: Final = {known.type_id: known.fingerprint for known in self.interface.lineage}
        self._accepted: Final = frozenset((*self.fingerprints.values(), ""))
        self.methods: Final[dict[str, Method]] = {
            name: (
                operation,
                getattr(servant, operation.method),
                communicator.size_limit(operation.arguments),
            )
            for name, operation in {
                **self.interface.all_operations,
                **OBJECT_INTERFACE.all_operations,
            }.items()
        }
        self.width: Final = _CONCURRENT_CALLS if servant.ice_concurrent else 1
        # The servant's own: it may be served under several identities and facets.
        self._lock: Final[threading.Lock | None] = (
            None if servant.ice_concurrent else servant.__dict__.setdefault(_TURN, threading.Lock())
        )
        self.turn: Final[AbstractContextManager[object]] = self._lock or nullcontext()

    @property
    def runs_here(self) -> bool:
        """Whether the current thread runs a call of the servant: it must not wait for its own turn."""
        return any(servant is self.servant for servant in _running.servants)

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

    @property
    def running_here(self) -> list[Object]:
        """The servants whose calls the current thread runs, the innermost last."""
        return _running.servants

    def method(self, name: str, owner: str) -> Method:
        """Return an operation by name; raises OperationNotExistException, which names the owner."""
        try:
            return self.methods[name]
        except KeyError:
            raise OperationNotExistException(
                f"{owner}, a {self.interface.type_id}, has no operation {name!r}"
            ) from None

    def check_fingerprint(self, fingerprint: str, operation: Operation[..., Any], what: str) -> None:
        """Raise InterfaceMismatchException when a caller was generated from another interface."""
        if fingerprint not in self._accepted and operation.name not in OBJECT_INTERFACE.all_operations:
            own = self.interface
            raise InterfaceMismatchException(
                f"{what}: the caller was generated from {fingerprint}, the servant {own.type_id} from "
                f"{own.fingerprint}; generate both from the same IDL",
                expected=fingerprint,
                found=own.fingerprint,
            )
