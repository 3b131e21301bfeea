"""The cost of a call in Zenoh itself: a queryable, a querier with the same options as ours, MessagePack."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import msgpack
import zenoh

from .content import POSE
from .interface import IDENTITY, REALM, load_generated

_KEY: Final = "bench/step"


class BareClient:
    """A querier."""

    def __init__(self, querier: zenoh.Querier, arguments: object, attachment: bytes | None = None) -> None:
        self._get = querier.get
        self._arguments = arguments
        self._attachment = attachment

    def step(self) -> object:
        """Call with four doubles there and back."""
        answer = self._get(payload=msgpack.packb(self._arguments), attachment=self._attachment).recv().ok
        if answer is None:
            raise RuntimeError("no answer")
        return msgpack.unpackb(answer.payload.to_bytes())


@contextmanager
def serve(endpoint: str) -> Iterator[None]:
    """Serve on an endpoint."""

    def step(query: zenoh.Query) -> None:
        with query:
            angles = msgpack.unpackb(query.payload.to_bytes() if query.payload else b"")
            query.reply(query.key_expr, msgpack.packb(angles))

    with _open(listen=endpoint) as session:
        queryable = session.declare_queryable(_KEY, step)
        yield
        queryable.undeclare()


@contextmanager
def connect(endpoint: str) -> Iterator[BareClient]:
    """Connect to a server."""
    with _open(connect=endpoint) as session, _querier(session, _KEY) as querier:
        yield BareClient(querier, POSE)


@contextmanager
def connect_to_ours(endpoint: str, package: Path) -> Iterator[BareClient]:
    """Connect to a servant of ours, and call it as its proxy would."""
    from zenoh_ice._wire import encode_call_attachment

    fingerprint = load_generated(package).Robot.ice_interface.fingerprint
    attachment = encode_call_attachment(fingerprint, 1, "", 2.0)
    arguments = {"angles": dict(zip("abcd", POSE, strict=True))}
    with _open(connect=endpoint) as session, _querier(session, f"{REALM}/{IDENTITY}/step") as querier:
        yield BareClient(querier, arguments, attachment)


@contextmanager
def _querier(session: zenoh.Session, key: str) -> Iterator[zenoh.Querier]:
    querier = session.declare_querier(
        key,
        timeout=2.0,
        consolidation=zenoh.ConsolidationMode.NONE,
        congestion_control=zenoh.CongestionControl.BLOCK,
        priority=zenoh.Priority.INTERACTIVE_HIGH,
    )
    yield querier
    querier.undeclare()


def _open(listen: str = "tcp/127.0.0.1:0", connect: str | None = None) -> zenoh.Session:
    config = zenoh.Config()
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("listen/endpoints", json.dumps([listen]))
    config.insert_json5("connect/endpoints", json.dumps([connect] if connect else []))
    return zenoh.open(config)
