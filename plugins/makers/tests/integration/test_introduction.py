"""Participants of DDS that are met on loopback: each hears our announcement, and its end is told at once."""

from __future__ import annotations

import random
import socket
import struct
import threading
from contextlib import suppress

import pytest

from naoserver.errors import RobotError
from plugins.makers.tests.support.dds import domain_ports, free_domain
from tests.support.limits import EVENT_LIMIT
from tests.support.soak import repeated
from tests.support.waiting import until
from visualhfsm_makers._introduction import Introduction

DOMAIN = free_domain()
GROUP = "239.255.0.1", domain_ports(DOMAIN)[0]
CYCLONE, FAST_DDS = b"\x01\x10", b"\x01\x0f"
OURS, ITS, OTHER = b"ourselves...", b"a program...", b"another one."
VERSION = struct.pack("<HH4s", 0x8007, 4, b"free")


def port_of(port: int) -> bytes:
    """Return the parameter of a port on loopback."""
    return struct.pack("<HHiI16s", 0x32, 24, 1, port, bytes(12) + socket.inet_aton("127.0.0.1"))


def announcement(vendor: bytes, prefix: bytes, *parameters: bytes) -> bytes:
    """Return the message by which a participant announces itself."""
    body = struct.pack("<HH4s4siI4s", 0, 16, bytes(4), b"\0\1\0\xc2", 0, 1, b"\0\3\0\0")
    body += b"".join(parameters) + struct.pack("<HH", 1, 0)
    time_ = struct.pack("<BBHQ", 0x09, 1, 8, 0)
    return b"RTPS\2\3" + vendor + prefix + time_ + struct.pack("<BBH", 0x15, 5, len(body)) + body


class Domain:
    """What is said in a domain on loopback, and an introduction in it."""

    def __init__(self) -> None:
        loopback = socket.inet_aton("127.0.0.1")
        self.ears = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.ears.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.ears.bind(GROUP)
        self.ears.setsockopt(
            socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(GROUP[0]) + loopback
        )
        self.ears.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, loopback)
        self.ears.settimeout(EVENT_LIMIT)
        self.introduction = Introduction(DOMAIN, OURS)
        self.introduction.start()
        self.say(announcement(CYCLONE, OURS, VERSION))

    def say(self, message: bytes) -> None:
        self.ears.sendto(message, GROUP)

    def hear(self, kind: bytes) -> bytes:
        """Return the next message that has some bytes."""
        while kind not in (message := self.ears.recv(65535)):
            pass
        return message

    def close(self) -> None:
        self.introduction.close()
        self.ears.close()


@pytest.fixture
def domain():
    domain = Domain()
    yield domain
    domain.close()


@pytest.fixture
def program():
    """Return the port of a program."""
    program = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    program.bind(("127.0.0.1", 0))
    program.settimeout(EVENT_LIMIT)
    yield program
    program.close()


FAREWELL = struct.pack("<HHI", 0x71, 4, 3 << 24)
"""The parameter that says that a participant is gone."""


def meet(domain: Domain, program: socket.socket, vendor: bytes = FAST_DDS, prefix: bytes = ITS) -> None:
    domain.say(announcement(vendor, prefix, VERSION, port_of(program.getsockname()[1])))


def test_a_program_hears_our_announcement_with_padding_for_what_is_in_its_way(domain, program):
    meet(domain, program)
    assert program.recv(65535) == announcement(CYCLONE, OURS, b"\0\0" + VERSION[2:])


@pytest.mark.parametrize("vendor", [CYCLONE, FAST_DDS])
def test_a_program_whose_port_is_closed_is_said_to_leave(domain, program, vendor):
    meet(domain, program, vendor)
    program.recv(65535)
    program.close()
    assert domain.hear(FAREWELL)[:20] == b"RTPS\2\3" + vendor + ITS


def test_a_program_with_the_port_of_another_one_replaces_it(domain, program):
    meet(domain, program)
    meet(domain, program, prefix=OTHER)
    assert domain.hear(FAREWELL)[8:20] == ITS


def test_participants_of_cyclone_share_a_port(domain, program):
    meet(domain, program, CYCLONE)
    meet(domain, program, CYCLONE, OTHER)
    program.close()
    gone: set[bytes] = set()
    while gone != {ITS, OTHER}:
        gone.add(domain.hear(FAREWELL)[8:20])


def test_hostile_messages_do_not_end_it(domain, program):
    draw, whole = random.Random(55), announcement(FAST_DDS, ITS, VERSION, port_of(2**32 - 1), port_of(80))
    for _ in range(repeated(300, soak=10_000)):
        place = draw.randrange(len(whole))
        domain.say(whole[:place] + draw.randbytes(draw.randrange(60)) + whole[place + draw.randrange(60) :])
        domain.say(announcement(FAST_DDS, draw.randbytes(12), port_of(draw.randrange(2**17))))
    program.settimeout(0.1)

    def heard():
        meet(domain, program)  # again: the flood may have filled the socket
        with suppress(TimeoutError):
            return program.recv(65535)[8:20] == OURS

    until(heard)


def test_it_ends_with_its_thread(domain):
    domain.introduction.close()
    assert "introduction" not in {thread.name for thread in threading.enumerate()}


def test_a_port_that_it_cannot_have_is_an_error():
    free = free_domain()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("", domain_ports(free)[0]))
        with pytest.raises(RobotError, match="cannot hear programs at"):
            Introduction(free, OURS).start()
