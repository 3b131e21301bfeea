"""The stacks as their users start them: a simulation with the editor, and a laboratory's robot over TLS."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
from pathlib import Path

import psutil
import pytest

from tests.support.limits import END_LIMIT, RUN_LIMIT, START_LIMIT
from tests.support.processes import ComponentProcess, assert_gone, free_endpoint, module
from tests.support.security import Keys
from tests.support.stacks import stack_in
from tests.support.waiting import until

pytestmark = pytest.mark.slow


def child(stack: ComponentProcess, *words: str) -> psutil.Process | None:
    for process in psutil.Process(stack.process.pid).children():
        try:
            command = " ".join(process.cmdline())
        except psutil.NoSuchProcess:  # it has just ended
            continue
        if all(word in command for word in words):
            return process
    return None


def test_a_killed_ball_is_back_while_the_robot_runs_on(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    with stack_in(tmp_path, "sim", "--set", f"endpoint={free_endpoint()}") as stack:
        stack.wait_for("The editor is at http://127.0.0.1:", RUN_LIMIT)
        robot, ball = child(stack, "naoserver-sim"), child(stack, "ballmover red")
        assert robot is not None
        assert ball is not None
        ball.kill()
        stack.wait_for(r"^ball-red was terminated by SIGKILL .*; starting it again in 1 s")
        until(lambda: (again := child(stack, "ballmover red")) and again.pid != ball.pid, START_LIMIT)
        assert robot.is_running()
        assert {each.name for each in (tmp_path / "sim/logs").iterdir()} >= {"naoserver.log"}
        running = psutil.Process(stack.process.pid).children(recursive=True)
        stack.process.send_signal(signal.SIGINT)
        assert stack.wait(END_LIMIT) == 130
        assert_gone(running)
        assert "Traceback" not in stack.output


def test_a_laboratory_starts_in_order_and_roles_hold(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    keys = Keys(tmp_path / "keys").folder
    environment = os.environ | {"VISUALHFSM_CONFIG": str(keys / "student.toml")}

    def call(*words: str) -> subprocess.CompletedProcess[str]:
        command = module("nao_tools", "call", *words)
        return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=RUN_LIMIT)

    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(f"{tmp_path}/systemd")
        systemd.settimeout(RUN_LIMIT)
        options = ("--machine", "simulation")
        with stack_in(tmp_path, "lab", *options, NOTIFY_SOCKET=f"{tmp_path}/systemd") as stack:
            stack.wait_for("simulator is ready after", RUN_LIMIT)
            assert [systemd.recv(64) for _ in ("router", "simulator")] == [b"READY=1", b"READY=1"]
            assert "router is ready after" in stack.output
            assert call("Head.getPose").returncode == 0
            refused = call("Head.setPose", "0.3", "0", "0.5")
            assert refused.returncode == 1
            assert "Head.setPose" in refused.stderr
