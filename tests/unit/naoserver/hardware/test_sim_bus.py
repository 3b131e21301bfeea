"""The simulated bus: its lines, its watchdog and its commands."""

from __future__ import annotations

import os
import select
from collections.abc import Iterator
from pathlib import Path

import pytest

from naoserver.hardware.sim_bus import SimBus
from tests.support.limits import EVENT_LIMIT
from tests.support.waiting import until


@pytest.fixture
def bus() -> Iterator[SimBus]:
    bus = SimBus(2)
    yield bus
    bus.close()


def places(bus: SimBus) -> list[float]:
    return [float(word) for word in bus.command("where").split()[1:]]


def ask(bus: SimBus, *lines: str, answers: int = 2) -> list[list[str]]:
    """Send lines, and return the words of the answers."""
    line = os.open(bus.path, os.O_RDWR | os.O_NOCTTY)
    received = b""
    try:
        for each in lines:
            os.write(line, f"{each}\n".encode())
        while received.count(b"\n") < answers:
            assert select.select([line], [], [], EVENT_LIMIT)[0]
            received += os.read(line, 4096)
    finally:
        os.close(line)
    return [each.split() for each in received.decode().splitlines()]


def test_each_servo_answers_with_the_number_of_the_question(bus: SimBus) -> None:
    assert [answer[:3] for answer in ask(bus, "7 read")] == [["7", "1", "0.00000"], ["7", "2", "0.00000"]]


@pytest.mark.parametrize("damaged", ["", "move", "move 1", "move 9 0.5", "hold 1 \xff", "dance 1 2"])
def test_a_damaged_line_is_skipped(bus: SimBus, damaged: str) -> None:
    assert len(ask(bus, damaged, "7 read")) == 2


def test_the_watchdog_holds_a_servo_that_nobody_sends_on(bus: SimBus) -> None:
    ask(bus, "hold 1 1", "move 1 100", "1 read")
    seen = []

    def rests() -> bool:
        seen.append(places(bus)[0])
        return len(seen) > 20 and seen[-1] == seen[-20] > 0.0

    until(rests)
    assert 0.0 < seen[-1] < 2.0


def test_a_limp_servo_goes_nowhere_and_a_lost_one_says_nothing(bus: SimBus) -> None:
    bus.command("lose 2")
    assert [answer[:3] for answer in ask(bus, "move 1 1.0", "1 read", answers=1)] == [["1", "1", "0.00000"]]


def test_the_cable_is_pulled_and_plugged_in(bus: SimBus) -> None:
    bus.command("unplug")
    assert not bus.path.exists()
    bus.command("plug")
    assert len(ask(bus, "1 read")) == 2


@pytest.mark.parametrize("line", ["", "dance", "stuck", "stuck 3", "stuck one", "late soon"])
def test_a_command_that_is_not_known_is_refused(bus: SimBus, line: str) -> None:
    with pytest.raises(ValueError, match="is not a command"):
        bus.command(line)


def test_a_file_at_its_path_is_left_alone(tmp_path: Path) -> None:
    (mine := tmp_path / "mine").write_text("precious")
    with pytest.raises(FileExistsError):
        SimBus(1, mine)
    assert mine.read_text() == "precious"
