"""The server of a robot's own hardware as a process: its start, its end, and what operators see of a loss."""

from __future__ import annotations

import os
import pty
import runpy
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest

from naoserver.hardware.sim_bus import SimBus
from tests.support.limits import END_LIMIT, RUN_LIMIT
from tests.support.places import ROOT
from tests.support.processes import STEADY, ComponentProcess, free_endpoint, module

SERVER: Final = str(ROOT / "visualhfsm/_commands/template_hardware/server.py")


@pytest.fixture
def bus(tmp_path: Path) -> Iterator[SimBus]:
    bus = SimBus(4, tmp_path / "tty")
    yield bus
    bus.close()


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    """That of a server and its operator."""
    return {**STEADY, "PYTHONPATH": str(ROOT), "XDG_STATE_HOME": str(tmp_path), "VISUALHFSM_REALM": "own"}


def serving(bus: SimBus, endpoint: str, environment: dict[str, str], *options: str) -> ComponentProcess:
    command = [sys.executable, SERVER, "--bus", str(bus.path), "--listen", endpoint, *options]
    return ComponentProcess(command, environment)


def nao(environment: dict[str, str], *words: str) -> tuple[int, str]:
    """Return the exit code of `nao`, and what it prints."""
    done = subprocess.run(
        [sys.executable, "-m", "nao_tools", *words],
        env={**environment, "COLUMNS": "200"},
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=False,
    )
    return done.returncode, done.stdout + done.stderr


@pytest.mark.slow
def test_operators_see_that_no_command_reaches_a_robot_whose_cable_is_out(
    bus: SimBus, environment: dict[str, str]
) -> None:
    endpoint = free_endpoint()
    client = {**environment, "VISUALHFSM_CONNECT": endpoint}
    with serving(bus, endpoint, environment) as server:
        server.wait_for(f"^ready: realm own, {endpoint}, bus {bus.path}")
        bus.command("unplug")
        server.wait_for("lost the robot")
        code, said = nao(client, "stop")
        assert code == 1
        assert "stopped, but the robot is lost" in said
        assert "no command reaches the robot" in nao(client, "status")[1]
        code, said = nao(client, "doctor")
        assert code == 1
        assert "no command reaches it" in said


def test_a_bus_that_is_not_there_is_said_in_one_line(tmp_path: Path, environment: dict[str, str]) -> None:
    missing = tmp_path / "ttyUSB9"
    done = subprocess.run(
        [sys.executable, SERVER, "--bus", str(missing), "--listen", free_endpoint()],
        env=environment,
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=False,
    )
    assert done.returncode == 1
    assert f"there is no link to the robot: {missing}: No such file or directory" in done.stderr
    assert "Traceback" not in done.stderr


def test_two_servers_do_not_share_a_bus_and_a_file_is_none(
    bus: SimBus, tmp_path: Path, environment: dict[str, str]
) -> None:
    (file := tmp_path / "file").touch()
    with serving(bus, free_endpoint(), environment) as server:
        server.wait_for("^ready")
        for path, why in ((bus.path, "another server has it"), (file, "it is no serial line")):
            other = [sys.executable, SERVER, "--bus", str(path), "--listen", free_endpoint()]
            with ComponentProcess(
                other, {**environment, "XDG_STATE_HOME": str(tmp_path / "other")}
            ) as second:
                second.wait_for(f"{path}: {why}")
                assert second.wait(END_LIMIT) == 1


def test_noise_on_the_line_costs_an_answer_and_not_the_robot() -> None:
    ours, theirs = pty.openpty()
    bus = runpy.run_path(SERVER)["Bus"](os.ttyname(theirs))
    noise = [
        b"\xff\xfe",
        b"1",
        b"",
        b"1 99 0 0 0 35 1 0",
        b"1 2 0 0 0 35 1 x",
        b"0 3 0 0 0 35 1 0",
        b"x" * 2000,
    ]
    os.write(ours, b"\n".join([*noise, b"1 1 0.5 0 0 35 1 0", *noise]))
    assert {name: servo.position for name, servo in bus.read().items()} == {"pan": 0.5}
    bus.close()
    os.close(ours)
    os.close(theirs)


def test_any_robot_is_served_also_one_that_is_never_lost(environment: dict[str, str]) -> None:
    program = (
        "from naoserver.fake import FakeRobot; from naoserver.hardware.serving import serve_hardware; "
        f"from zenoh_ice.settings import Settings; serve_hardware(FakeRobot(), Settings(listen=('{free_endpoint()}',)))"
    )
    with ComponentProcess([sys.executable, "-c", program], environment) as server:
        server.wait_for("^ready")
        server.process.terminate()
        assert server.wait(END_LIMIT) == 143


def test_the_bus_as_a_program_takes_its_commands_from_standard_input(tmp_path: Path) -> None:
    command = module("naoserver.hardware.sim_bus", str(tmp_path / "tty"), "--servos", "2")
    with subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={"PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"},
    ) as bus:
        assert bus.stdin is not None
        assert bus.stdout is not None
        printed = [bus.stdout.readline()]
        for line in ("stuck 2", "stuck 3"):
            bus.stdin.write(f"{line}\n")
            bus.stdin.flush()
            printed.append(bus.stdout.readline())
        bus.kill()
    assert printed == [
        f"ready: {tmp_path / 'tty'}\n",
        "done\n",
        "'stuck 3' is not a command of the bus, or of one of its servos\n",
    ]
