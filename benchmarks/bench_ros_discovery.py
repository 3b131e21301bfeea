"""Measure how surely and how soon nodes of ROS find the robot, and each other.

A router, a fake robot and the gateway run in separate processes. Nodes with the session settings of rmw_zenoh
open in groups, each with a new gateway. Each waits for /joint_states and for a message of every other node
of its group. Without a router, nodes connect to the robot server: they find the robot, but not each other.

    python benchmarks/bench_ros_discovery.py [--nodes 50] [--together 10] [--without-router]
"""

from __future__ import annotations

import argparse
import re
import statistics
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Final

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests.support.processes import ComponentProcess, free_endpoint, module
from tests.support.rmw_zenoh import GenuineNode
from zenoh_ros2 import Types

LIMIT: Final = 10.0
"""Seconds within which nodes are to find each other."""
_PAUSE: Final = 0.02
JOINTS: Final = "sensor_msgs/msg/JointState"
TEXT: Final = "std_msgs/msg/String"


def measure(endpoint: str, count: int, types: Types) -> tuple[list[float], int]:
    """Return after how many s each node that found the robot did so, and how many pairs of nodes met."""
    joints, text = types.hash(JOINTS), types.hash(TEXT)
    found: dict[int, float] = {}
    with ExitStack() as opened:
        nodes = [opened.enter_context(GenuineNode(f"node{number}", endpoint)) for number in range(count)]
        begun = time.monotonic()
        states = [node.hear(JOINTS, joints, "/joint_states") for node in nodes]
        chatter = [node.hear(TEXT, text, "/chatter") for node in nodes]
        while (now := time.monotonic()) < begun + LIMIT:
            for number, node in enumerate(nodes):
                node.publish(TEXT, text, "/chatter", bytes([number]))
                if states[number]:
                    found.setdefault(number, now - begun)
            if len(found) == count and all(len(heard) == count for heard in chatter):
                break
            time.sleep(_PAUSE)
    return [*found.values()], sum(max(0, len(heard) - 1) for heard in chatter)


def main() -> None:
    """Print the figures; exit with 1 unless all nodes found all that they should."""
    parser = argparse.ArgumentParser(description=re.sub(r"\n.*", "", __doc__ or ""))
    parser.add_argument("--nodes", type=int, default=50)
    parser.add_argument("--together", type=int, default=10)
    parser.add_argument("--without-router", action="store_true")
    asked = parser.parse_args()
    endpoint, own, types = free_endpoint(), "tcp/127.0.0.1:0", Types()
    delays: list[float] = []
    met = possible = 0
    with ExitStack() as processes:
        server = ["--listen", endpoint]
        if not asked.without_router:
            command = module("nao_tools", "router", "--listen", endpoint)
            processes.enter_context(ComponentProcess(command)).wait_for("the router listens")
            server = ["--listen", own, "--connect", endpoint]
        robot = ComponentProcess(module("naoserver.fake", *server))
        processes.enter_context(robot).wait_for("^ready")
        for first in range(0, asked.nodes, asked.together):
            count = min(asked.together, asked.nodes - first)
            with ComponentProcess(module("visualhfsm_ros2.gateway", "--connect", endpoint)) as gateway:
                gateway.wait_for("^ready")
                group, pairs = measure(endpoint, count, types)
            delays += group
            met += pairs
            possible += count * (count - 1)
    median, last = statistics.median(delays or [0.0]), max(delays, default=0.0)
    print(
        f"{len(delays)} of {asked.nodes} nodes found the robot: {median:.2f} s median, {last:.2f} s at most"
    )
    print(f"{met} of {possible} pairs of nodes met")
    sys.exit(0 if len(delays) == asked.nodes and (met == possible or asked.without_router) else 1)


if __name__ == "__main__":
    main()
