"""A node of zenoh-ros2-sdk that tests drive: run by the Python of the peers' environment.

The argument is a JSON object: `port` of the router, `domain`, and what the node has: `topics` {name: [type, text]} and
`services` {name: [type, request, response]}. It publishes those that `published` lists, and calls those of `called`; it
subscribes to the other topics, and serves the other services by returning the fields that `answers` has for them. With
`type_hash` all types have that hash, as those of Humble have.

Each line of standard input is a JSON object: {"publish": topic, "fields": {...}}, {"call": service, "fields": {...}} or
{"subscribe": topic, "type": ..., "text": ..., "qos": as in tokens}.
Each line of standard output is one: {"ready": ...}, {"topic": ..., "fields": ...}, {"request": ..., "fields": ...},
{"response": service, "fields": ...}. It ends with its standard input.
"""

from __future__ import annotations

import json
import sys
import threading
from typing import Any

import numpy as np
from zenoh_ros2_sdk import ROS2Publisher, ROS2ServiceClient, ROS2ServiceServer, ROS2Subscriber

LOCK = threading.Lock()


def say(**line: object) -> None:
    with LOCK:
        print(json.dumps(line), flush=True)


def plain(message: Any) -> Any:
    """Return a message as JSON."""
    if isinstance(message, np.ndarray):
        return message.tolist()
    if hasattr(message, "__dict__"):
        return {name: plain(value) for name, value in vars(message).items() if not name.startswith("__")}
    return [plain(each) for each in message] if isinstance(message, list) else message


def arrays(fields: dict[str, Any]) -> dict[str, Any]:
    """Return fields with lists of numbers as the arrays that rosbags takes, float64 or uint8."""
    return {
        name: np.array(value, np.float64 if isinstance(value[0], float) else np.uint8)
        if isinstance(value, list) and value
        else value
        for name, value in fields.items()
    }


def main() -> None:
    asked = json.loads(sys.argv[1])
    common = {"router_port": asked["port"], "domain_id": asked["domain"], "type_hash": asked.get("type_hash")}
    publishers, subscribers, clients = {}, {}, {}

    def subscribe(topic: str, kind: str, text: str, qos: str | None = None) -> None:
        def receive(message: Any) -> None:
            say(topic=topic, fields=plain(message))

        subscribers[topic] = ROS2Subscriber(topic, kind, receive, text, node_name="sdk", qos=qos, **common)

    servers: dict[str, Any] = {}
    for topic, (kind, text) in asked.get("topics", {}).items():
        if topic in asked.get("published", ()):
            publishers[topic] = ROS2Publisher(topic, kind, text, node_name="sdk", **common)
        else:
            subscribe(topic, kind, text)
    for service, (kind, request, response) in asked.get("services", {}).items():
        if service in asked.get("called", ()):
            clients[service] = ROS2ServiceClient(service, kind, request, response, node_name="sdk", **common)
        else:

            def serve(message: Any, service: str = service) -> Any:
                say(request=service, fields=plain(message))
                return servers[service].response_msg_class(**asked["answers"][service])

            servers[service] = ROS2ServiceServer(
                service, kind, serve, request, response, node_name="sdk", **common
            )
    ends = publishers | subscribers | clients | servers
    say(ready=True, keys={name: each.keyexpr for name, each in ends.items()})
    for line in sys.stdin:
        order = json.loads(line)
        if "subscribe" in order:
            subscribe(order["subscribe"], order["type"], order["text"], order["qos"])
        elif "publish" in order:
            publishers[order["publish"]].publish(**arrays(order["fields"]))
        else:
            say(response=order["call"], fields=plain(clients[order["call"]].call(**order["fields"])))
    for each in (ends | subscribers).values():
        each.close()


if __name__ == "__main__":
    main()
