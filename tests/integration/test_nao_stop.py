"""`nao stop`: at once, and from a terminal that holds its link open, on a fake robot."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from interfaces.nao import SafetyPrx
from naoserver.fake import FakeRobot
from tests.support.carriers import NETWORK, over_both
from tests.support.limits import END_LIMIT
from tests.support.nao_command import at, nao
from tests.support.processes import free_endpoint, module
from tests.support.relay import Relay
from tests.support.robot_server import RobotClient, eventually, served, served_to_client
from tests.support.terminal import read_until

READY = "ready: Enter or space stops the robot"


@pytest.fixture
def robot(by_environment: None) -> Iterator[RobotClient]:
    with served_to_client(FakeRobot()) as client:
        yield client


def is_stopped(robot: RobotClient) -> bool:
    return robot.proxy(SafetyPrx, "Safety").getSafetyState().stopped


class Terminal:
    """A person at a terminal in which `nao stop --ready` runs."""

    def __init__(self, process: subprocess.Popen[bytes], terminal: int) -> None:
        self.process = process
        self._terminal = terminal
        self._rest = ""  # that came with what was looked for last

    def press(self, keys: bytes) -> None:
        os.write(self._terminal, keys)

    def shows(self, text: str) -> str:
        shown, _, self._rest = read_until(self._terminal, text, self._rest).partition(text)
        return shown + text


@contextmanager
def ready(endpoint: str, realm: str, *options: str) -> Iterator[Terminal]:
    """Run the command in a separate terminal; end it if it has not ended."""
    main, terminal = os.openpty()
    command = module("nao_tools", "stop", "--ready", "hands off", *options)
    where = ["--connect", endpoint, "--realm", realm, "--listen", "tcp/127.0.0.1:0"]
    process = subprocess.Popen(
        ["setsid", "--ctty", *command, *where], stdin=terminal, stdout=terminal, stderr=terminal
    )
    os.close(terminal)
    try:
        yield Terminal(process, main)
    finally:
        if process.poll() is None:
            process.kill()
        process.wait(END_LIMIT)
        os.close(main)


def test_without_a_robot_it_says_so() -> None:
    outcome = nao("stop", "--connect", free_endpoint(), "--timeout", "0.1", "--seconds", "0.3")
    assert (outcome.code, "start a server there" in outcome.err) == (1, True)


@over_both
def test_each_key_stops_the_robot_and_ctrl_c_leaves(robot: RobotClient) -> None:
    safety = robot.proxy(SafetyPrx, "Safety")
    with ready(robot.endpoint, robot.realm) as terminal:
        terminal.shows(READY)
        for key in (b"\r", b" ", b"\x03"):
            assert not is_stopped(robot)
            terminal.press(key)
            terminal.shows("STOPPED after ")
            assert safety.getSafetyState().reason == "hands off"
            safety.resetEmergencyStop()
        assert terminal.process.wait(END_LIMIT) == 0


def test_who_is_ended_stops_nothing(robot: RobotClient) -> None:
    with ready(robot.endpoint, robot.realm) as terminal:
        terminal.shows(READY)
        terminal.press(b"x\x1b[A")
        terminal.process.send_signal(signal.SIGTERM)
        assert terminal.process.wait(END_LIMIT) == 128 + signal.SIGTERM
    assert not is_stopped(robot)


@pytest.mark.parametrize("carrier", [NETWORK])
def test_a_lost_link_is_reported_and_a_stop_is_sent_when_it_is_back_or_reported_to_who_leaves(
    robot: RobotClient,
) -> None:
    with Relay(robot.endpoint) as relay, ready(relay.endpoint, robot.realm, "--mode", "client") as terminal:
        terminal.shows(READY)
        relay.cut()
        terminal.shows("LOST: ")
        terminal.press(b"\r")
        terminal.shows(
            "NOT STOPPED: the robot is unreachable; trying again until it is; use the robot's own switch"
        )
        assert not is_stopped(robot)
        relay.resume()
        if "ready again: " not in terminal.shows("STOPPED after "):  # the stop waits for nothing
            terminal.shows("ready again: ")
        assert is_stopped(robot)

        relay.cut()
        terminal.shows("LOST: ")
        terminal.press(b"\x03")
        terminal.shows("NOT STOPPED: ")
        terminal.press(b"\x03")
        terminal.shows("the robot was NOT stopped: the robot is unreachable")
        assert terminal.process.wait(END_LIMIT) == 1


def test_it_waits_for_a_robot_that_starts_later() -> None:
    endpoint = free_endpoint()
    with ready(endpoint, "nao") as terminal:
        terminal.shows("not ready: nothing answers at ")
        with served(FakeRobot(), realm="nao", endpoint=endpoint):
            terminal.shows(READY)
            terminal.press(b"\r")
            terminal.shows("STOPPED after ")


def test_who_leaves_stops_nothing_and_the_terminal_is_left_as_it_was(robot: RobotClient) -> None:
    script = 'stty -a; "$@"; code=$?; stty -a; echo "end $code"'
    main, terminal = os.openpty()
    command = module("nao_tools", "stop", "--ready", "--connect", robot.endpoint, "--realm", robot.realm)
    process = subprocess.Popen(
        ["setsid", "--ctty", "sh", "-c", script, "sh", *command],
        stdin=terminal, stdout=terminal, stderr=terminal,
    )  # fmt: skip
    os.close(terminal)
    try:
        before = read_until(main, READY)
        os.write(main, b"x\x1b[A")
        os.write(main, b"q")
        after = read_until(main, "\nend 0")
        assert process.wait(END_LIMIT) == 0
        assert not is_stopped(robot)
    finally:
        if process.poll() is None:
            process.kill()
            process.wait(END_LIMIT)
        os.close(main)
    modes = [set(text[text.index("speed") : text.rindex("echok")].split()) for text in (before, after)]
    assert modes[0] == modes[1]


def test_without_a_terminal_it_does_not_wait_for_keys(robot: RobotClient) -> None:
    with at(robot.endpoint, robot.realm):
        outcome = nao("stop", "--ready")
    assert (outcome.code, "needs a terminal" in outcome.err) == (1, True)
    eventually(lambda: not is_stopped(robot))
