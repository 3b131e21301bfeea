"""The simulated bus: its packets, its watchdog and its commands."""

from __future__ import annotations

import os
import select
from collections.abc import Iterator

import pytest

from naoserver.hardware.sim_bus import ANSWER, HOLD, SETPOINT, SimBus, pack, unpack
from tests.support.limits import EVENT_LIMIT
from tests.support.waiting import until


@pytest.fixture
def bus() -> Iterator[SimBus]:
    bus = SimBus(2)
    yield bus
    bus.close()


def places(bus: SimBus) -> list[float]:
    return [float(word) for word in bus.command("where").split()[1:]]


def ask(bus: SimBus, *packets: bytes, answers: int = 2) -> list[tuple[int, bytes, bytes]]:
    """Send packets, and return the answers."""
    line = os.open(bus.path, os.O_RDWR | os.O_NOCTTY)
    received = bytearray()
    found: list[tuple[int, bytes, bytes]] = []
    try:
        for packet in packets:
            os.write(line, packet)
        while len(found) < answers:
            assert select.select([line], [], [], EVENT_LIMIT)[0]
            received += os.read(line, 4096)
            found += unpack(received)
    finally:
        os.close(line)
    return found


def test_packets_that_come_in_pieces_or_behind_noise_are_found() -> None:
    packets = pack(1, b"A", b"\xfe\xfe") + pack(2, b"R")
    received = bytearray(b"\xfe\x00noise")
    found: list[tuple[int, bytes, bytes]] = []
    for byte in packets + pack(3, b"R") * 40:  # until the noise cannot be the beginning of a long packet
        received.append(byte)
        found += unpack(received)
    assert [each for each in found if each[0] < 3] == [(1, b"A", b"\xfe\xfe"), (2, b"R", b"")]


def test_each_servo_answers_with_the_number_of_the_question(bus: SimBus) -> None:
    answers = ask(bus, pack(7, b"R"))
    assert [(number, kind) for number, kind, _ in answers] == [(7, b"A")] * 2
    assert [ANSWER.unpack(content)[0] for _, _, content in answers] == [1, 2]


def test_the_watchdog_holds_a_servo_that_nobody_sends_on(bus: SimBus) -> None:
    ask(bus, pack(0, b"T", HOLD.pack(1, True)), pack(0, b"M", SETPOINT.pack(1, 100.0)), pack(1, b"R"))
    seen = []

    def rests() -> bool:
        seen.append(places(bus)[0])
        return len(seen) > 1 and seen[-1] == seen[-2] > 0.0

    until(rests)
    assert 0.0 < seen[-1] < 1.0


def test_a_limp_servo_goes_nowhere_and_a_lost_one_says_nothing(bus: SimBus) -> None:
    bus.command("lose 2")
    answers = ask(bus, pack(0, b"M", SETPOINT.pack(1, 1.0)), pack(1, b"R"), answers=1)
    assert ANSWER.unpack(answers[0][2])[:2] == (1, 0.0)


def test_the_cable_is_pulled_and_plugged_in(bus: SimBus) -> None:
    bus.command("unplug")
    assert not bus.path.exists()
    bus.command("plug")
    assert len(ask(bus, pack(1, b"R"))) == 2


@pytest.mark.parametrize("line", ["", "dance", "stuck", "stuck 3", "stuck one", "late soon"])
def test_a_command_that_is_not_known_is_refused(bus: SimBus, line: str) -> None:
    with pytest.raises(ValueError, match="is not a command"):
        bus.command(line)
