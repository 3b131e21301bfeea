"""Who meets whom in ROS: the gateway, nodes of ours, and sessions with the settings of genuine nodes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Literal

import pytest

from naoserver.fake import FakeRobot
from plugins.ros2.tests.support.rmw_zenoh import GREATEST, SMALLEST, GenuineNode
from tests.support.limits import CALL_LIMIT
from tests.support.processes import free_endpoint
from tests.support.robot_server import eventually, served
from tests.support.security import routing
from tests.support.soak import cases
from visualhfsm_ros2.gateway._command import serve
from visualhfsm_ros2.gateway._telemetry import Telemetry
from zenoh_ice import Settings, initialize
from zenoh_ice.threads.limits import Limits
from zenoh_ros2 import Node, Sender, Types

Mode = Literal["client", "peer"]

JOINTS = "sensor_msgs/msg/JointState"
TEXT = "std_msgs/msg/String"
HASHES = {name: Types().hash(name) for name in (JOINTS, TEXT)}
BRIEF = Limits(longest_grace=0.0)
"""Limits of who looks half a second for parts that the robot does not have, and no longer for long calls."""
SMALL = "0100"
"""The lowest bytes of an id that is smaller than all but one of 256 random ones."""


@contextmanager
def gateway(router: str = "") -> Iterator[tuple[Telemetry, str]]:
    """Show a robot to ROS by a router, or by its own server; yield the endpoint for nodes of ROS."""
    with (
        served(FakeRobot()) as nao,
        initialize(
            realm=nao.realm, connect=[nao.endpoint], clock="wall", lease=CALL_LIMIT, limits=BRIEF
        ) as client,
    ):
        where = router or nao.endpoint
        eventually(lambda: client.identities() == nao.served_by.identities())
        with serve(client, "nao", settings=Settings(connect=(where,))) as telemetry:
            yield telemetry, where


def all_meet(nodes: list[GenuineNode], telemetry: Telemetry) -> None:
    """Assert that each node hears the robot, and each of the others."""
    states = [node.hear(JOINTS, HASHES[JOINTS], "/joint_states") for node in nodes]
    chatter = [node.hear(TEXT, HASHES[TEXT], "/chatter") for node in nodes]

    def said() -> bool:
        telemetry.poll()
        for number, node in enumerate(nodes):
            node.publish(TEXT, HASHES[TEXT], "/chatter", bytes([number]))
        return all(states) and all(len(heard) == len(nodes) for heard in chatter)

    eventually(said)
    assert [len(heard) for heard in chatter] == [len(nodes)] * len(nodes)
    assert [bool(heard) for heard in states] == [True] * len(nodes)


def test_by_a_router_genuine_nodes_find_the_robot_and_each_other() -> None:
    router = free_endpoint()
    with ExitStack() as opened:
        opened.enter_context(routing(Settings(mode="router", connect=(), listen=(router,))))
        telemetry, where = opened.enter_context(gateway(router))
        ids = (SMALLEST, "", GREATEST)
        all_meet(
            [
                opened.enter_context(GenuineNode(f"genuine{number}", where, session_id=each))
                for number, each in enumerate(ids)
            ],
            telemetry,
        )


def test_after_a_restart_of_the_router_they_find_each_other_again() -> None:
    router = free_endpoint()
    routed = Settings(mode="router", connect=(), listen=(router,))
    with ExitStack() as opened, ExitStack() as first:
        first.enter_context(routing(routed))
        telemetry, where = opened.enter_context(gateway(router))
        nodes = [opened.enter_context(GenuineNode(name, where)) for name in ("one", "other")]
        all_meet(nodes, telemetry)
        first.close()
        with routing(routed):
            nodes.append(opened.enter_context(GenuineNode("late", where)))
            all_meet(nodes, telemetry)
            opened.close()


@pytest.mark.parametrize(("ours", "others"), cases([("client", "peer")], [pytest.param("peer", "client")]))
def test_what_is_known_by_a_router_is_gone_with_it_and_comes_back_with_it(ours: Mode, others: Mode) -> None:
    endpoint = free_endpoint()
    routed = Settings(mode="router", connect=(), listen=(endpoint,))
    senders: list[Sender] = []
    with (
        routing(routed) as router,
        Node("ours", settings=Settings(connect=(endpoint,), mode=ours)) as node,
        Node("other", settings=Settings(connect=(endpoint,), mode=others)) as other,
        GenuineNode("genuine", endpoint, mode=others) as genuine,
    ):
        genuine.hear(TEXT, HASHES[TEXT], "/chatter")
        publisher = node.create_publisher(TEXT, "/chatter")
        node.create_subscription(TEXT, "/go", lambda _, sender: senders.append(sender), with_sender=True)
        go = other.create_publisher(TEXT, "/go")

        def all_there() -> bool:
            go.publish(data="on")
            present = {"/genuine", "/other"} <= {*node.graph.nodes()}
            return present and publisher.subscribers == 1 and bool(senders) and not senders[-1].gone

        eventually(all_there)
        router.process.kill()
        eventually(lambda: not {"/genuine", "/other"} & {*node.graph.nodes()})
        eventually(lambda: publisher.subscribers == 0 and all(sender.gone for sender in senders))
        with routing(routed):
            eventually(all_there)


@pytest.mark.parametrize("session_id", [SMALLEST, GREATEST], ids=["smallest id", "greatest id"])
def test_without_a_router_a_genuine_node_finds_the_robot(session_id: str) -> None:
    with gateway() as (telemetry, where), GenuineNode("genuine", where, session_id=session_id) as genuine:
        all_meet([genuine], telemetry)


def test_without_a_router_a_genuine_node_finds_ours_by_a_common_peer() -> None:
    middle = free_endpoint()
    with (
        Node("middle", settings=Settings(connect=(), listen=(middle,))),
        Node("ours", settings=Settings(connect=(middle,))) as ours,
        GenuineNode("genuine", middle, session_id=f"ab{SMALL}") as genuine,
    ):
        heard = genuine.hear(TEXT, HASHES[TEXT], "/chatter")
        publisher = ours.create_publisher(TEXT, "/chatter")

        def met() -> bool:
            publisher.publish(data="hello")
            return bool(heard) and "/genuine" in ours.graph.nodes()

        eventually(met)
        assert met()
