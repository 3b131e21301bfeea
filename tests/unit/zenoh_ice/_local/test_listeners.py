"""Who listens to a stream of large values, and how many samples each may leave unread."""

from __future__ import annotations

import pytest

from zenoh_ice._local.listeners import Listeners, most_unread
from zenoh_ice._local.messages import (
    Part,
    Response,
    Sample,
    Subscribed,
    decode_to_client,
)
from zenoh_ice._memory import Arena
from zenoh_ice.limits import Limits

MEGABYTE = 1 << 20
Message = Part | Response | Sample | Subscribed


class Client:
    """A link that keeps what is sent over it, while it has room for it."""

    def __init__(self) -> None:
        self.messages: list[Message] = []
        self.has_room = True

    def send_sample(self, message: bytes) -> bool:
        if self.has_room:
            self.notify(message)
        return self.has_room

    def notify(self, message: bytes) -> None:
        self.messages.append(decode_to_client(message))


@pytest.mark.parametrize(("size", "most"), [(0, 8), (MEGABYTE, 8), (8 * MEGABYTE, 4), (100 * MEGABYTE, 1)])
def test_how_many_samples_may_be_left_unread_depends_on_their_size(size: int, most: int) -> None:
    assert most_unread(size) == most


def test_one_that_reads_nothing_gets_a_few_samples_and_others_all(arena: Arena) -> None:
    listeners, idle, reader = Listeners(arena, Limits(unread_bytes=2 * MEGABYTE)), Client(), Client()
    for link in (idle, reader):
        assert listeners.add(link, 1)
    for _ in range(20):
        listeners.put(bytes(MEGABYTE), b"about")
        sample = reader.messages[-1]
        assert isinstance(sample, Sample)
        assert sample.extent is not None
        arena.give_back(sample.extent.start, (reader, 1))
    assert (len(idle.messages), len(reader.messages)) == (2 + 3, 20)


def test_what_there_was_no_room_for_is_not_lent(arena: Arena) -> None:
    listeners, client = Listeners(arena), Client()
    listeners.add(client, 1)
    client.has_room = False
    listeners.put(bytes(MEGABYTE), b"about")
    assert arena.lent_to((client, 1)) == 0


def test_all_learn_that_no_samples_come_any_more(arena: Arena) -> None:
    listeners, client = Listeners(arena), Client()
    listeners.add(client, 7)
    listeners.close()
    assert client.messages == [Subscribed(7, False)]
    assert not listeners
    assert not listeners.add(client, 8)
