"""A link that fails: calls, their answers and samples come late, or never.

What late and lossy mean is `delay` and `loss` of Linux's netem (tc-netem(8)), each way, of whole messages:
beyond a backlog they are lost. The connection itself and the tokens of servants stay, as with a crowded radio
or a hung program, whose machine still answers; a cable that is cut ends them after the lease.
"""

from __future__ import annotations

import heapq
import itertools
import math
import random
import threading
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Final, NamedTuple

from zenoh_ice.data.codec import Buffer, Pieces
from zenoh_ice.data.exceptions import MarshalException
from zenoh_ice.data.wire import decode_attachment
from zenoh_ice.threads.clock import Clock
from zenoh_ice.transport import Ended, Reply

_MOST_WAITING: Final = 10_000
"""Messages that wait; those beyond are lost, as in the queue of netem."""
_RESOLUTION: Final = 1e-6
"""Seconds by which a message may be early."""
_UNKNOWN_LIMIT: Final = 10.0
"""Seconds for which a lost call is kept whose limit is not known."""

_MARGIN: Final = 1.0
"""Seconds for which it is kept after its limit, which is counted elsewhere."""

Admit = Callable[..., object]
Put = Callable[["bytes | Pieces", bytes], object]


class LinkState(NamedTuple):
    """How a link fails."""

    late: float = 0.0
    """By how many s each message is late."""
    lossy: float = 0.0
    """The share of messages that are lost."""
    deaf: bool = False
    """Calls do not arrive."""
    mute: bool = False
    """Answers and samples do not arrive."""
    hung: bool = False
    """The servants take no call, answer none and publish nothing: calls wait until they do again."""


SOUND: Final = LinkState()


class FailingLink:
    """Let messages pass as a link does that fails; thread-safe.

    Time is that of `clock`, chance that of `seed`. Somebody calls `deliver` when messages are `due`;
    `wake` is called whenever that may be earlier.
    """

    def __init__(self, clock: Clock, seed: int, wake: Callable[[], object]) -> None:
        self.state = SOUND
        """How it fails now."""
        self._clock: Final = clock
        self._wake: Final = wake
        self._random: Final = random.Random(seed)
        self._lock: Final = threading.Lock()
        self._numbers: Final = itertools.count()
        self._waiting: list[tuple[float, int, Callable[[], object]]] = []
        self._newest = -math.inf  # when the last message is due: none overtakes another
        self._held: list[
            tuple[float, Callable[[], object]]
        ] = []  # while the servants hang, each with its limit

    @property
    def due(self) -> float:
        """When the next message arrives, on its clock; infinite without any."""
        waiting = self._waiting
        return waiting[0][0] if waiting else math.inf

    def become(self, state: LinkState) -> None:
        """Fail in another way; what was held meanwhile arrives, unless its caller has given it up."""
        now = self._clock.now()
        with self._lock:
            self.state = state
            held, self._held = ([], self._held) if state.hung else (self._held, [])
        for limit, arrive in held:
            if now < limit:
                arrive()

    def deliver(self) -> None:
        """Let all messages arrive that are due."""
        while self.due <= self._clock.now() + _RESOLUTION:
            with self._lock:
                _, _, arrive = heapq.heappop(self._waiting)
            arrive()

    def admit(
        self,
        genuine: Admit,
        name: str,
        payload: Buffer | None,
        attachment: Buffer | None,
        reply: Reply,
        *,
        gone: bool = False,
        ended: Ended | None = None,
    ) -> None:
        """Admit a call when it arrives, in place of a receiver's `admit`; its answer passes the link, too."""
        timeout = 0.0
        with suppress(MarshalException):  # the receiver refuses it
            timeout = decode_attachment(attachment).timeout if attachment is not None else 0.0
        limit = timeout or _UNKNOWN_LIMIT
        kept = limit + _MARGIN

        def answer(ok: bool, result: bytes | Pieces) -> None:
            self._send(partial(reply, ok, result), lost=self.state.mute, kept=kept)

        data = None if payload is None else bytes(payload)  # its memory may not last
        about = None if attachment is None else bytes(attachment)

        def arrive() -> None:
            genuine(name, data, about, answer, gone=gone, ended=ended)

        if self.state.hung:
            with self._lock:
                self._held.append((self._clock.now() + limit, arrive))
        else:
            self._send(arrive, lost=self.state.deaf, kept=kept)

    def put(self, genuine: Put, payload: bytes | Pieces, attachment: bytes) -> None:
        """Send a sample, in place of an outlet's `put`."""
        self._send(partial(genuine, payload, attachment), lost=self.state.mute or self.state.hung)

    def _send(self, arrive: Callable[[], object], *, lost: bool, kept: float = 0.0) -> None:
        """Let a message arrive, now, later or never.

        A lost one is kept for some s: a carrier that saw it dropped would end the call before its limit.
        """
        now = self._clock.now()
        with self._lock:
            lost = lost or self._random.random() < self.state.lossy or len(self._waiting) >= _MOST_WAITING
            due = max(self._newest, now + self.state.late)
            if lost:
                due, arrive = now + kept, partial(id, arrive)  # which keeps it
            else:
                self._newest = due
            if waits := due > now:
                heapq.heappush(self._waiting, (due, next(self._numbers), arrive))
        if waits:
            self._wake()
        else:
            arrive()
