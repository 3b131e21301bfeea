"""The transport within one process: for tests, for virtual time, and for a server that nobody joins."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any, Final

from zenoh_ice.carriers._in_process import InProcess, InProcessCalls
from zenoh_ice.data.interface import Operation
from zenoh_ice.data.keys import Target
from zenoh_ice.routes._calls import OwnCalls, Route, RoutedCaller
from zenoh_ice.threads.clock import WALL, Clock
from zenoh_ice.threads.pool import Pool
from zenoh_ice.transport import Caller, Relay

_numbers: Final = itertools.count(1)


class InProcessTransport(InProcess):
    """Join the servants and the proxies of one process, without a network.

    With a pool of no threads, everything happens at once, on the thread that calls or publishes.
    """

    endpoints: Sequence[str] = ()
    token_delay = 0.0
    clock: Clock = WALL
    local_address = ""
    relay: Relay | None = None

    def __init__(self, pool: Pool) -> None:
        super().__init__(pool, f"{next(_numbers):x}")
        self._calls: Final = OwnCalls(self.id)

    def is_near(self, target: Target) -> bool:  # noqa: ARG002
        return True

    def explain_unreachable(self, limit: float) -> str:  # noqa: ARG002
        return ""  # it connects to nobody

    def caller(
        self,
        target: Target,
        operation: Operation[..., Any],
        *,
        timeout: float,
        fingerprint: str | None = None,
    ) -> Caller:
        carrier = InProcessCalls(self, target.key(operation.name), timeout)
        return RoutedCaller(
            self._calls,
            target,
            operation,
            timeout=timeout,
            fingerprint=fingerprint,
            served_here=self.receivers,
            here=carrier,
            route=Route(),
            network=carrier,
        )
