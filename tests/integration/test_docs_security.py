"""The page about security: its five commands, the router in a separate process."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from contextlib import closing
from pathlib import Path

from nao_tools._command import app
from naoserver.fake import FakeRobot
from naoserver.serving.server import serve
from tests.support.commands import run_here
from tests.support.pages import DOCS
from tests.support.ports import free_port
from tests.support.processes import REPOSITORY, ComponentProcess
from zenoh_ice import initialize
from zenoh_ice.settings import load_settings


def commands(folder: Path) -> list[list[str]]:
    """Return the commands of the page as they are run here: the machine is this one, the keys are the test's."""
    page = (DOCS / "how-to/security.md").read_text("utf-8")
    block = re.search(r"## In five commands\n.*?```sh\n(.*?)```", page, re.S)
    assert block is not None
    text = block[1].replace("robotlab.local", "127.0.0.1").replace("keys", shlex.quote(str(folder)))
    return [shlex.split(line, comments=True) for line in text.splitlines()]


def module(words: list[str]) -> list[str]:
    assert words[0] == "nao"
    return [sys.executable, "-m", "nao_tools", *words[1:]]


def run(command: list[str]) -> subprocess.CompletedProcess[str]:
    return run_here(app, *command, cwd=REPOSITORY)


def test_the_five_commands(tmp_path: Path) -> None:
    init, router, robot, call, add = commands(tmp_path / "keys")
    port, operator_port = (str(free_port()) for _ in range(2))
    made = run([*init, "--port", port, "--operator-port", operator_port])
    assert made.returncode == 0, made.stderr
    # Rather than to the network:
    listen = [word for each in (port, operator_port) for word in ("--listen", f"tls/127.0.0.1:{each}")]
    with ComponentProcess(module([*router, *listen])) as routing:
        routing.wait_for(
            "listens on tls/.*; each may do what the roles robot, operator, gateway, student, agent grant"
        )
        settings = load_settings(robot[-1], defaults={"clock": "wall"})
        with closing(FakeRobot()) as fake, initialize(settings) as communicator:
            fake.start()
            adapter = communicator.createObjectAdapter("Robot")
            adapter.activate()
            with serve(fake, adapter):
                pose = run(call)
                assert (pose.returncode, "pan" in pose.stdout) == (0, True), pose.stderr
                routing.wait_for("'student' came")
                moved = run([*call[:2], "Head.setPose", "0.3", "0", "0.5", *call[3:]])
                assert moved.returncode == 1
                assert "Head.setPose" in moved.stderr
                added = run(add)
                assert (added.returncode, "ann.toml" in added.stdout) == (0, True), added.stderr
                routing.wait_for("'student' left")
