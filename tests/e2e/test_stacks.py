"""The stacks as their users start them: a simulation with the editor, and a laboratory's robot over TLS."""

from __future__ import annotations

import signal
from pathlib import Path

import psutil
import pytest

from tests.support.limits import END_LIMIT, RUN_LIMIT, START_LIMIT
from tests.support.processes import ComponentProcess, assert_gone, free_endpoint
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
