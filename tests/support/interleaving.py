"""Ask a service of the editor for several things at once, in a random order, also with children of no process."""

from __future__ import annotations

import asyncio
import contextlib
import json
import random
from asyncio import SubprocessProtocol as Protocol
from collections import Counter
from collections.abc import Awaitable, Callable, Iterable, Sequence
from typing import TypeVar, cast

from tests.support.limits import RUN_LIMIT
from visualhfsm._base.errors import VisualHfsmError
from zenoh_ice.application import tether_command

__all__ = ["Nursery", "interleave"]

T = TypeVar("T")

DELAYS = (0.0, 0.0, 0.02)
"""In s: of a turn of the event loop, mostly, or of a thread that reads a file."""


async def interleave(
    chance: random.Random,
    requests: Iterable[Callable[[], Awaitable[object]]],
    delays: Sequence[float] = DELAYS,
) -> None:
    """Ask for all of it, each after a random number of turns; a request may be refused."""

    async def later(request: Callable[[], Awaitable[object]]) -> None:
        for _ in range(chance.randrange(12)):
            await asyncio.sleep(chance.choice(delays))
        with contextlib.suppress(VisualHfsmError):
            await request()

    asked = list(requests)
    chance.shuffle(asked)
    async with asyncio.timeout(RUN_LIMIT):
        await asyncio.gather(*map(later, asked))


class Nursery:
    """Children that are no processes: whatever they do takes a random number of turns of the event loop.

    `role` says of a command what only one of them may do at a time.
    """

    def __init__(self, chance: random.Random, role: Callable[[Sequence[str]], str]) -> None:
        self.chance = chance
        self.role = role
        self.alive: Counter[str] = Counter()
        self.most: Counter[str] = Counter()
        """How many of a role were alive together."""
        self._children: list[_Transport] = []

    async def turns(self) -> None:
        for _ in range(self.chance.randrange(6)):
            await asyncio.sleep(0)

    async def to_thread(self, work: Callable[..., T], *args: object, **kwargs: object) -> T:
        """Stand in for `asyncio.to_thread`."""
        await self.turns()
        result = work(*args, **kwargs)
        await self.turns()
        return result

    async def subprocess_exec(
        self, protocol: Callable[[], Protocol], *command: str, **_: object
    ) -> tuple[_Transport, Protocol]:
        """Stand in for the event loop's `subprocess_exec`, with a child that may end by itself at once."""
        await self.turns()
        child = _Transport(self, self.role(self._own(command)), protocol())
        self._children.append(child)
        self.alive[child.role] += 1
        self.most |= self.alive
        if self.chance.random() < 0.2:
            child.send_signal(0)
        child.protocol.connection_made(cast("asyncio.BaseTransport", child))
        await self.turns()
        return child, child.protocol

    def _own(self, command: Sequence[str]) -> Sequence[str]:
        """Return a command without what ties it to this process."""
        tether = tether_command()
        return command[len(tether) :] if [*command[: len(tether)]] == tether else command

    def killpg(self, pid: int, number: int) -> None:
        """Stand in for `os.killpg`."""
        self._children[pid].send_signal(number)


class _Transport:
    """A child that ends some turns after any signal."""

    def __init__(self, nursery: Nursery, role: str, protocol: Protocol) -> None:
        self.role = role
        self.protocol = protocol
        self._nursery = nursery
        self._pid = len(nursery._children)
        self._end: asyncio.Task[None] | None = None

    def send_signal(self, _number: int) -> None:
        self._end = self._end or asyncio.create_task(self._ends())

    @property
    def is_ending(self) -> bool:
        return self._end is not None

    def get_pipe_transport(self, _: int) -> asyncio.WriteTransport:
        return _Input(self)

    def become(self, command: Sequence[str]) -> None:
        """Be another command, as a process that waited for that."""
        self._nursery.alive[self.role] -= 1
        self.role = self._nursery.role(command)
        self._nursery.alive[self.role] += 1
        self._nursery.most |= self._nursery.alive

    def get_pid(self) -> int:
        return self._pid

    def get_returncode(self) -> int:
        return 0

    def close(self) -> None:
        pass

    async def _ends(self) -> None:
        await self._nursery.turns()
        self._nursery.alive[self.role] -= 1
        self.protocol.process_exited()
        await self._nursery.turns()
        self.protocol.connection_lost(None)


class _Input(asyncio.WriteTransport):
    """What a child that waits is told."""

    def __init__(self, child: _Transport) -> None:
        self._child = child

    def write(self, data: bytes | bytearray | memoryview) -> None:
        self._child.become(["", *json.loads(bytes(data))[0]])

    def is_closing(self) -> bool:
        return self._child.is_ending

    def close(self) -> None:
        pass
