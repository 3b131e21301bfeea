"""A link that fails, by itself: in which order, and how much."""

from __future__ import annotations

import math

import pytest

from zenoh_ice import VirtualClock
from zenoh_ice.routes.failing import SOUND, FailingLink, LinkState


class Sent:
    """Samples over a failing link, and those that arrived."""

    def __init__(self, state: LinkState) -> None:
        self.clock = VirtualClock()
        self.wakes = 0
        self.link = FailingLink(self.clock, 0, self.wake)
        self.link.become(state)
        self.arrived: list[bytes] = []

    def wake(self) -> None:
        self.wakes += 1

    def put(self, payload: bytes) -> None:
        self.link.put(lambda payload, _attachment: self.arrived.append(bytes(payload)), payload, b"")

    def later(self, seconds: float) -> list[bytes]:
        self.clock.advance(seconds)
        self.link.deliver()
        return self.arrived


def test_a_late_message_is_due_by_the_clock_and_arrives_then() -> None:
    sent = Sent(LinkState(late=0.3))
    before = sent.wakes
    sent.put(b"a")
    assert sent.link.due == pytest.approx(0.3)
    assert sent.wakes == before + 1
    assert sent.later(0.29) == []
    assert sent.later(0.01) == [b"a"]
    assert sent.link.due == math.inf


def test_no_message_overtakes_another_where_the_link_becomes_less_late() -> None:
    sent = Sent(LinkState(late=1.0))
    sent.put(b"a")
    sent.link.become(LinkState(late=0.1))
    sent.put(b"b")
    assert sent.later(0.5) == []
    assert sent.later(0.5) == [b"a", b"b"]


def test_what_waits_is_bounded() -> None:
    sent = Sent(LinkState(late=1.0))
    for _ in range(10_010):
        sent.put(b"a")
    assert len(sent.later(1.0)) == 10_000


def test_what_is_published_while_the_servants_hang_is_never_sent() -> None:
    sent = Sent(LinkState(hung=True))
    sent.put(b"a")
    sent.link.become(SOUND)
    sent.put(b"b")
    assert sent.later(1.0) == [b"b"]


def test_a_call_whose_attachment_is_malformed_is_refused_by_its_receiver() -> None:
    sent = Sent(LinkState(late=0.1))
    admitted: list[bytes | None] = []

    def admit(name: str, payload: bytes, attachment: bytes, reply: object, **_: object) -> None:
        admitted.append(attachment)

    sent.link.admit(admit, "getPose", b"", b"\xc1", lambda _ok, _answer: None)
    sent.later(0.1)
    assert admitted == [b"\xc1"]
