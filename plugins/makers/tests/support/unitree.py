"""Programs for a G1: they join a domain of DDS, call its services, and command its joints.

As a process of its own, one walks on, commands by both doors without a pause, or its arms, until it is killed:

    python -m plugins.makers.tests.support.unitree DOMAIN walk|flood|arms LEASE

LEASE are the s after which DDS takes it for lost.
"""

from __future__ import annotations

import json
import random
import secrets
import socket
import struct
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from typing import Any, Final, Self

from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy as Of
from cyclonedds.qos import Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from plugins.makers.tests.support.dds import domain_ports
from tests.support.limits import EVENT_LIMIT, FOREVER
from tests.support.malformed_cdr import malformed
from tests.support.waiting import until
from visualhfsm_makers._unitree._joints import checksum
from visualhfsm_makers._unitree._types import (
    Identity,
    Lease,
    LowCmd,
    MotorCmd,
    Policy,
    Request,
    RequestHeader,
    Response,
)

__all__ = ["CONTINUOUS", "ELBOW", "Program", "Wiretap", "arm_command", "low_command", "on_loopback"]

CONTINUOUS: Final = json.dumps({"velocity": [0.1, 0, 0], "duration": 864000})
ELBOW: Final = 18
"""The maker's number of the left elbow."""
_RTPS_HEADER: Final = 20
"""Bytes that precede everything else in a message of the wire."""
_IN_C: Final = struct.Struct("<2B2x" + "B3x5fI" * 35 + "4I")


class Program:
    """A program that calls a service: a participant of its own."""

    def __init__(self, domain: int, service: str = "loco") -> None:
        self.participant = DomainParticipant(domain)
        self._writer = self.writer(f"rt/api/{service}/request", Request)
        topic = Topic(self.participant, f"rt/api/{service}/response", Response)
        # All programs get all answers.
        self._reader = DataReader(self.participant, topic, qos=Qos(Of.History.KeepLast(1000)))
        until(lambda: self._ask(1, "{}", 0.1))  # each side has discovered the other one

    def call(self, operation: int, parameter: str = "{}", binary: bytes = b"") -> Any:
        """Call an operation; return its answer."""
        answer = self._ask(operation, parameter, EVENT_LIMIT, binary)
        assert answer is not None, f"operation {operation} is not answered"
        return answer

    def _ask(self, operation: int, parameter: str, limit: float, binary: bytes = b"") -> Any:
        own = Identity(secrets.randbits(62), operation)
        header = RequestHeader(own, Lease(0), Policy(0, noreply=False))
        self._writer.write(Request(header, parameter, [*binary]))
        end = time.monotonic() + limit
        while (left := end - time.monotonic()) > 0.0:
            for answer in self._reader.take_iter(timeout=duration(seconds=left)):
                if answer.header.identity == own:
                    return answer
                if time.monotonic() > end:
                    break
        return None

    def writer(self, topic: str, kind: Any) -> Any:
        """Return what writes a topic that the server reads."""
        made = DataWriter(self.participant, Topic(self.participant, topic, kind))
        until(made.get_matched_subscriptions)
        return made

    def read(self, topic: str, kind: Any) -> Iterator[Any]:
        """Yield the messages of a topic."""
        reader = DataReader(self.participant, Topic(self.participant, topic, kind))
        yield from reader.take_iter(timeout=duration(seconds=EVENT_LIMIT))


def low_command(motor: int, position: float, *, torque: float = 0.0) -> Any:
    """Return a command of one motor alone: to a position, or with a torque and no more than damping."""
    stiffness = 0.0 if torque else 60.0
    motors = [MotorCmd(int(n == motor), position, 0.0, torque, stiffness, 2.0, 0) for n in range(35)]
    flat = [member for each in motors for member in vars(each).values()]
    return LowCmd(0, 5, motors, [0] * 4, checksum(_IN_C.pack(0, 5, *flat, 0, 0, 0, 0)))


def arm_command(motor: int, position: float, weight: float = 1.0) -> Any:
    """Return a command of one motor for rt/arm_sdk, as the maker's examples send it: modes and machine are 0."""
    motors = [
        MotorCmd(0, *([position, 0.0, 0.0, 60.0, 1.5] if n == motor else [0.0] * 5), 0) for n in range(35)
    ]
    motors[29].q = weight
    return LowCmd(0, 0, motors, [0] * 4, 0)


class Wiretap:
    """Hears the announcements of a domain, and sends them and what is like them again, changed."""

    def __init__(self, domain: int) -> None:
        self._ports = [domain_ports(domain)[place] for place in (0, 1, *range(10, 20))]
        self._heard = [b"RTPS\x02\x05\x01\x10" + bytes(12)]

    def __enter__(self) -> Self:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._socket.bind(("239.255.0.1", self._ports[0]))
        member = socket.inet_aton("239.255.0.1") + socket.inet_aton("127.0.0.1")
        self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
        self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
        self._socket.setblocking(False)
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def resend(self, draw: random.Random) -> None:
        """Send a message that was heard to the ports of a domain, changed."""
        with suppress(BlockingIOError):
            heard = self._socket.recv(65_536)  # its own messages, too
            if len(heard) > _RTPS_HEADER:
                self._heard = [*self._heard[-20:], heard]
        changed = malformed(draw.choice(self._heard), draw)
        for port in self._ports:
            for host in ("127.0.0.1", "239.255.0.1"):
                with suppress(OSError):
                    self._socket.sendto(changed, (host, port))


def on_loopback(domain: int, lease: str = "10") -> Any:
    """Configure a domain for this process, for as long as the result is kept: as the maker's package does it."""
    return Domain(
        domain,
        '<CycloneDDS><Domain Id="any"><General><Interfaces><NetworkInterface name="lo"/></Interfaces></General>'
        f"<Discovery><LeaseDuration>{lease} s</LeaseDuration></Discovery></Domain></CycloneDDS>",
    )


def main() -> None:
    """Do what the command line says."""
    domain, what, lease = int(sys.argv[1]), sys.argv[2], sys.argv[3]
    keep = on_loopback(domain, lease)
    program = Program(domain)
    sys.stdout.write(f"answered {program.call(7105, CONTINUOUS).header.status.code}\n")
    if what == "flood":
        low, command = program.writer("rt/lowcmd", LowCmd), low_command(ELBOW, 0.5)
        while True:
            low.write(command)
            program.call(7105, CONTINUOUS)
    if what == "arms":
        arms = program.writer("rt/arm_sdk", LowCmd)
        while True:
            arms.write(arm_command(ELBOW, 1.0))
            time.sleep(0.02)
    threading.Event().wait(FOREVER)
    del keep


if __name__ == "__main__":
    main()
