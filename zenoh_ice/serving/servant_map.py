"""The servants of an adapter: which there are, which are served, and which still end."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack
from typing import TYPE_CHECKING, Final

from ..exceptions import AlreadyRegisteredException, CommunicatorDestroyedException
from ..identity import ANY_NAME, Target
from .registration import Registration
from .served import AnyIncoming, AnyServed

if TYPE_CHECKING:
    from ..adapter import ObjectAdapter

__all__ = ["ServantMap", "shown"]

_DRAIN_LIMIT: Final = 1.0  # s for which calls that run may go on when their servants are withdrawn
_TOKEN_LIMIT: Final = 0.5  # s more in which the tokens of these servants go away


class ServantMap:
    """The active servant map: servants by what calls are addressed to, served while it is active."""

    def __init__(self, adapter: ObjectAdapter) -> None:
        self._adapter: Final = adapter
        self._communicator: Final = adapter.getCommunicator()
        self._lock: Final = threading.RLock()
        self._changed: Final = threading.Condition(self._lock)
        self._served: dict[Target, AnyServed] = {}
        self._active: dict[Target, AnyIncoming] | None = None
        self._ending: list[Registration] = []
        self.deactivated = False
        """Whether it was deactivated, and not activated since."""

    def get(self, target: Target) -> AnyServed | None:
        """Return what serves a target, or None."""
        return self._served.get(target)

    def where(self, wanted: Callable[[Target], bool]) -> dict[Target, AnyServed]:
        """Return what serves the targets of which a function is true."""
        with self._lock:
            return {target: served for target, served in self._served.items() if wanted(target)}

    def add(self, target: Target, served: AnyServed) -> None:
        """Serve a target, at once if the map is active; raises AlreadyRegisteredException."""
        with self._lock:
            if target in self._served:
                raise AlreadyRegisteredException(
                    f"adapter {self._adapter.getName()} serves {shown(target)} already"
                )
            if self._active is not None:
                self._active |= self._activate({target: served})
            self._served[target] = served

    def remove(self, targets: Iterable[Target]) -> dict[Target, AnyServed]:
        """Withdraw some targets; return those that were there."""
        with self._lock:
            removed = {target: self._served.pop(target) for target in targets if target in self._served}
            active = self._active or {}
            withdrawn = [active.pop(target) for target in removed if target in active]
        self._withdraw(withdrawn)
        return removed

    def activate(self) -> None:
        """Serve all; raises AlreadyRegisteredException, and serves nothing then."""
        with self._lock:
            if self._active is not None:
                return
            self._active = self._activate(self._served)
            self.deactivated = False

    def deactivate(self) -> None:
        """Withdraw all; does nothing when not active."""
        with self._lock:
            active, self._active = self._active or {}, None
        self._withdraw(active.values())
        with self._changed:
            self.deactivated = self._active is None  # unless somebody activated it meanwhile
            self._changed.notify_all()

    def wait_for_deactivate(self, timeout: float) -> bool:
        """Wait for at most `timeout` s until it was deactivated and all calls ended; return whether so."""
        deadline = time.monotonic() + timeout
        with self._changed:
            if not self._changed.wait_for(lambda: self.deactivated, _left(deadline)):
                return False
        while True:
            with self._lock:
                if not self._ending:
                    return True
                first = self._ending[0]
            if not first.wait_until_idle(_left(deadline)):
                return False
            with self._lock:
                if first in self._ending:
                    self._ending.remove(first)

    def clear(self) -> None:
        """Forget all."""
        with self._lock:
            self._served.clear()

    def _activate(self, wanted: Mapping[Target, AnyServed]) -> dict[Target, AnyIncoming]:
        """Serve some targets, all or none."""
        session = self._communicator.session
        self._communicator.process_status_server.open()
        begun: dict[Target, AnyIncoming] = {}
        try:
            for target, served in wanted.items():
                begun[target] = incoming = self._begin(target, served)
                incoming.activate(session)
            # After all take calls, and at once: who hears of one of them finds the others.
            for incoming in begun.values():
                incoming.announce(session)
        except BaseException:
            self._withdraw(begun.values())
            raise
        return begun

    def _begin(self, target: Target, served: AnyServed) -> AnyIncoming:
        communicator = self._communicator
        if communicator.destroyed:
            raise CommunicatorDestroyedException(
                f"adapter {self._adapter.getName()}: the communicator was destroyed"
            )
        others = communicator.presence.servers(target)
        if others and not (served.replica and all(other.replicated for other in others)):
            raise AlreadyRegisteredException(
                f"another process of realm {target.realm!r} serves {shown(target)} already, and two would "
                "share what is meant for one: stop one, or give it another --realm"
            )
        incoming = served.incoming(self._adapter, target)
        if not communicator.local_servants.add(incoming):
            incoming.drain(0.0)  # ends its threads
            raise AlreadyRegisteredException(
                f"another adapter of this process serves {shown(target)} already"
            )
        return incoming

    def _withdraw(self, servants: Iterable[AnyIncoming]) -> None:
        deadline = time.monotonic() + _DRAIN_LIMIT
        servants = list(servants)
        # Run from the last to the first, each whatever the others raise: first nobody is called any longer,
        # then those that run are waited for, all at once.
        with ExitStack() as steps:
            for incoming in servants:
                steps.callback(self._wait_for, incoming, deadline)
            for incoming in servants:
                self._communicator.local_servants.remove(incoming)
                steps.callback(incoming.withdraw)

    def _wait_for(self, incoming: AnyIncoming, deadline: float) -> None:
        if not incoming.drain(_left(deadline)):
            with self._lock:
                self._ending = [other for other in self._ending if not other.wait_until_idle(0.0)]
                self._ending.append(incoming)
        # Our own token must not look like another process's when the identity is added again.
        communicator = self._communicator
        communicator.presence.wait_until_gone(
            incoming.target, _left(deadline + _TOKEN_LIMIT), communicator.client_id
        )


def shown(target: Target) -> str:
    """Return what a target is to people."""
    category, _, name = target.identity.rpartition("/")
    if name != ANY_NAME:
        return repr(target.object)
    return f"the names of category {category!r}"


def _left(deadline: float) -> float:
    return max(0.0, min(deadline - time.monotonic(), threading.TIMEOUT_MAX))
