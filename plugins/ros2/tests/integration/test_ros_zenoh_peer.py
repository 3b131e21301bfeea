"""Our node and one of zenoh-ros2-sdk, an independent implementation of rmw_zenoh's wire format, through a router."""

from __future__ import annotations

import queue
import time
from collections.abc import Iterator
from typing import Any

import pytest

from plugins.ros2.tests.support.ros_peers import Peer, running_peer
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, START_LIMIT
from tests.support.processes import free_endpoint
from tests.support.security import routing
from zenoh_ice import Settings
from zenoh_ros2 import Node, QoS, Types

SAMPLE = "float64[] values\nstring name\nuint8[3] color\nbool seen\nint32 number\n"
ADD = "example_interfaces/srv/AddTwoInts"
SWITCH = "std_srvs/srv/SetBool"
TOPICS = {
    "/chatter": ["std_msgs/msg/String", "string data\n"],
    "/robot1/sample": ["peer_msgs/msg/Sample", SAMPLE],
    "/back": ["std_msgs/msg/String", "string data\n"],
    "/robot1/sample_back": ["peer_msgs/msg/Sample", SAMPLE],
}
SERVICES = {
    "/theirs/add": [ADD, "int64 a\nint64 b", "int64 sum"],
    "/ours/switch": [SWITCH, "bool data", "bool success\nstring message"],
}
DOMAIN = 7
ROUTED = Settings(connect=(free_endpoint(),))
ASKED = {
    "topics": TOPICS,
    "published": ["/back", "/robot1/sample_back"],
    "services": SERVICES,
    "called": ["/ours/switch"],
    "answers": {"/theirs/add": {"sum": 42}},
}


@pytest.fixture(scope="module")
def joined() -> Iterator[tuple[Node, Peer, dict[str, str]]]:
    """Our node and the peer, connected by a router, and the keys that the peer uses."""
    (endpoint,) = ROUTED.connect
    types = Types()
    types.add("peer_msgs/msg/Sample", SAMPLE)
    with (
        routing(Settings(mode="router", listen=(endpoint,))),
        running_peer(endpoint, domain=DOMAIN, **ASKED) as peer,
        Node("ours", domain=DOMAIN, settings=ROUTED, types=types) as node,
    ):
        keys = peer.next(START_LIMIT)["keys"]
        yield node, peer, keys


Joined = tuple[Node, Peer, dict[str, str]]


@pytest.mark.parametrize("topic", ["/chatter", "/robot1/sample"])
def test_it_receives_each_of_twenty_messages(joined: Joined, topic: str) -> None:
    node, peer, _ = joined
    publisher = node.create_publisher(TOPICS[topic][0], topic)
    assert node.graph.wait(lambda: publisher.subscribers == 1, EVENT_LIMIT)
    sent = [fields_of(topic, number) for number in range(20)]
    for fields in sent:
        publisher.publish(**fields)
    assert [peer.next() for _ in sent] == [{"topic": topic, "fields": fields} for fields in sent]
    publisher.close()


@pytest.mark.parametrize("topic", ["/back", "/robot1/sample_back"])
def test_we_receive_each_of_its_twenty_messages(joined: Joined, topic: str) -> None:
    node, peer, _ = joined
    received: queue.Queue[Any] = queue.Queue()
    subscription = node.create_subscription(TOPICS[topic][0], topic, received.put, QoS(depth=100))
    assert node.graph.wait(lambda: len(node.graph.entities("MP", topic)) == 1, EVENT_LIMIT)
    first = fields_of(topic, 0)
    deadline = time.monotonic() + EVENT_LIMIT
    while received.empty():  # the peer does not say when it knows our subscription
        peer.order(publish=topic, fields=first)
        assert time.monotonic() < deadline
        time.sleep(0.05)
    sent = [fields_of(topic, number) for number in range(1, 21)]
    for fields in sent:
        peer.order(publish=topic, fields=fields)
    came: list[dict[str, Any]] = []
    while len(came) < len(sent):
        message = received.get(timeout=EVENT_LIMIT)
        fields = {name: plain(getattr(message, name)) for name in first}
        if fields != first:
            came.append(fields)
    assert came == sent
    assert (subscription.malformed, subscription.lost) == (0, 0)
    subscription.close()


def test_it_gets_what_was_published_before_it_subscribed(joined: Joined) -> None:
    node, peer, _ = joined
    publisher = node.create_publisher(
        "std_msgs/msg/String", "/map", QoS(durability="transient_local", depth=3)
    )
    for number in range(5):
        publisher.publish(data=f"map {number}")
    # The peer asks once: the router must know by then who keeps messages.
    with Node("observer", domain=DOMAIN, settings=ROUTED) as observer:
        assert observer.graph.wait(lambda: bool(observer.graph.entities("MP", "/map")), EVENT_LIMIT)
    peer.order(subscribe="/map", type="std_msgs/msg/String", text="string data\n", qos=":1:,3:,:,:,,")
    # Its query is consolidated, so that it gets the newest one; rmw_zenoh's asks for all, as ours does.
    assert peer.next() == {"topic": "/map", "fields": {"data": "map 4"}}
    publisher.close()


def test_it_answers_our_calls(joined: Joined) -> None:
    node, peer, _ = joined
    client = node.create_client(ADD, "/theirs/add")
    client.wait(EVENT_LIMIT)
    for number in range(20):
        assert client.call(a=number, b=-(1 << 60), timeout=CALL_LIMIT).sum == 42
        assert peer.next() == {"request": "/theirs/add", "fields": {"a": number, "b": -(1 << 60)}}
    client.close()


def test_we_answer_its_calls(joined: Joined) -> None:
    node, peer, _ = joined
    asked: list[bool] = []

    def switch(request: Any) -> dict[str, Any]:
        asked.append(request.data)
        return {"success": not request.data, "message": f"Grüße {len(asked)}"}

    service = node.create_service(SWITCH, "/ours/switch", switch)
    assert node.graph.wait(lambda: len(node.graph.services().get("/ours/switch", ())) == 1, EVENT_LIMIT)
    for number in range(20):
        peer.order(call="/ours/switch", fields={"data": number % 2 == 0})
        answer = {"success": number % 2 == 1, "message": f"Grüße {number + 1}"}
        assert peer.next(CALL_LIMIT) == {"response": "/ours/switch", "fields": answer}
    assert asked == [number % 2 == 0 for number in range(20)]
    service.close()


def test_keys_of_both_are_the_same(joined: Joined) -> None:
    node, _, keys = joined
    hashes = {name: node.types.hash(kind) for name, (kind, *_) in (TOPICS | SERVICES).items()}
    types = {
        name: kind.replace("/", "::").replace("msg::", "msg::dds_::") for name, (kind, _) in TOPICS.items()
    }
    types |= {
        name: kind.replace("/", "::").replace("srv::", "srv::dds_::") for name, (kind, *_) in SERVICES.items()
    }
    assert keys == {name: f"{DOMAIN}{name}/{types[name]}_/{hashes[name]}" for name in types}


def test_the_graph_has_its_node_and_what_it_has(joined: Joined) -> None:
    node, _, _ = joined
    assert node.graph.wait(lambda: "/theirs/add" in node.graph.services(), EVENT_LIMIT)
    assert "/sdk" in node.graph.nodes()
    topics = node.graph.topics()
    assert {name: [*topics[name]] for name in TOPICS} == {name: [kind] for name, (kind, _) in TOPICS.items()}


def fields_of(topic: str, number: int) -> dict[str, Any]:
    if TOPICS[topic][0] == "std_msgs/msg/String":
        return {"data": f"Nachricht {number} für {topic}" * (number + 1)}
    return {
        "values": [number + 0.5, -1e300] * (number + 1),
        "name": "x" * number,
        "color": [number, 255 - number, 7],
        "seen": number % 2 == 1,
        "number": -number,
    }


def plain(value: Any) -> Any:
    return value.tolist() if hasattr(value, "tolist") else value
