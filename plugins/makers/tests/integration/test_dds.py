"""A domain of DDS with programs in it: messages arrive with their program's name, and lost programs are told."""

from __future__ import annotations

import socket
import threading
from functools import partial
from types import SimpleNamespace

import pytest

from naoserver.errors import RobotError
from plugins.makers.tests.support.dds import domain_ports, free_domain
from tests.support.limits import EVENT_LIMIT
from tests.support.waiting import until

pytest.importorskip("cyclonedds", reason="the extra unitree is not installed")
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from visualhfsm_makers import _dds
from visualhfsm_makers._dds import Wire, Writer
from visualhfsm_makers._unitree._types import Identity, Status

DOMAIN = free_domain()


class Ears:
    """A wire that listens to two topics, one of them raw."""

    def __init__(self) -> None:
        self.heard: list[tuple[object, str]] = []
        self.lost: list[str] = []
        self.senders: list[str] = []
        self.renewed = threading.Event()
        self.unserved: list[tuple[str, str, int]] = []
        self.wire = Wire(f"dds:{DOMAIN}", "Test", self.renewed.set, self.lost.append, self.senders.append)
        self.wire.unserved = lambda *told: self.unserved.append(told)
        self.wire.listen("calls", Identity, lambda message, client: self.heard.append((message, client)))
        self.wire.listen("raw", Status, lambda data, client: self.heard.append((data, client)), raw=True)
        self.wire.start()


@pytest.fixture
def ears():
    ears = Ears()
    with ears.wire:
        yield ears


def writer(topic, kind):
    participant = DomainParticipant(DOMAIN)
    made = DataWriter(participant, Topic(participant, topic, kind))
    until(made.get_matched_subscriptions)
    return made


def test_messages_arrive_with_the_name_of_their_program(ears):
    first, second = writer("calls", Identity), writer("calls", Identity)
    first.write(Identity(1, 2))
    second.write(Identity(3, 4))
    until(lambda: len(ears.heard) == 2)
    assert {(message.id, message.api_id) for message, _ in ears.heard} == {(1, 2), (3, 4)}
    assert len({client for _, client in ears.heard}) == 2
    assert ears.senders == [client for _, client in ears.heard]


def test_all_that_a_participant_writes_is_of_one_program_until_it_writes_no_more(ears):
    participant = DomainParticipant(DOMAIN)
    writers = [
        DataWriter(participant, Topic(participant, name, kind))
        for name, kind in (("calls", Identity), ("raw", Status))
    ]
    until(lambda: all(each.get_matched_subscriptions() for each in writers))
    for each, sent in zip(writers, (Identity(1, 2), Status(7)), strict=True):
        each.write(sent)
    until(lambda: len(ears.heard) == 2)
    assert len({client for _, client in ears.heard}) == 1
    del each, writers[0]
    until(lambda: len(ears.wire._programs) == 1)
    assert ears.lost == []
    del writers[0]
    until(lambda: ears.lost)
    assert ears.lost == [ears.heard[0][1]]


def test_a_program_that_leaves_is_dropped(ears):
    program = writer("calls", Identity)
    program.write(Identity(1, 2))
    until(lambda: ears.heard)
    del program
    until(lambda: ears.lost)
    assert ears.lost == [ears.heard[0][1]]


def test_at_the_end_all_programs_are_dropped(ears):
    program = writer("calls", Identity)
    program.write(Identity(1, 2))
    until(lambda: ears.heard)
    ears.wire.__exit__(None, None, None)
    assert ears.lost == [ears.heard[0][1]]


@pytest.mark.parametrize("error", [ValueError("a test"), SystemExit("a test")])
def test_what_fails_with_a_message_ends_nothing(ears, caplog, error):
    heard, last = [], Identity(3, 4)

    def take(message, _client):
        heard.append(message)
        if message != last:
            raise error

    ears.wire.listen("fails", Identity, take)
    program = writer("fails", Identity)
    program.write(Identity(1, 2))
    until(lambda: "goes on after an error" in caplog.text)
    program.write(last)
    until(lambda: len(heard) == 2)


@pytest.mark.parametrize("error", [ValueError("a test"), SystemExit("a test")])
def test_all_programs_are_dropped_though_that_fails(ears, caplog, error):
    def drop(client):
        ears.lost.append(client)
        raise error

    ears.wire._drop = drop
    programs = [writer("calls", Identity) for _ in range(2)]
    for each in programs:
        each.write(Identity(1, 2))
    until(lambda: len({client for _, client in ears.heard}) == 2)
    ears.wire.__exit__(None, None, None)
    assert len(set(ears.lost)) == 2
    assert "could not end all of a program that is gone" in caplog.text


def test_bytes_arrive_as_they_were_sent(ears):
    program = Writer(writer("raw", Status))
    assert program.wanted
    program.send(b"\x07\0\0\0")
    until(lambda: ears.heard)
    assert ears.heard[0][0] == b"\x07\0\0\0"


def test_what_programs_command_is_renewed_without_messages(ears):
    assert ears.renewed.wait(EVENT_LIMIT)


def endpoint(participant, name, kind=Status, made=DataWriter):
    return made(participant, Topic(participant, name, kind))


def test_each_topic_of_robots_that_is_not_served_is_told_once_for_each_program(ears):
    first, second = DomainParticipant(DOMAIN), DomainParticipant(DOMAIN)
    kept = [
        endpoint(first, "calls", Identity),
        endpoint(first, "chatter"),
        endpoint(first, "rt/rosout"),
        endpoint(first, "rt/arms"),
        endpoint(first, "rt/arms"),
        endpoint(first, "rt/legs", made=DataReader),
    ]
    until(lambda: len(ears.unserved) == 2)
    kept.append(endpoint(second, "rt/arms"))
    until(lambda: len(ears.unserved) == 3)
    arms = ("rt/arms", "rt/arms, which a program writes, is not served")
    legs = ("rt/legs", "rt/legs, which a program reads, is not served")
    assert {told[:2] for told in ears.unserved[:2]} == {arms, legs}
    assert [told[2] for told in ears.unserved] == [0, 1, 0]
    assert ears.unserved[2][:2] == arms
    del kept


def test_a_served_topic_of_another_type_is_told(ears):
    ears.wire.listen("rt/arms", Identity, lambda _message, _client: None)
    kept = endpoint(DomainParticipant(DOMAIN), "rt/arms", Status)
    until(lambda: ears.unserved)
    own, other = "unitree_api::msg::dds_::RequestIdentity_", "unitree_api::msg::dds_::ResponseStatus_"
    assert ears.unserved[0][1] == f"rt/arms, which a program writes, is of type {own}, not {other}"
    del kept


def test_of_a_program_that_makes_up_topics_a_few_are_told_and_cut(ears):
    program = DomainParticipant(DOMAIN)
    kept = [endpoint(program, f"rt/{n}_{'a' * 200}") for n in range(_dds._MOST_REPORTED + 10)]
    other = endpoint(DomainParticipant(DOMAIN), "rt/last")
    until(lambda: any(topic == "rt/last" for topic, *_ in ears.unserved))
    until(lambda: len(ears.unserved) > _dds._MOST_REPORTED)
    assert len(ears.unserved) == _dds._MOST_REPORTED + 1
    assert max(len(text) for _, text, _ in ears.unserved) < 200
    del kept, other


def test_an_announcement_that_cannot_be_read_ends_nothing(ears, monkeypatch):
    def take(_most):
        raise ValueError("a test")

    monkeypatch.setattr(ears.wire, "_writers", SimpleNamespace(take=take))
    kept = endpoint(DomainParticipant(DOMAIN), "rt/legs", made=DataReader)
    until(lambda: ears.unserved)
    program = writer("calls", Identity)
    program.write(Identity(1, 2))
    until(lambda: ears.heard)
    del kept, program


def told(ears: Ears, count: int) -> bool:
    return len(ears.unserved) == count


def test_as_many_programs_as_there_may_be_are_remembered(ears, monkeypatch):
    monkeypatch.setattr(_dds, "_MOST_PROGRAMS", 1)
    first, second = DomainParticipant(DOMAIN), DomainParticipant(DOMAIN)
    kept = []
    for number, (program, topic) in enumerate([(first, "rt/arms"), (second, "rt/arms"), (first, "rt/legs")]):
        kept.append(endpoint(program, topic))
        until(partial(told, ears, number + 1))
    assert [told[2] for told in ears.unserved] == [0, 0, 0]
    assert len(ears.wire._reported) == 1
    del kept


@pytest.mark.parametrize("url", ["dds:233", "dds:", "tcp://127.0.0.1", "dds:1 "])
def test_what_is_no_domain_is_refused(url):
    with pytest.raises(RobotError, match="is no domain of DDS: write dds:0 to dds:232"):
        Wire(url, "Test", lambda: None, lambda _client: None, lambda _client: None)


def test_a_domain_whose_port_another_program_has():
    domain = free_domain()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("", domain_ports(domain)[0]))
        with pytest.raises(
            RobotError, match=f"cannot join dds:{domain} .*; another domain helps if a program has"
        ):
            Wire(f"dds:{domain}", "Test", lambda: None, lambda _: None, lambda _: None)
