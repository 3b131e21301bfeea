"""Users of one router of ROS, one of whom disturbs the robot of another, over real TLS links.

The robot and its gateway have the namespace /blue; `red` may do everything with /red, and nothing with /blue.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from queue import SimpleQueue
from typing import Any

import pytest
import zenoh

from interfaces.nao import JointsPrx
from plugins.ros2.tests.support.ros_lab import Lab, secured_lab
from tests.support.limits import EVENT_LIMIT
from tests.support.robot_server import eventually
from tests.support.security import Keys
from zenoh_ros2 import Node, Publisher
from zenoh_ros2._graph import MOST_OF_A_NAME
from zenoh_ros2._wire import Entity, EntityKind, key

ANGLES = "naoqi_bridge_msgs/msg/JointAnglesWithSpeed"
TEXT = "std_msgs/msg/String"
HASH = f"RIHS01_{'0' * 64}"


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    keys = Keys(tmp_path_factory.mktemp("keys"))
    for color in ("red", "blue"):
        called = ", ".join(f'"/{color}/{name}"' for name in ("**", "cmd_vel", "joint_angles"))
        keys.add_role(color, f'ros_call = [{called}]\nros_read = ["**"]\nros_serve = ["/{color}/own/**"]')
    with secured_lab(keys, "/blue") as lab:
        yield lab


@pytest.fixture
def red(lab: Lab) -> Iterator[Node]:
    with lab.node("red") as node:
        yield node


@pytest.fixture
def blue(lab: Lab) -> Iterator[Node]:
    with lab.node("blue") as node:
        yield node


def declare(session: zenoh.Session, *tokens: str) -> list[Any]:
    return [session.liveliness().declare_token(token) for token in tokens]


def token(kind: EntityKind, name: str, number: int = 0, *, session: str = "f00") -> str:
    return Entity(kind, 0, session, 0, number, "/", "forger", name, TEXT, HASH).token()


def position(lab: Lab) -> float:
    """Return where the robot's first joint is, HeadYaw."""
    body = JointsPrx.checkedCast(lab.nao.stringToProxy("Body"))
    return float(body.getJointState().positions[0])


def turn(node: Node, angle: float, speed: float) -> Publisher:
    """Send the robot's head to an angle."""
    angles = node.create_publisher(ANGLES, "/blue/joint_angles")
    eventually(lambda: angles.heard)
    angles.publish(joint_names=["HeadYaw"], joint_angles=[angle], speed=speed)
    return angles


def test_a_role_announces_only_what_it_may_do(lab: Lab, red: Node) -> None:
    own: list[tuple[EntityKind, str]] = [
        ("MP", "/red/cmd_vel"),
        ("SC", "/red/nao/emergency_stop"),
        ("MS", "/blue/joint_states"),
        ("SS", "/red/own/reset"),
        ("MP", "/red/own/map"),
    ]
    others: list[tuple[EntityKind, str]] = [
        ("MP", "/blue/cmd_vel"),
        ("SC", "/blue/nao/emergency_stop"),
        ("SS", "/blue/own/reset"),
        ("SS", "/red/nao/emergency_stop"),
        ("MP", "/red/joint_states"),
        ("MP", "/redfake/cmd_vel"),
        ("MP", "/redfake"),
        ("MP", "/cmd_vel"),
    ]
    declared = declare(red.session, *(token(*each) for each in [*others, *own]))
    with lab.node("operator") as operator:

        def announced() -> set[tuple[str, str]]:
            return {(each.kind, each.name) for each in operator.graph.entities() if each.node == "forger"}

        assert operator.graph.wait(lambda: {*own} <= announced(), EVENT_LIMIT)
        assert announced() == {*own}
        assert operator.graph.wait(lambda: "/node_of_red" in operator.graph.nodes(), EVENT_LIMIT)
    for each in declared:
        each.undeclare()


def test_who_may_command_a_robot_does_not_speak_for_it(lab: Lab, blue: Node) -> None:
    heard: SimpleQueue[str] = SimpleQueue()
    voices = [key(0, name, TEXT, HASH) for name in ("/blue/joint_states", "/tf", "/clock")]
    command = key(0, "/blue/cmd_vel", TEXT, HASH)
    with lab.node("operator") as operator:
        for each in (*voices, command):
            operator.session.declare_subscriber(each, lambda sample: heard.put(str(sample.key_expr)))
        commander: Any = blue.session.declare_publisher(command)
        eventually(lambda: commander.matching_status.matching)
        for each in (*voices, key(0, "/blue/*", TEXT, HASH), key(0, "/**", TEXT, HASH)):
            blue.session.put(each, b"")
        commander.put(b"")
        assert heard.get(timeout=EVENT_LIMIT) == command


def test_nobody_keeps_a_commander_of_another_robot_alive(
    lab: Lab, red: Node, caplog: pytest.LogCaptureFixture
) -> None:
    goal = position(lab) + 1.0
    with lab.node("blue") as blue, caplog.at_level(logging.WARNING):
        commander = turn(blue, goal, 0.02)
        copy = declare(red.session, commander.entity.token())
        begin = position(lab)
        eventually(lambda: position(lab) > begin + 0.02)
        blue.close()
        eventually(lambda: "its publisher is gone: HeadYaw held" in caplog.text)
    assert position(lab) < goal - 0.1
    for each in copy:
        each.undeclare()


def test_tokens_of_a_role_end_nothing_on_the_robot_of_another(lab: Lab, red: Node, blue: Node) -> None:
    goal = position(lab) + 0.6
    flood = declare(
        red.session,
        *(token("MP", "/blue/joint_angles", number) for number in range(MOST_OF_A_NAME + 50)),
        token("MP", "/red/own/last"),  # whatever is let through of them has arrived before this one
    )
    with lab.node("operator") as operator:
        assert operator.graph.wait(lambda: bool(operator.graph.entities("MP", "/red/own/last")), EVENT_LIMIT)
    turn(blue, goal, 0.05)  # for longer than a sender may stay unknown
    eventually(lambda: position(lab) == pytest.approx(goal, abs=0.01))
    for each in flood:
        each.undeclare()
