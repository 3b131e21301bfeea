"""A behavior with interfaces of ROS as a process, with a robot of ROS beside it; recorded and replayed."""

from __future__ import annotations

import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from plugins.ros2.tests.support.ros_nodes import DOMAIN, Inbox
from tests.support.codegen_command import ROOT
from tests.support.commands import run_file_here, run_here
from tests.support.documents import compile_to, document, state, sub, transition
from tests.support.limits import END_LIMIT, EVENT_LIMIT, START_LIMIT
from tests.support.processes import ComponentProcess, free_endpoint
from tests.support.waiting import until
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._commands.app import app
from zenoh_ice import Settings
from zenoh_ros2 import ActionServer, Node

CODE = """
if step == 0 and self.text.latest() is not None:
    answer = self.switch.call(data=True, timeout=5.0).message
    later = self.switch.call_async(data=False)
    goal = self.count.send(order=3, timeout=5.0)
    step = 1
elif step == 1 and later.done() and goal.done and self.text.latest().value.data == "second":
    said = [later.result().message, *goal.result(5.0).sequence.tolist(), self.text.latest().age < 5.0]
    self.said.publish(data=f"{answer} {said}")
    step = 2
"""
BEHAVIOR = document(
    sub(
        1,
        0,
        state(1, "one", CODE.strip(), initial=True),
        state(2, "two"),
        transition(1, 1, 2, "step == 2", name="asked"),
        variables="step = 0",
        period="50",
    ),
    head="""<ros>
<rosinterface kind="subscribe"><name>text</name><target>/text</target><type>std_msgs/msg/String</type></rosinterface>
<rosinterface kind="publish"><name>said</name><target>said</target><type>std_msgs/msg/String</type></rosinterface>
<rosinterface kind="service"><name>switch</name><target>/switch</target><type>std_srvs/srv/SetBool</type></rosinterface>
<rosinterface kind="action"><name>count</name><target>/count</target>
<type>example_interfaces/action/Fibonacci</type></rosinterface></ros>""",
)


@contextmanager
def robot() -> Iterator[tuple[Node, str]]:
    endpoint = free_endpoint()
    with Node("robot", settings=Settings(listen=(endpoint,), connect=()), domain=DOMAIN) as node:
        yield node, endpoint


@contextmanager
def publishing(node: Node, topic: str, type_name: str, fields: dict[str, Any]) -> Iterator[None]:
    """Publish fields, which may change, at 20 Hz."""
    publisher, over = node.create_publisher(type_name, topic), threading.Event()

    def publish() -> None:
        while not over.wait(0.05):
            publisher.publish(**fields)

    thread = threading.Thread(target=publish)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join(EVENT_LIMIT)


def start(file: Path, endpoint: str, *arguments: str) -> ComponentProcess:
    ros = ["--ros-connect", endpoint, "--ros-domain", str(DOMAIN)]
    command = [sys.executable, str(file), "--connect", endpoint, "--clock", "wall", *ros, *arguments]
    return ComponentProcess(command, {"PYTHONPATH": str(ROOT)})


def replay(*arguments: Path) -> subprocess.CompletedProcess[str]:
    return run_here(app, "visualhfsm", "replay", *arguments, expected=(VisualHfsmError,))


@pytest.mark.slow
def test_a_turtlebot_is_driven_and_stopped_and_its_recording_replays(tmp_path: Path) -> None:
    text = (ROOT / "examples" / "turtlebot" / "bump_and_go.xml").read_text("utf-8")
    file, recording = compile_to(tmp_path, text, "bump_and_go"), tmp_path / "run.mcap"
    laser: dict[str, Any] = {"ranges": [2.0], "range_max": 5.0}
    with robot() as (node, endpoint), publishing(node, "/scan", "sensor_msgs/msg/LaserScan", laser):
        velocities = Inbox()
        node.create_subscription("geometry_msgs/msg/Twist", "/base/cmd_vel", velocities)
        more = ("--remap", "/cmd_vel:=/base/cmd_vel", "--speed", "0.25", "--record", str(recording))
        with start(file, endpoint, *more) as component:
            until(lambda: any(each.linear.x == 0.25 for each in velocities.messages), START_LIMIT)
            laser["ranges"] = [0.3]
            until(lambda: velocities.messages[-1].linear.x == -0.25, EVENT_LIMIT)
        assert component.wait(END_LIMIT) == 130
        until(lambda: velocities.messages[-1].linear.x == 0.0, EVENT_LIMIT)
    assert "Traceback" not in component.output, component.output
    done = replay(recording)
    assert (done.returncode, "identical" in done.stdout) == (0, True), done.stdout + done.stderr
    edited = tmp_path / "edited.xml"
    edited.write_text(text.replace("-self.speed", "-2 * self.speed"), encoding="utf-8")
    done = replay(recording, edited)
    assert "/cmd_vel.publish" in done.stdout, done.stdout + done.stderr


@pytest.mark.slow
def test_samples_services_and_goals_reach_a_component_and_its_replay(tmp_path: Path) -> None:
    file, recording = compile_to(tmp_path, BEHAVIOR, "talker"), tmp_path / "run.mcap"
    texts = {"data": "first"}
    with robot() as (node, endpoint), publishing(node, "/text", "std_msgs/msg/String", texts):
        said = Inbox()
        node.create_subscription("std_msgs/msg/String", "/lab/said", said)
        node.create_service("std_srvs/srv/SetBool", "/switch", lambda request: {"message": f"{request.data}"})

        def execute(_goal: object) -> dict[str, object]:
            texts["data"] = "second"
            return {"sequence": [1, 1, 2]}

        ActionServer(node, "example_interfaces/action/Fibonacci", "/count", execute)
        with start(file, endpoint, "--ros-namespace", "/lab", "--record", str(recording)) as component:
            until(lambda: len(said.messages) == 1, START_LIMIT)
        assert said.messages[0].data == "True ['False', 1, 1, 2, True]"
        assert component.wait(END_LIMIT) == 130, component.output
    done = replay(recording)
    assert (done.returncode, "identical" in done.stdout) == (0, True), done.stdout + done.stderr


def test_wrong_options_of_ros_are_reported(tmp_path: Path) -> None:
    file = compile_to(tmp_path, BEHAVIOR, "talker")
    connected = ("--connect", free_endpoint(), "--clock", "wall")
    done = run_file_here(file, *connected, "--remap", "/cmd_vel=/other")
    assert done.returncode == 2
    assert "--remap takes FROM:=TO" in done.stdout
    done = run_file_here(file, *connected, "--ros-connect", free_endpoint(), "--ros-namespace", "1st")
    assert done.returncode == 1
    assert "Traceback" not in done.stdout
    assert "1st" in done.stdout
