"""The options of the command, and the stack that starts it."""

from __future__ import annotations

from typer.testing import CliRunner

from deploy.stack import load_stack, stack_path
from naoserver_ros2.command import app


def test_the_stack_starts_it_beside_a_simulated_robot() -> None:
    server, gateway = load_stack(stack_path("ros")).with_variables({})
    assert (server.command[0], gateway.command[0], gateway.after) == (
        "naoserver-sim",
        "naoserver-ros2",
        ("naoserver",),
    )
    outcome = CliRunner().invoke(app, [*gateway.command[1:], "--show-config"])
    assert outcome.exit_code == 0, outcome.output


def test_a_remapping_without_its_sign_is_wrong_usage() -> None:
    outcome = CliRunner().invoke(app, ["--remap", "cmd_vel"])
    assert outcome.exit_code == 2
    assert "OLD:=NEW" in outcome.output
