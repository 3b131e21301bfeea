"""Malformed messages do not reach a callback, harm nothing, and each is counted and named.

The bytes alone, of every type, are in unit/test_messages_recorded.py.
"""

from __future__ import annotations

import logging
import random
import struct
import threading
from collections.abc import Iterator
from typing import Any

import pytest
import zenoh

from tests.support.limits import FOREVER
from tests.support.malformed_cdr import malformed
from tests.support.processes import free_endpoint
from tests.support.soak import repeated
from tests.support.waiting import until
from zenoh_ice import Settings
from zenoh_ice.carriers.zenoh.session import close_session, open_session
from zenoh_ros2 import MessageError, Node, QoS

MANY = repeated(1_000, soak=5_000)
BURST = 500  # read before the next is sent: Zenoh closes a link that a slow reader blocks for 2 s
LASER = "sensor_msgs/msg/LaserScan"


@pytest.fixture
def stranger() -> Iterator[tuple[zenoh.Session, Node]]:
    """A session that sends what it likes, and a node."""
    endpoint = free_endpoint()
    session = open_session(Settings(mode="peer", listen=(endpoint,), connect=()))
    try:
        with Node("reader", domain=3, settings=Settings(connect=(endpoint,))) as node:
            yield session, node
    finally:
        close_session(session)


def key_of(node: Node, name: str, type_name: str) -> str:
    package, kind, short = type_name.split("/")
    return f"3/{name}/{package}::{kind}::dds_::{short}_/{node.types.hash(type_name)}"


def attachment(number: int) -> bytes:
    return struct.pack("<qqB", number, 1_700_000_000_000_000_000, 16) + bytes(16)


@pytest.mark.slow
def test_many_malformed_messages_are_counted_and_named(
    stranger: tuple[zenoh.Session, Node], caplog: pytest.LogCaptureFixture
) -> None:
    session, node = stranger
    chance, received = random.Random(4), []
    marks = threading.Semaphore(0)

    def receive(message: Any) -> None:
        received.append(message)
        if message.header.frame_id == "mark":
            marks.release()

    subscription = node.create_subscription(LASER, "/scan", receive, QoS(keep_all=True))
    publisher: Any = session.declare_publisher(
        key_of(node, "scan", LASER), congestion_control=zenoh.CongestionControl.BLOCK
    )
    until(lambda: publisher.matching_status.matching)
    scan = node.types.make(LASER, header={"frame_id": "laser"}, ranges=[1.0, 2.0, 3.0], angle_max=1.5)
    valid = node.types.encode(scan)
    mark = node.types.encode(node.types.make(LASER, header={"frame_id": "mark"}))
    refused = {"payload": 0, "attachment": 0}
    with caplog.at_level(logging.WARNING):
        for number in range(MANY):
            data, whole = malformed(valid, chance), attachment(number)
            extra: bytes | None = whole
            if number % 10 == 0:
                extra = whole[: chance.randrange(len(whole))] if number % 50 else None
                refused["attachment"] += 1
            else:
                refused["payload"] += not decodes(node, data)
            publisher.put(data, attachment=extra)
            if number % BURST == BURST - 1:
                publisher.put(mark, attachment=attachment(number))
                assert marks.acquire(timeout=FOREVER)
    assert subscription.malformed == sum(refused.values())
    assert refused["payload"] > MANY // 3
    assert all(type(each) is node.types[LASER] for each in received)
    warnings = [each.getMessage() for each in caplog.records if "/scan" in each.getMessage()]
    assert any(LASER in each for each in warnings)
    assert len(warnings) < 20, "a sender of rubbish fills no disk"


def test_malformed_requests_are_refused_by_name(stranger: tuple[zenoh.Session, Node]) -> None:
    session, node = stranger
    called: list[Any] = []

    def switch(request: Any) -> dict[str, Any]:
        called.append(request)
        return {"success": True}

    name = "std_srvs/srv/SetBool"
    service = node.create_service(name, "/switch", switch)
    key = key_of(node, "switch", name)
    until(lambda: ask(session, key, b"\0\1\0\0\1", attachment(0)) == (True, ""))
    called.clear()
    malformed_ones = (b"", b"\0\1\0\0", b"\0\1\0\0" + b"\1" * 9, b"\0\7\0\0\1", bytes(5 << 20))
    for number, data in enumerate(malformed_ones):
        answered, why = ask(session, key, data, attachment(number))
        assert not answered
        assert f"{name}_Request" in why or not data
    for extra in (b"short", None):
        answered, why = ask(session, key, b"\0\1\0\0\1", extra)
        assert (answered, "attachment" in why) == (False, True)
    assert (called, service.malformed) == ([], 7)
    assert ask(session, key, b"\0\1\0\0\1", attachment(0)) == (True, "")


def ask(session: zenoh.Session, key: str, data: bytes, extra: bytes | None) -> tuple[bool, str]:
    """Return whether a service answers, or why it refuses."""
    answers = [
        *session.get(
            key, target=zenoh.QueryTarget.ALL_COMPLETE, payload=data, attachment=extra, timeout=FOREVER
        )
    ]
    for each in answers:
        if each.err is not None:
            return False, each.err.payload.to_string()
    return bool(answers), ""


def decodes(node: Node, data: bytes) -> bool:
    try:
        node.types.decode(data, LASER)
    except MessageError:
        return False
    return True
