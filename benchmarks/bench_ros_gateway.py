"""Measure what naoserver-ros2 adds to a joint state, and what it costs.

A fake robot and the gateway run in separate processes. This process follows the joints twice: as a client
of the robot server, and as a node of ROS; `added` is by how much the same sample, whose head stands where it
never stood before, comes later over ROS. It is measured with /joint_states alone, and with /tf and /odom
besides. `share` is the gateway's processor time as a share of a core.

    python benchmarks/bench_ros_gateway.py [--seconds 10]
"""

from __future__ import annotations

import argparse
import re
import statistics
import sys
import time
from pathlib import Path
from typing import Any, Final

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import psutil

from interfaces.nao import JointsPrx, JointState, PoseHeadPrx
from tests.support.processes import ComponentProcess, free_endpoint, module
from zenoh_ice import Sample, Settings, initialize
from zenoh_ros2 import Node, QoS

ADDED: Final = 1.0
"""The largest median delay in ms."""
_WARM_UP: Final = 2.0
_SWING: Final = 0.4
"""Seconds between two turns of the head."""


def measure(
    endpoint: str, seconds: float, topics: dict[str, str], gateway: psutil.Process
) -> tuple[list[float], float]:
    """Return by how many ms each joint state comes later over ROS, and the gateway's share of a core."""
    direct: dict[float, float] = {}
    over_ros: dict[float, float] = {}

    def come(sample: Sample[JointState]) -> None:
        direct[sample.value.positions[0]] = time.perf_counter()

    def come_over_ros(message: Any) -> None:  # noqa: ANN401
        over_ros[float(message.position[0])] = time.perf_counter()

    settings = Settings(connect=(endpoint,))
    with (
        initialize(connect=[endpoint], clock="wall") as communicator,
        Node("bench", settings=settings) as node,
    ):
        node.create_subscription("sensor_msgs/msg/JointState", "/joint_states", come_over_ros)
        for name, kind in topics.items():
            node.create_subscription(kind, name, qos=QoS(depth=100))
        body = JointsPrx.checkedCast(communicator.stringToProxy("Body"))
        head = PoseHeadPrx.checkedCast(communicator.stringToProxy("Head"))
        with body.getJointState.subscribe(come, queue=100):
            begun, turns, before = time.monotonic(), 0, 0.0
            while (now := time.monotonic()) < begun + _WARM_UP + seconds:
                turns += 1
                head.setPose((-1.0) ** turns * (1.0 + 0.001 * (turns % 50)), 0.0, 0.2)
                if now < begun + _WARM_UP:
                    direct.clear()
                    before = sum(gateway.cpu_times()[:2])
                time.sleep(_SWING)
            share = (sum(gateway.cpu_times()[:2]) - before) / seconds
    return [1e3 * (over_ros[place] - direct[place]) for place in direct if place in over_ros], share


def main() -> None:
    """Print the figures; exit with 1 if the limit is exceeded."""
    parser = argparse.ArgumentParser(description=re.sub(r"\n.*", "", __doc__ or ""))
    parser.add_argument("--seconds", type=float, default=10.0)
    seconds = parser.parse_args().seconds
    endpoint, medians = free_endpoint(), []
    more = {"/tf": "tf2_msgs/msg/TFMessage", "/odom": "nav_msgs/msg/Odometry"}
    with ComponentProcess(module("naoserver.fake", "--listen", endpoint)) as server:
        server.wait_for("^ready")
        for topics in ({}, more):
            with ComponentProcess(module("visualhfsm_ros2.gateway", "--connect", endpoint)) as gateway:
                gateway.wait_for("^ready")
                added, share = measure(endpoint, seconds, topics, psutil.Process(gateway.process.pid))
            tenth, *_, last = statistics.quantiles(added, n=10)
            medians.append(statistics.median(added))
            names, spread = (
                " ".join(["/joint_states", *topics]),
                f"10 % under {tenth:.2f}, 90 % under {last:.2f}",
            )
            print(
                f"{names}: added {medians[-1]:.2f} ms ({spread}) of {len(added)} samples; share {share:.1%}"
            )
    sys.exit(1 if medians[0] > ADDED else 0)


if __name__ == "__main__":
    main()
