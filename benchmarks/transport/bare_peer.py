"""What Zenoh itself takes for a call: a queryable, a querier with the options that ours have, MessagePack."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final

import msgpack
import zenoh

from .content import POSE

_KEY: Final = "bench/step"


class BareServer:
    """A queryable; nothing is streamed."""

    def send(self, stream: str, stamp: int, number: int, content: Any) -> None:  # noqa: ANN401
        """Refuse: streams are not measured without zenoh_ice."""
        raise NotImplementedError(stream)


class BareClient:
    """A querier."""

    def __init__(self, querier: zenoh.Querier) -> None:
        self._get = querier.get

    def step(self) -> object:
        """Call with four doubles there and back."""
        answer = self._get(payload=msgpack.packb(POSE)).recv().ok
        if answer is None:
            raise RuntimeError("no answer")
        return msgpack.unpackb(answer.payload.to_bytes())


@contextmanager
def serve(endpoint: str) -> Iterator[BareServer]:
    """Serve on an endpoint."""

    def step(query: zenoh.Query) -> None:
        with query:
            angles = msgpack.unpackb(query.payload.to_bytes() if query.payload else b"")
            query.reply(query.key_expr, msgpack.packb(angles))

    with _open(listen=endpoint) as session:
        queryable = session.declare_queryable(_KEY, step)
        yield BareServer()
        queryable.undeclare()


@contextmanager
def connect(endpoint: str) -> Iterator[BareClient]:
    """Connect to a server."""
    with _open(connect=endpoint) as session:
        querier = session.declare_querier(
            _KEY,
            timeout=2.0,
            consolidation=zenoh.ConsolidationMode.NONE,
            congestion_control=zenoh.CongestionControl.BLOCK,
            priority=zenoh.Priority.INTERACTIVE_HIGH,
        )
        yield BareClient(querier)
        querier.undeclare()


def _open(listen: str = "tcp/127.0.0.1:0", connect: str | None = None) -> zenoh.Session:
    config = zenoh.Config()
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("listen/endpoints", json.dumps([listen]))
    config.insert_json5("connect/endpoints", json.dumps([connect] if connect else []))
    return zenoh.open(config)
