"""ballmover while its server dies, is offline, and returns."""

from __future__ import annotations

import signal
import time
from contextlib import ExitStack
from pathlib import Path

import pytest

from ballmover._cli import app
from interfaces.jderobot import Pose3DEncodersPrx
from tests.support.commands import run_here
from tests.support.limits import END_LIMIT, RUN_LIMIT, START_LIMIT
from tests.support.processes import ComponentProcess, announced, module
from tests.support.robot_server import HASTE
from tests.support.soak import cases
from tests.support.waiting import until
from zenoh_ice import initialize

DEBUG = ("--log-level", "debug", "--speed", "0.9")
SOON = {"VISUALHFSM_LEASE": "1.0"}
"""The environment of processes that notice soon that others stand still."""


def serve(endpoint: str) -> ComponentProcess:
    return ComponentProcess(module("naoserver.fake", "--listen", endpoint), SOON)


def test_without_a_server_it_says_where_it_looked_and_how_to_start_one(endpoint: str) -> None:
    done = run_here(
        app, "ballmover", "green", "--connect", endpoint, "--timeout", "0.2", "--server-wait", "0"
    )
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert endpoint in done.stderr
    assert "naoserver-sim" in done.stderr


def test_started_before_its_server_it_waits_for_it(endpoint: str, tmp_path: Path) -> None:
    file = tmp_path / "path.csv"
    file.write_text("0.9,0.2,0.5\n")
    command = module(
        "ballmover", "green", str(file), "--once", "--connect", endpoint, "--timeout", str(HASTE), *DEBUG
    )
    with ComponentProcess(command) as mover:
        mover.wait_for(f"waiting for the server .*{endpoint}")
        with serve(endpoint):
            assert mover.wait(RUN_LIMIT) == 0


def test_a_server_that_hangs_or_is_killed_is_waited_for_but_not_at_the_end(endpoint: str) -> None:
    with ExitStack() as stack:
        server = stack.enter_context(serve(endpoint))
        server.wait_for("ready")
        command = module("ballmover", "green", "--connect", endpoint, *DEBUG)
        mover = stack.enter_context(ComponentProcess(command, SOON))
        mover.wait_for("waypoint 1 of")
        server.process.send_signal(signal.SIGSTOP)
        try:
            mover.wait_for("lost the ball")
        finally:
            server.process.send_signal(signal.SIGCONT)
        mover.wait_for("the ball is back")
        mover.wait_for("waypoint 2 of")

        server.process.kill()
        server = stack.enter_context(serve(endpoint))
        until(lambda: mover.output.count("the ball is back") == 2, START_LIMIT)
        with initialize(connect=[endpoint]) as communicator:
            encoders = Pose3DEncodersPrx.checkedCast(communicator.stringToProxy("BallGreenEncoders"))
            moves = encoders.getPose3DEncodersData.samples(timeout=START_LIMIT)
            first = next(moves).value
            assert any(sample.value != first for sample in moves), "it stays where the restart has put it"

        losses = mover.output.count("lost the ball")
        server.process.kill()
        until(lambda: mover.output.count("lost the ball") > losses, START_LIMIT)
        mover.process.send_signal(signal.SIGINT)
        assert mover.wait(END_LIMIT) == 130
        assert "Traceback" not in mover.output


@pytest.mark.parametrize("delay", cases([0.1], [0.0, 0.05, 0.15, 0.2, 0.25, 0.3]))
def test_a_signal_in_the_middle_of_the_start_is_a_clean_end(endpoint: str, delay: float) -> None:
    with serve(endpoint) as server:
        server.wait_for("ready")
        with ComponentProcess(announced("ballmover.__main__", "green", "--connect", endpoint)) as mover:
            mover.wait_for("starting")
            time.sleep(delay)  # s; any moment will do
            mover.process.send_signal(signal.SIGINT)
            assert mover.wait(END_LIMIT) == 130
            assert "Traceback" not in mover.output
