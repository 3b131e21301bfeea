"""The gateway and a node of zenoh-ros2-sdk, an independent implementation, by a separate router."""

from __future__ import annotations

from typing import Any

import pytest

from interfaces.nao import SafetyPrx, SpeechPrx
from naoserver.fake import FakeRobot
from plugins.ros2.tests.support.ros_peers import running_peer
from tests.support.limits import CALL_LIMIT, START_LIMIT
from tests.support.processes import free_endpoint
from tests.support.robot_server import HASTE, eventually, served_to_client
from tests.support.security import routing
from visualhfsm_ros2.gateway._command import serve
from zenoh_ice import Settings
from zenoh_ros2._wire import HASHLESS

ASKED = {
    "domain": 0,
    "topics": {
        "/speech": ["std_msgs/msg/String", "string data\n"],
        "/head_touch": ["naoqi_bridge_msgs/msg/HeadTouch", "uint8 button\nuint8 state\n"],
    },
    "published": ["/speech"],
    "services": {
        "/nao/emergency_stop": [
            "std_srvs/srv/Trigger",
            "uint8 structure_needs_at_least_one_member\n",
            "bool success\nstring message",
        ]
    },
    "called": ["/nao/emergency_stop"],
}


@pytest.mark.parametrize("type_hash", [None, HASHLESS], ids=["with hashes", "as of Humble"])
def test_another_implementation_hears_the_robot_and_commands_it(type_hash: str | None) -> None:
    endpoint, robot = free_endpoint(), FakeRobot()
    settings = Settings(connect=(endpoint,), listen=("tcp/127.0.0.1:0",))
    with (
        routing(Settings(mode="router", listen=(endpoint,))),
        served_to_client(robot, timeout=HASTE) as nao,
        serve(nao.communicator, "nao", settings=settings, domain=0) as telemetry,
        running_peer(endpoint, **ASKED, type_hash=type_hash) as peer,
    ):
        assert peer.next(START_LIMIT)["ready"]
        touch: Any = nao.assembly.servants["Touch"]

        def heard() -> bool:
            telemetry.poll()
            return bool(touch.getTouchReadingPublisher.listening)

        eventually(heard)
        robot.senses.feel(touched=frozenset({"HeadRear"}))
        event = peer.next()
        assert (event["topic"], event["fields"]["button"], event["fields"]["state"]) == ("/head_touch", 3, 1)
        peer.order(publish="/speech", fields={"data": "hello"})
        eventually(lambda: nao.proxy(SpeechPrx, "Speech").getSpeech().text == "hello")
        peer.order(call="/nao/emergency_stop", fields={})
        assert peer.next(CALL_LIMIT)["fields"] == {"success": True, "message": "stopped"}
        assert nao.proxy(SafetyPrx, "Safety").getSafetyState().stopped
