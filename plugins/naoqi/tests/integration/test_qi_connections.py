"""The bounds of what a program takes of the virtual NAOqi, whatever it sends: the test plays libqi itself."""

import os
import socket
import struct
import threading
from contextlib import ExitStack, suppress
from pathlib import Path

import pytest

pytest.importorskip("qi")

from plugins.naoqi.tests.support.messages import CALL, ERROR, POST, REPLY, Line, Message, text
from plugins.naoqi.tests.support.naoqi import connected
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, FOREVER
from tests.support.processes import ComponentProcess, module
from tests.support.waiting import until
from visualhfsm_naoqi.programs._clients import Call, CallTable, Client, QiLimits
from visualhfsm_naoqi.programs._connections import (
    LARGEST_MESSAGE,
    MOST_PROGRAMS,
    MOST_SHORT,
    Connections,
    Offer,
)
from zenoh_ice import WallClock

DOOR, MOTION, FOREIGN = 90, 2, 40
SIGNAL = 8  # the object of a subscriber
IMPATIENT = 1.0
"""Limit in s of a program that is to talk first: a busy machine must get to that."""
POSTED = 100
TOO_MANY = MOST_SHORT + 3


class PlayedLibqi:
    """A libqi that answers when the test makes it answer, behind `Connections`."""

    def __init__(self, steps: ExitStack, limits: QiLimits) -> None:
        self.clients: list[Client] = []
        self.lost: list[Client] = []
        self.lose = self.lost.append
        self._steps = steps
        self._listening = steps.enter_context(socket.create_server(("127.0.0.1", 0)))
        self._listening.settimeout(EVENT_LIMIT)
        url = f"tcp://127.0.0.1:{self._listening.getsockname()[1]}"
        offer = Offer(url, {MOTION: "ALMotion"}, DOOR, self._admit)
        self.connections = Connections("tcp://127.0.0.1:0", offer, lambda client: self.lose(client), limits)
        steps.callback(self.connections.close)

    def program(self, first):
        """Connect a program, which sends a first message; return its end, and that of libqi."""
        program = self._steps.enter_context(Line.to(self.connections.url))
        program.send(first)
        return program, self._steps.enter_context(Line(self._listening.accept()[0]))

    def user(self):
        """Connect a program that has called a service, and got its answer."""
        program, libqi = self.program(Message(CALL, 1, MOTION))
        asked, _ = libqi.receive()
        assert asked.service == DOOR
        libqi.send(asked._replace(type=REPLY), struct.pack("<II", DOOR, len(self.clients)))
        answer(libqi)
        assert program.numbers(1) == [1]
        return program, libqi

    def _admit(self, client):
        self.clients.append(client)
        return client.name


@pytest.fixture
def limits():
    """How long is waited for programs, and how many there may be."""
    return QiLimits()


@pytest.fixture
def played(limits):
    with ExitStack() as steps:
        yield PlayedLibqi(steps, limits)


def limited(**limits):
    """Run a test with some limits."""
    return pytest.mark.parametrize("limits", [QiLimits(**limits)], ids=["limited"])


def answer(libqi):
    """Answer the next message."""
    message, _ = libqi.receive()
    libqi.send(message._replace(type=REPLY))


def flood(line):
    """Send more than the system and the connection keep for one who takes nothing."""
    for _ in range(10_000):
        line.send(Message(REPLY, 2, FOREIGN), bytes(1 << 16))


# -- calls ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", [CALL, POST])
def test_few_short_calls_and_posts_of_a_program_are_in_libqi(played, kind):
    program, libqi = played.user()
    for number in range(TOO_MANY):
        program.send(Message(kind, 10 + number, MOTION))
    waiting = [libqi.receive()[0] for _ in range(MOST_SHORT)]
    assert [(each.type, each.number) for each in waiting] == [(CALL, 10 + i) for i in range(MOST_SHORT)]
    assert libqi.silent
    libqi.send(waiting[0]._replace(type=REPLY))
    assert libqi.numbers(1) == [10 + MOST_SHORT]
    assert libqi.silent
    program.send(Message(CALL, 99, MOTION))
    for each in waiting[1:]:
        libqi.send(each._replace(type=ERROR))
    while (message := libqi.receive()[0]).number != 99:
        libqi.send(message._replace(type=REPLY))
    libqi.send(message._replace(type=REPLY))
    answered = [program.receive()[0].number]
    while answered[-1] != 99:
        answered += program.numbers(1)
    assert (answered == [99]) is (kind == POST)  # what is posted has no answer


def test_few_posts_to_signals_are_in_libqi(played):
    program, libqi = played.user()
    for number in range(TOO_MANY):
        program.send(Message(POST, 10 + number, DOOR, SIGNAL))
    received = [libqi.receive()[0] for _ in range(2 * MOST_SHORT)]
    assert [each.type for each in received] == [POST, CALL] * MOST_SHORT
    assert libqi.silent
    libqi.send(received[1]._replace(type=REPLY))
    assert libqi.numbers(2) == [10 + MOST_SHORT] * 2
    assert program.silent


def test_a_call_with_the_number_of_one_that_waits_ends_the_connection(played):
    program, libqi = played.user()
    for kind in (CALL, POST):
        program.send(Message(kind, 10, MOTION))
    assert libqi.numbers(1) == [10]
    assert libqi.ended
    assert program.ended
    until(lambda: played.lost == played.clients)


def test_a_large_message_with_the_number_of_a_call_that_waits_makes_no_room(played):
    program, libqi = played.user()
    for number in range(MOST_SHORT):
        program.send(Message(CALL, 10 + number, MOTION))
        program.send(Message(REPLY, 10 + number, MOTION), bytes(LARGEST_MESSAGE + 1))
    program.send(Message(CALL, 99, MOTION))
    assert libqi.numbers(MOST_SHORT) == [10 + number for number in range(MOST_SHORT)]
    assert libqi.silent


def test_long_calls_that_a_program_awaits_make_room_but_not_its_tasks(played):
    program, libqi = played.user()
    for number in range(TOO_MANY):
        program.send(Message(CALL, 10 + number, MOTION))
    libqi.numbers(MOST_SHORT)
    table, (client,) = CallTable(WallClock()), played.clients
    for _ in range(TOO_MANY):
        table.add(Call(WallClock(), client))
    assert libqi.silent
    table.add(Call(WallClock(), client, awaited=True))
    assert libqi.numbers(1) == [10 + MOST_SHORT]
    assert libqi.silent


# -- connections ------------------------------------------------------------------------------------------


def test_further_programs_are_refused_until_one_ends(played):
    users = [played.user() for _ in range(MOST_PROGRAMS)]
    late, _ = played.program(Message(CALL, 1, MOTION))
    refused, what = late.receive()
    assert (refused.type, refused.number) == (ERROR, 1)
    assert b"ALMotion: 64 programs are connected already: end one of them" in what
    users[0][0].connection.close()
    until(lambda: played.lost == played.clients[:1])
    until(lambda: is_admitted(late))


def is_admitted(program):
    """Call a service once more; return whether that is not refused at once."""
    program.send(Message(CALL, 1, MOTION))
    return program.silent


@limited(connections=2, talk=FOREVER)
def test_an_address_that_others_may_reach_is_warned_of(played, caplog):
    assert "passwords" not in caplog.text
    nobody = Offer("tcp://127.0.0.1:9", {}, DOOR, lambda client: client.name)
    elsewhere = Connections("tcp://127.1:0", nobody, print)  # loopback, in a form that nobody writes
    elsewhere.close()
    assert f"NAOqi at {elsewhere.url} has no passwords: anyone on that network can" in caplog.text


def test_further_connections_are_closed_at_once(played):
    with ExitStack() as steps:
        first, *_ = (steps.enter_context(Line.to(played.connections.url)) for _ in range(2))
        assert steps.enter_context(Line.to(played.connections.url)).ended
        assert first.silent


@limited(talk=0.2)
def test_a_program_that_says_nothing_is_disconnected(played):
    with Line.to(played.connections.url) as program:
        assert program.ended


@limited(talk=IMPATIENT)
def test_a_program_that_takes_no_answers_is_lost(played):
    _, libqi = played.user()
    with pytest.raises(OSError, match=r"reset|pipe"):
        flood(libqi)
    until(lambda: played.lost == played.clients)


@limited(talk=IMPATIENT)
def test_a_program_is_lost_when_libqi_takes_nothing_more(played):
    program, _ = played.user()
    with pytest.raises(OSError, match=r"reset|pipe"):
        flood(program)
    until(lambda: played.lost == played.clients)


@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="only Linux shows the timers of connections")
def test_the_system_asks_after_a_silent_program_within_seconds(played):
    program, _ = played.user()
    (ours, theirs) = (
        f":{end[1]:04X}" for end in (program.connection.getpeername(), program.connection.getsockname())
    )

    def timer():
        """Return the kind of the connection's timer, and when it is due in s."""
        for line in Path("/proc/net/tcp").read_text().splitlines()[1:]:
            _, local, remote, _, _, timers, *_ = line.split()
            if local.endswith(ours) and remote.endswith(theirs):
                kind, _, due = timers.partition(":")
                return int(kind, 16), int(due, 16) / 100
        raise AssertionError("there is no such connection")

    keep_alive = 2
    until(lambda: timer()[0] == keep_alive)  # not while data are on their way
    assert timer()[1] <= 2.0


# -- the end ----------------------------------------------------------------------------------------------


def test_a_program_is_lost_even_if_no_thread_can_start(played, monkeypatch):
    program, _ = played.user()

    def start(_thread):
        raise RuntimeError("can't start new thread")

    with monkeypatch.context() as patch:
        patch.setattr(threading.Thread, "start", start)
        program.connection.close()
        until(lambda: played.lost)
    assert set(played.lost) == set(played.clients)
    played.user()


@limited(end=0.2)
def test_closing_does_not_wait_for_ever_for_a_client_that_cannot_be_lost(played, caplog):
    free = threading.Event()
    played.lose = lambda _client: free.wait(CALL_LIMIT)
    played.user()
    played.connections.close()
    free.set()
    assert "NAOqi connections did not end within 0.2 s" in caplog.text


@limited(end=FOREVER)
def test_programs_that_end_just_before_it_is_closed_are_dealt_with(played):
    busy, free = threading.Semaphore(0), threading.Event()

    def lose(client):
        busy.release()
        free.wait(CALL_LIMIT)
        played.lost.append(client)

    def listens():
        with suppress(ConnectionError):
            Line.to(played.connections.url).connection.close()
            return True
        return False

    played.lose = lose
    for program, _ in [played.user() for _ in range(MOST_PROGRAMS)]:
        program.connection.close()
    for _ in range(min(32, (os.cpu_count() or 1) + 4)):  # all threads of the loop: the others wait for one
        assert busy.acquire(timeout=EVENT_LIMIT)
    closing = threading.Thread(target=played.connections.close)
    closing.start()
    until(lambda: not listens())
    free.set()
    closing.join(EVENT_LIMIT)
    assert {*played.lost} == {*played.clients}


# -- genuine libqi ----------------------------------------------------------------------------------------


def test_what_a_program_posts_is_done_also_its_own_signals():
    with (
        ComponentProcess(module("visualhfsm_naoqi.programs", "--qi", "tcp://127.0.0.1:0")) as process,
        connected(process.wait_for(r"^ready: (\S+)")[1]) as session,
        Line.to(session.url()) as program,
    ):
        memory = session.service("ALMemory")
        (service,) = (each["serviceId"] for each in session.services() if each["name"] == "ALMemory")
        methods = memory.metaObject()["methods"].values()
        (insert,) = (each["uid"] for each in methods if each["name"] == "insertData")
        program.send(Message(CALL, 1, 0, 0, 8), struct.pack("<I", 0))  # without any capabilities
        assert program.receive()[0].type == REPLY
        for number in range(POSTED):
            value = text("s") + text(f"Posted{number}"), text("s") + text("")
            program.send(Message(POST, 2 + number, service, action=insert), b"".join(value))
        until(lambda: len(memory.getDataList("Posted")) == POSTED)
        heard = threading.Event()
        subscriber = memory.subscriber("Mine")
        subscriber.signal.connect(lambda _value: heard.set())
        subscriber.signal(1)
        assert heard.wait(EVENT_LIMIT)
