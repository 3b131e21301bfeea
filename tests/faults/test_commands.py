"""Commands in a wrong environment."""

from __future__ import annotations

import re
import signal
import socket
from pathlib import Path

import pytest
from typer import Typer
from typer.testing import CliRunner

import ballmover._cli
import nao_tools._command
import naoserver_sim._command
import visualhfsm._commands.app
from behaviors.dance import Dance
from hfsm_runtime.command import make_app
from naoserver.errors import RobotError
from tests.support.commands import run_here
from tests.support.limits import END_LIMIT, RUN_LIMIT
from tests.support.processes import ComponentProcess, free_endpoint, module


def test_a_port_in_use_is_named(free_robot_endpoint: str) -> None:
    with socket.create_server(("127.0.0.1", int(free_robot_endpoint.rpartition(":")[2]))):
        done = run_here(
            naoserver_sim._command.app,
            "naoserver-sim",
            "--listen",
            free_robot_endpoint,
            expected=(RobotError,),
        )
    assert done.returncode == 1
    assert free_robot_endpoint in done.stderr
    assert "in use" in done.stderr


@pytest.mark.parametrize("loaded", ["mujoco", "zenoh"])
def test_ctrl_c_in_the_middle_of_start_up_is_clean(loaded: str, free_robot_endpoint: str) -> None:
    python, *arguments = module("naoserver_sim", "--listen", free_robot_endpoint)
    with ComponentProcess([python, "-X", "importtime", *arguments]) as server:
        server.wait_for(rf"\| +{re.escape(loaded)}$")  # what it loads is printed line by line
        server.process.send_signal(signal.SIGINT)

        assert server.wait(RUN_LIMIT) in (
            130,
            -signal.SIGINT,
        )  # the signal itself while nothing needs cleaning up
        assert "Traceback" not in server.output


# Of each command a package that it imports at the beginning, and of one also what it imports late.
LOADS = {
    "naoserver-sim": (module("naoserver_sim"), ("typer",)),
    "behavior": (module("behaviors.follow_ball"), ("greenlet", "zenoh")),
    "ballmover": (module("ballmover", "green"), ("typer",)),
    "visualhfsm": (module("visualhfsm", "watch"), ("typer",)),
    "codegen": (module("codegen", "behaviors/dance.xml"), ("typer",)),
    "stack": (module("nao_tools", "stack", "demo"), ("typer",)),
}


@pytest.mark.parametrize(
    ("command", "package"),
    [(command, package) for command, packages in LOADS.values() for package in packages],
    ids=[f"{name}-{package}" for name, (_, packages) in LOADS.items() for package in packages],
)
def test_ctrl_c_while_a_command_loads_is_clean(command: list[str], package: str, tmp_path: Path) -> None:
    # In pieces, as real loading: a signal that another thread takes does not end a sleep.
    (tmp_path / f"{package}.py").write_text(
        "print('loading', flush=True)\nimport time\nfor _ in range(6000): time.sleep(0.01)\n"
    )
    with ComponentProcess(command, {"PYTHONPATH": str(tmp_path)}) as process:
        process.wait_for("loading")
        process.process.send_signal(signal.SIGINT)

        assert process.wait(END_LIMIT) == 130
        assert "Traceback" not in process.output


@pytest.mark.parametrize("number", ["nan", "inf"])
@pytest.mark.parametrize(
    ("app", "arguments"),
    [
        (make_app(Dance), ["--seconds"]),
        (make_app(Dance), ["--server-wait"]),
        (ballmover._cli.app, ["green", "--speed"]),
        (ballmover._cli.app, ["green", "--server-wait"]),
        (visualhfsm._commands.app.app, ["watch", "--seconds"]),
        (visualhfsm._commands.app.app, ["watch", "--wait"]),
        (nao_tools._command.app, ["stack", "none", "--seconds"]),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_a_number_that_is_none_is_wrong_usage(app: Typer, arguments: list[str], number: str) -> None:
    outcome = CliRunner().invoke(app, [*arguments, number])
    assert outcome.exit_code == 2
    assert "Invalid value" in outcome.output


@pytest.fixture
def free_robot_endpoint() -> str:
    return free_endpoint()
