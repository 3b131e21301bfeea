"""Who listens to a stream of large values, and how many samples each may leave unread."""

from __future__ import annotations

import pytest

from zenoh_ice.carriers._local.listeners import Listeners, most_unread
from zenoh_ice.carriers._local.memory import Arena
from zenoh_ice.carriers._local.messages import (
    Part,
    Response,
    Sample,
    Subscribed,
    decode_to_client,
)
from zenoh_ice.threads.limits import Limits

MEGABYTE = 1 << 20
Message = Part | Response | Sample | Subscribed


class Client:
    """A channel that keeps what is sent over it, while it has room for it."""

    def __init__(self) -> None:
        self.messages: list[Message] = []
        self.has_room = True
        self.is_closed = False

    def send_sample(self, message: bytes) -> bool:
        if self.has_room:
            self.messages.append(decode_to_client(message))
        return self.has_room

    def close(self) -> None:
        self.is_closed = True


@pytest.mark.parametrize(("size", "most"), [(0, 8), (MEGABYTE, 8), (8 * MEGABYTE, 4), (100 * MEGABYTE, 1)])
def test_how_many_samples_may_be_left_unread_depends_on_their_size(size: int, most: int) -> None:
    assert most_unread(size) == most


def test_one_that_reads_nothing_gets_a_few_samples_and_others_all(arena: Arena) -> None:
    listeners, idle, reader = Listeners(arena, Limits(unread_bytes=2 * MEGABYTE)), Client(), Client()
    for channel in (idle, reader):
        assert listeners.add(channel)
    for _ in range(20):
        listeners.put(bytes(MEGABYTE), b"about")
        sample = reader.messages[-1]
        assert isinstance(sample, Sample)
        assert sample.extent is not None
        arena.give_back(sample.extent.start, reader)
    assert (len(idle.messages), len(reader.messages)) == (2 + 3, 20)


def test_what_there_was_no_room_for_is_not_lent(arena: Arena) -> None:
    listeners, client = Listeners(arena), Client()
    listeners.add(client)
    client.has_room = False
    listeners.put(bytes(MEGABYTE), b"about")
    assert arena.lent_to(client) == 0


def test_all_learn_that_no_samples_come_any_more(arena: Arena) -> None:
    listeners, client = Listeners(arena), Client()
    listeners.add(client)
    listeners.close()
    assert client.is_closed
    assert not listeners
    assert not listeners.add(Client())


def test_without_memory_all_are_sent_to_the_network_and_stay_there(
    arena: Arena, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = 100.0
    monkeypatch.setattr("zenoh_ice.carriers._local.listeners.time.monotonic", lambda: now)
    listeners, client = Listeners(arena), Client()
    listeners.add(client)
    arena.close()
    listeners.put(bytes(MEGABYTE), b"about")
    assert not client.is_closed
    now += 1.0
    listeners.put(bytes(MEGABYTE), b"about")
    assert client.is_closed
    assert not listeners.add(Client())
    now += 10.0
    later = Client()
    assert listeners.add(later)
    listeners.put(bytes(MEGABYTE), b"about")
    assert later.is_closed  # at once: not for half a second of samples again
