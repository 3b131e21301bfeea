"""The options of ROS in the command of a component."""

from __future__ import annotations

from contextlib import nullcontext

from typer.testing import CliRunner

from codegen.hfsm._checks.component import STANDARD_OPTIONS
from hfsm_runtime import Component
from hfsm_runtime.command import make_app
from visualhfsm_ros2.options import options


class Plain(Component, document="plain.xml"):
    """Nothing."""


def test_no_parameter_can_have_the_name_of_one() -> None:
    assert {each.name for each in options()} <= STANDARD_OPTIONS


def test_a_dry_run_has_no_node() -> None:
    def never(_communicator: object) -> nullcontext[None]:
        raise AssertionError

    refused = CliRunner().invoke(make_app(Plain, never), ["--ros"])  # type: ignore[arg-type]
    assert refused.exit_code == 2
    assert "a dry run takes no --ros" in refused.output
