"""Make a server send on a stream, and collect what its clients received."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any, Final

from .processes import Worker

_BEGIN_LIMIT: Final = 10.0


def begin(server: Worker, clients: Sequence[Worker], stream: str, size: tuple[int, int] = (0, 0)) -> None:
    """Make the clients follow a stream, and return when it reaches all of them."""
    for client in clients:
        client.do("follow", stream=stream)
    deadline = time.monotonic() + _BEGIN_LIMIT
    while not all(client.do("heard") for client in clients):
        if time.monotonic() > deadline:
            raise RuntimeError(f"{stream} does not reach {clients[0].name}")
        server.do("send", stream=stream, count=1, size=size)
        time.sleep(0.02)


def streamed(
    server: Worker,
    clients: Sequence[Worker],
    stream: str,
    count: int,
    *,
    rate: float = 0.0,
    size: tuple[int, int] = (0, 0),
) -> list[dict[str, Any]]:
    """Send a number of values; return what each client received, the number sent and the duration."""
    for client in clients:
        client.do("forget")
    sent = server.do("send", stream=stream, count=count, rate=rate, size=size)
    for client in clients:
        client.start("collect", last=sent["last"], limit=10.0)
    return [{**sent, **client.finish()} for client in clients]
