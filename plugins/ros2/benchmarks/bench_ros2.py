"""Measure ROS 2: our node beside genuine rclpy, what the gateway adds, and how surely nodes are found.

`calls`, `stream`, `array`, `image` and `large`: both sides of each pair are processes on this machine, with
the same messages, pair after pair: ours over Zenoh (TCP on loopback), rclpy over Fast DDS (loopback and
shared memory, its default). Without the peers, which `make ros-peers` installs, only ours are measured.

`gateway`: a fake robot and naoserver-ros2 run in separate processes. This process follows the joints twice:
as a client of the robot server, and as a node of ROS; `added` is by how much the same sample, whose head
stands where it never stood before, comes later over ROS. It is measured with /joint_states alone, and with
/tf and /odom besides. `share` is the gateway's processor time as a share of a core.

`discovery`: a router, a fake robot and the gateway run in separate processes. Nodes with the session settings
of rmw_zenoh open in groups, each with a new gateway. Each waits for /joint_states and for a message of every
other node of its group. Without a router, nodes connect to the robot server: they find the robot, but not
each other.

    python plugins/ros2/benchmarks/bench_ros2.py [--quick] [--seconds 10] [--nodes 50] [PART...]
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any, Final

import psutil

from benchmarks.common import parts, used
from interfaces.nao import JointsPrx, JointState, PoseHeadPrx
from plugins.ros2.tests.support.rmw_zenoh import GenuineNode
from plugins.ros2.tests.support.ros_peers import peers_folder
from tests.support.places import ROOT
from tests.support.ports import free_port
from tests.support.processes import ComponentProcess, free_endpoint, module
from zenoh_ice import Sample, Settings, initialize
from zenoh_ros2 import Node, QoS, Types

ROUNDS = 5
TASKS = {"calls": 2000, "stream": 10_000, "array": 600, "image": 600, "large": 200}
NAMES = {
    "calls": "call of a service, 3 strings",
    "stream": "100 Hz each way, /clock",
    "array": "30 Hz, 115,200 int64 (921,600 bytes)",
    "image": "30 Hz, sensor_msgs/Image, 640x480 rgb8",
    "large": "10 Hz, sensor_msgs/Image, 1280x960 rgb8",
}
ADDED: Final = 1.0
"""The largest median delay in ms."""
_WARM_UP: Final = 2.0
_SWING: Final = 0.4
"""Seconds between two turns of the head."""
LIMIT: Final = 10.0
"""Seconds within which nodes are to find each other."""
_PAUSE: Final = 0.02
JOINTS: Final = "sensor_msgs/msg/JointState"
TEXT: Final = "std_msgs/msg/String"


def measure_pair(library: str, task: str, number: int) -> list[dict[str, Any]]:
    """Run both sides of a task; return the figures of each."""
    python = sys.executable if library == "ours" else str(peers_folder() / "bin" / "python")
    port = str(free_port())
    environment = os.environ | {"PYTHONPATH": str(ROOT), "ROS_LOCALHOST_ONLY": "1"}
    script = str(Path(__file__).with_name("ros2_node.py"))
    sides = [
        subprocess.Popen(
            [python, script, library, task, side, str(number), port],
            env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )
        for side in "ab"
    ]  # fmt: skip
    try:
        first, errors = sides[0].communicate(timeout=900)
        second, more = sides[1].communicate(timeout=900)
    finally:
        for each in sides:
            each.kill()
    found = [
        [json.loads(line) for line in text.splitlines() if line.startswith("{")] for text in (first, second)
    ]
    if not all(found):
        raise SystemExit(f"{library}, {task}: {errors}{more}")
    return [each[-1] for each in found]


def row(library: str, task: str, sides: list[dict[str, Any]]) -> dict[str, float]:
    """Print a line of the table; return its figures."""
    ages = sorted(age for each in sides for age in each.get("ages", ()))
    sent, received = (sum(each.get(name, 0) for each in sides) for name in ("sent", "received"))
    median, late = (
        (ages[int(len(ages) * part)] / 1e6 for part in (0.5, 0.99)) if ages else (float("nan"),) * 2
    )
    lost = f"{sent - received} of {sent}" if sent else "-"
    processor = sum(each["processor"] for each in sides)
    print(f"| {NAMES[task]} | {library} | {median:.2f} | {late:.2f} | {lost} | {processor:.1f} |", flush=True)
    return {"median": median, "99 %": late, "processor": processor}


def measure_gateway(
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
                    before = used(gateway)
                time.sleep(_SWING)
            share = (used(gateway) - before) / seconds
    return [1e3 * (over_ros[place] - direct[place]) for place in direct if place in over_ros], share


def measure_discovery(endpoint: str, count: int, types: Types) -> tuple[list[float], int]:
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


def compare(tasks: list[str], given: argparse.Namespace) -> bool:
    """Print a table of our node and rclpy; return True."""
    genuine = (peers_folder() / "bin" / "python").exists()
    if not genuine:
        print(f"genuine rclpy is not in {peers_folder()}: make ros-peers installs it\n")
    print("| what | library | median, ms | 99 %, ms | lost | processor, s |\n|---|---|---|---|---|---|")
    ratios = []
    for task in tasks:
        libraries = ["ours", "rclpy"] if genuine else ["ours"]
        found: dict[str, list[dict[str, Any]]] = {library: [] for library in libraries}
        for _ in range(ROUNDS):  # in turn, since a machine is busier at some times than at others
            for library in libraries:
                number = TASKS[task] // ROUNDS // (10 if given.quick else 1)
                found[library] += measure_pair(library, task, number)
        ours, *theirs = (row(library, task, sides) for library, sides in found.items())
        ratios += [
            f"{NAMES[task]}: " + ", ".join(f"{k} {ours[k] / each[k]:.2f}" for k in ours) for each in theirs
        ]
    if ratios:
        print("\nours : rclpy (below 1 is less)\n" + "\n".join(f"- {each}" for each in ratios))
    return True


def add(given: argparse.Namespace) -> bool:
    """Print what the gateway adds; return whether that is little enough."""
    endpoint, medians = free_endpoint(), []
    more = {"/tf": "tf2_msgs/msg/TFMessage", "/odom": "nav_msgs/msg/Odometry"}
    with ComponentProcess(module("naoserver.fake", "--listen", endpoint)) as server:
        server.wait_for("^ready")
        for topics in ({}, more):
            with ComponentProcess(module("visualhfsm_ros2.gateway", "--connect", endpoint)) as gateway:
                gateway.wait_for("^ready")
                process = psutil.Process(gateway.process.pid)
                added, share = measure_gateway(endpoint, given.seconds, topics, process)
            tenth, *_, last = statistics.quantiles(added, n=10)
            medians.append(statistics.median(added))
            print(
                f"{' '.join(['/joint_states', *topics])}: added {medians[-1]:.2f} ms "
                f"(10 % under {tenth:.2f}, 90 % under {last:.2f}) of {len(added)} samples; share {share:.1%}"
            )
    return medians[0] <= ADDED


def discover(given: argparse.Namespace) -> bool:
    """Print how surely nodes are found; return whether all found all that they should."""
    endpoint, own, types = free_endpoint(), "tcp/127.0.0.1:0", Types()
    delays: list[float] = []
    met = possible = 0
    with ExitStack() as processes:
        server = ["--listen", endpoint]
        if not given.without_router:
            command = module("nao_tools", "router", "--listen", endpoint)
            processes.enter_context(ComponentProcess(command)).wait_for("the router listens")
            server = ["--listen", own, "--connect", endpoint]
        robot = ComponentProcess(module("naoserver.fake", *server))
        processes.enter_context(robot).wait_for("^ready")
        for first in range(0, given.nodes, given.together):
            count = min(given.together, given.nodes - first)
            with ComponentProcess(module("visualhfsm_ros2.gateway", "--connect", endpoint)) as gateway:
                gateway.wait_for("^ready")
                group, pairs = measure_discovery(endpoint, count, types)
            delays += group
            met += pairs
            possible += count * (count - 1)
    median, last = statistics.median(delays or [0.0]), max(delays, default=0.0)
    print(
        f"{len(delays)} of {given.nodes} nodes found the robot: {median:.2f} s median, {last:.2f} s at most"
    )
    print(f"{met} of {possible} pairs of nodes met")
    return len(delays) == given.nodes and (met == possible or given.without_router)


def main() -> None:
    """Print the figures; exit with 1 if a limit is exceeded."""
    measured = {task: partial(compare, [task]) for task in TASKS} | {"gateway": add, "discovery": discover}
    fine = parts(__doc__, measured, quick=False, seconds=10.0, nodes=50, together=10, without_router=False)
    sys.exit(not all(fine))


if __name__ == "__main__":
    main()
