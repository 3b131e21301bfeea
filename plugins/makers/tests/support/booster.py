"""Programs for a T1: they join a domain of DDS, call its service, and command its joints.

As a process of its own, one walks on, or commands by both doors without a pause, until it is killed:

    python -m plugins.makers.tests.support.booster DOMAIN walk|flood LEASE

LEASE are the s after which DDS takes it for lost.
"""

from __future__ import annotations

import json
import secrets
import sys
import threading
from collections.abc import Iterator
from typing import Any, Final

from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from plugins.makers.tests.support.unitree import on_loopback
from tests.support.limits import EVENT_LIMIT, FOREVER
from tests.support.waiting import until
from visualhfsm_makers._booster._service import CALLS
from visualhfsm_makers._booster._types import LowCmd, MotorCmd, RpcReqMsg, RpcRespMsg

__all__ = ["CUSTOM", "ELBOW", "MOVE", "Program", "low_command"]

MOVE: Final = 2001, {"vx": 0.1, "vy": 0.0, "vyaw": 0.0}
CUSTOM: Final = 2000, {"mode": 3}
UPPER_BODY: Final = 2030, {"start": True}
_ANSWERS: Final = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(1000))
ELBOW: Final = 4
"""The maker's number of the left elbow's pitch."""


class Program:
    """A program that calls a service, by default that of the walk: a participant of its own."""

    def __init__(self, domain: int, service: str = "rt/LocoApiTopic") -> None:
        self.participant = DomainParticipant(domain)
        self._writer = self.writer(f"{service}Req", RpcReqMsg)
        topic = Topic(self.participant, f"{service}Resp", RpcRespMsg)
        # All programs get all answers.
        self._reader = DataReader(self.participant, topic, _ANSWERS)
        until(self._is_answered)

    def _is_answered(self) -> bool:
        """Return whether a call is answered: the server may know the writer of calls first."""
        self._writer.write(RpcReqMsg("first", json.dumps({"api_id": 2017}), ""))
        return any(self._reader.take_iter(timeout=duration(milliseconds=100)))

    def ask(self, operation: int, body: object = None) -> tuple[int, Any]:
        """Call an operation; return its status and its result."""
        return self.send(json.dumps({"api_id": operation}), json.dumps(body or {}))

    def send(self, header: str, body: str) -> tuple[int, Any]:
        """Send a call; return the status and the result in its answer."""
        number = secrets.token_hex(8)
        self._writer.write(RpcReqMsg(number, header, body))
        answers = self._reader.take_iter(timeout=duration(seconds=EVENT_LIMIT))
        answer = next(each for each in answers if each.uuid == number)
        return json.loads(answer.header)["status"], json.loads(answer.body)

    def call(self, operation: int, body: object = None) -> int:
        """Call an operation; return its status."""
        return self.ask(operation, body)[0]

    def writer(self, topic: str, kind: Any) -> Any:
        """Return what writes a topic that the server reads."""
        made = DataWriter(self.participant, Topic(self.participant, topic, kind), CALLS)
        until(made.get_matched_subscriptions)
        return made

    def read(self, topic: str, kind: Any) -> Iterator[Any]:
        """Yield the messages of a topic."""
        reader = DataReader(self.participant, Topic(self.participant, topic, kind))
        yield from reader.take_iter(timeout=duration(seconds=EVENT_LIMIT))


def low_command(motor: int, position: float) -> Any:
    """Return a command of one motor alone."""
    return LowCmd(1, [MotorCmd(0, position, 0.0, 0.0, 50.0, 2.0, float(n == motor)) for n in range(23)])


def main() -> None:
    domain, what, lease = int(sys.argv[1]), sys.argv[2], sys.argv[3]
    keep = on_loopback(domain, lease)
    program = Program(domain)
    program.call(*UPPER_BODY)
    sys.stdout.write(f"answered {program.call(*MOVE)}\n")
    if what == "flood":
        low, command = program.writer("rt/joint_ctrl", LowCmd), low_command(ELBOW, 0.5)
        while True:
            low.write(command)
            program.call(*MOVE)
    threading.Event().wait(FOREVER)
    del keep


if __name__ == "__main__":
    main()
