"""The stack for ROS as its users start it: genuine nodes find the simulated robot."""

from __future__ import annotations

import subprocess
from contextlib import ExitStack
from pathlib import Path

import pytest

from plugins.ros2.tests.support.rmw_zenoh import GREATEST, SMALLEST, GenuineNode
from tests.support.limits import RUN_LIMIT, START_LIMIT
from tests.support.processes import free_endpoint, module
from tests.support.stacks import stack_in
from tests.support.waiting import until
from zenoh_ros2 import Types

CLOCK, TEXT = "rosgraph_msgs/msg/Clock", "std_msgs/msg/String"
CLOCK_HASH, TEXT_HASH = (Types().hash(name) for name in (CLOCK, TEXT))


@pytest.mark.slow
def test_genuine_nodes_find_the_robot_and_each_other_in_the_stack_for_ros(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    endpoint = free_endpoint()
    options = ("--set", f"endpoint={endpoint}", "--set", f"ros={endpoint}")
    with stack_in(tmp_path, "ros", *options) as stack, ExitStack() as opened:
        stack.wait_for("gateway is ready after", RUN_LIMIT)
        nodes = [
            opened.enter_context(GenuineNode(f"genuine{number}", endpoint, session_id=each))
            for number, each in enumerate((SMALLEST, GREATEST))
        ]
        clocks = [node.hear(CLOCK, CLOCK_HASH, "/clock") for node in nodes]
        chatter = [node.hear(TEXT, TEXT_HASH, "/chatter") for node in nodes]

        def met() -> bool:
            for number, node in enumerate(nodes):
                node.publish(TEXT, TEXT_HASH, "/chatter", bytes([number]))
            return all(clocks) and all(len(heard) == len(nodes) for heard in chatter)

        until(met, START_LIMIT)
        stopped = subprocess.run(
            module("nao_tools", "stop", "--connect", endpoint),
            capture_output=True,
            text=True,
            timeout=RUN_LIMIT,
        )
        assert stopped.returncode == 0, stopped.stderr
