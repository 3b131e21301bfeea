"""The options of the command, and the stack that starts it."""

from __future__ import annotations

from typer.testing import CliRunner

from nao_tools._deployment.stack import load_stack, stack_path
from visualhfsm_ros2.gateway._command import app


def test_the_stack_starts_a_router_a_simulated_robot_and_the_gateway() -> None:
    router, server, gateway = load_stack(stack_path("ros")).with_variables({})
    assert router.command[:2] == ("nao", "router")
    assert (server.command[0], server.after) == ("naoserver-sim", ("router",))
    assert (gateway.command[0], gateway.after) == ("naoserver-ros2", ("naoserver",))
    outcome = CliRunner().invoke(app, [*gateway.command[1:], "--show-config"])
    assert outcome.exit_code == 0, outcome.output


def test_a_remapping_without_its_sign_is_wrong_usage() -> None:
    outcome = CliRunner().invoke(app, ["--remap", "cmd_vel"])
    assert outcome.exit_code == 2
    assert "OLD:=NEW" in outcome.output
