"""A foreign process on the network that sends anything over Zenoh."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import zenoh

from tests.support.limits import CALL_LIMIT, EVENT_LIMIT
from zenoh_ice import Communicator
from zenoh_ice.data.keys import Target, servant_token
from zenoh_ice.routes._transport import ZenohTransport

__all__ = ["Stranger", "session_of", "stranger"]


class Stranger:
    """A Zenoh session that follows none of our rules."""

    def __init__(self, session: zenoh.Session) -> None:
        self.session = session
        self.id = str(session.zid())

    def ask(self, selector: str, payload: bytes | None, attachment: bytes | None) -> list[zenoh.Reply]:
        """Send a query and return all answers."""
        return list(self.begin_to_ask(selector, payload, attachment))

    def begin_to_ask(
        self, selector: str, payload: bytes | None, attachment: bytes | None
    ) -> zenoh.Handler[zenoh.Reply]:
        """Send a query and return the handler of its answers."""
        return self.session.get(
            selector,
            payload=payload,
            attachment=attachment,
            timeout=CALL_LIMIT,
            consolidation=zenoh.ConsolidationMode.NONE,
        )

    @contextmanager
    def impersonating(
        self,
        target: Target,
        type_id: str,
        fingerprint: str,
        answer: Callable[[zenoh.Query], Any],
        *,
        address: str = "",
    ) -> Iterator[None]:
        """Pretend to be a servant during the block, at an address."""
        queryable: zenoh.Queryable[None] = self.session.declare_queryable(target.key("*"), answer)
        token = self.session.liveliness().declare_token(
            servant_token(target, type_id, fingerprint, self.id, 1.0, address=address)
        )
        try:
            yield
        finally:
            token.undeclare()
            queryable.undeclare()

    @contextmanager
    def declared(self, token: str) -> Iterator[None]:
        """Declare a token during the block."""
        declared = self.session.liveliness().declare_token(token)
        try:
            yield
        finally:
            declared.undeclare()

    def wait_for_reader(self, publisher: zenoh.Publisher) -> None:
        """Wait until a publisher has subscribers."""
        changed = threading.Event()
        listener = publisher.declare_matching_listener(
            lambda status: changed.set() if status.matching else None
        )
        if not publisher.matching_status.matching:  # type: ignore[attr-defined]
            assert changed.wait(EVENT_LIMIT)
        listener.undeclare()


def session_of(communicator: Communicator) -> zenoh.Session:
    """Return the session of a communicator, to break our rules."""
    transport = communicator.transport
    assert isinstance(transport, ZenohTransport)
    return transport.session


@contextmanager
def stranger(endpoint: str) -> Iterator[Stranger]:
    """Open the session of a stranger that is linked to an endpoint."""
    config = zenoh.Config()
    for key, value in {
        "mode": "peer",
        "scouting/multicast/enabled": False,
        "connect/endpoints": [endpoint],
        "listen/endpoints": ["tcp/127.0.0.1:0"],
    }.items():
        config.insert_json5(key, json.dumps(value))
    with zenoh.open(config) as session:
        yield Stranger(session)
