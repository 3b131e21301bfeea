"""One of the two nodes of bench_ros2.py, of our library or of genuine rclpy; prints JSON.

Arguments: the library (`ours` or `genuine`), the task, the side (`a` or `b`), how many messages, and the port
of loopback where our nodes meet.
"""

# ruff: noqa: ANN401, D102 - rclpy has no types, and the nodes of both libraries have the same methods

from __future__ import annotations

import array
import json
import resource
import sys
import threading
import time
from collections.abc import Callable
from typing import Any, Final

DOMAIN: Final = 93
CLOCK: Final = "rosgraph_msgs/msg/Clock"
ARRAY: Final = "rcl_interfaces/msg/ParameterValue"
IMAGE: Final = "sensor_msgs/msg/Image"
TYPES: Final = "rcl_interfaces/srv/GetParameterTypes"
BYTES: Final = 640 * 480 * 3
SIZES: Final = {"image": (640, 480), "large": (1280, 960)}
"""Width and height of images in pixels."""
KINDS: Final = {"stream": CLOCK, "array": ARRAY, "image": IMAGE, "large": IMAGE}
RATES: Final = {"stream": 100.0, "array": 30.0, "image": 30.0, "large": 10.0}
DEPTHS: Final = {CLOCK: 1000, ARRAY: 10, IMAGE: 10}
"""How many messages of each type may wait."""
QUIET: Final = 10.0  # s without a message after which no more is waited for
LIMIT: Final = 60.0  # s until the other side is there


class Ours:
    """A node of our library."""

    def __init__(self, side: str, port: str) -> None:
        from zenoh_ice import Settings
        from zenoh_ros2 import Node, QoS

        place = (f"tcp/127.0.0.1:{port}",)
        settings = Settings(listen=place, connect=()) if side == "a" else Settings(connect=place)
        self.node = Node(side, domain=DOMAIN, settings=settings)
        self.qos = {kind: QoS(depth=depth) for kind, depth in DEPTHS.items()}

    def publisher(self, task: str, topic: str) -> Callable[[Any], None]:
        import numpy as np

        kind, (width, height) = KINDS[task], SIZES.get(task, (0, 0))
        publisher = self.node.create_publisher(kind, topic, self.qos[kind])
        until(lambda: publisher.subscribers > 0)
        pixels = np.zeros(3 * width * height, np.uint8) if kind == IMAGE else np.zeros(BYTES // 8, np.int64)
        types = self.node.types

        def publish(now: int) -> None:
            stamp = {"sec": now // 1_000_000_000, "nanosec": now % 1_000_000_000}
            if kind == CLOCK:
                message = types.make(kind, clock=stamp)
            elif kind == ARRAY:
                message = types.make(kind, integer_value=now, integer_array_value=pixels)
            else:
                message = types.make(
                    kind,
                    header={"stamp": stamp},
                    width=width,
                    height=height,
                    encoding="rgb8",
                    step=3 * width,
                    data=pixels,
                )
            publisher.publish(message)

        return publish

    def subscribe(self, kind: str, topic: str, receive: Callable[[Any], None]) -> None:
        self.node.create_subscription(kind, topic, receive, self.qos[kind])

    def serve(self, name: str) -> None:
        self.node.create_service(TYPES, name, lambda request: {"types": [3] * len(request.names)})

    def client(self, name: str) -> Callable[[], int]:
        client = self.node.create_client(TYPES, name)
        client.wait(LIMIT)
        return lambda: len(client.call(names=["a", "bc", "def"], timeout=10.0).types)

    def close(self) -> None:
        self.node.close()


class Genuine:
    """A node of rclpy over Fast DDS, spun in a thread."""

    def __init__(self, side: str, _port: str) -> None:
        import rclpy
        from rclpy.executors import SingleThreadedExecutor

        rclpy.init(domain_id=DOMAIN)
        self.rclpy = rclpy
        self.node = rclpy.create_node(side)
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.thread = threading.Thread(target=self.executor.spin, daemon=True)
        self.thread.start()

    def publisher(self, task: str, topic: str) -> Callable[[Any], None]:
        kind, (width, height) = KINDS[task], SIZES.get(task, (0, 0))
        made = self._class(kind)
        publisher = self.node.create_publisher(made, topic, DEPTHS[kind])
        until(lambda: publisher.get_subscription_count() > 0)
        numbers, pixels = array.array("q", bytes(BYTES)), array.array("B", bytes(3 * width * height))

        def publish(now: int) -> None:
            message = made()
            if kind == CLOCK:
                message.clock.sec, message.clock.nanosec = divmod(now, 1_000_000_000)
            elif kind == IMAGE:
                stamp = message.header.stamp
                stamp.sec, stamp.nanosec = divmod(now, 1_000_000_000)
                message.width, message.height, message.step = width, height, 3 * width
                message.encoding, message.data = "rgb8", pixels
            else:
                message.integer_value, message.integer_array_value = now, numbers
            publisher.publish(message)

        return publish

    def subscribe(self, kind: str, topic: str, receive: Callable[[Any], None]) -> None:
        self.node.create_subscription(self._class(kind), topic, receive, DEPTHS[kind])

    def serve(self, name: str) -> None:
        def answer(request: Any, response: Any) -> Any:
            response.types = [3] * len(request.names)
            return response

        self.node.create_service(self._class(TYPES), name, answer)

    def client(self, name: str) -> Callable[[], int]:
        made = self._class(TYPES)
        client = self.node.create_client(made, name)
        client.wait_for_service(LIMIT)
        return lambda: len(client.call(made.Request(names=["a", "bc", "def"])).types)

    def close(self) -> None:
        self.executor.shutdown()
        self.thread.join(LIMIT)
        self.node.destroy_node()
        self.rclpy.shutdown()

    @staticmethod
    def _class(kind: str) -> Any:
        import importlib

        package, folder, name = kind.split("/")
        return getattr(importlib.import_module(f"{package}.{folder}"), name)


def until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + LIMIT
    while not condition():
        if time.monotonic() > deadline:
            raise SystemExit("the other side is not there")
        time.sleep(0.01)


def stamp_of(message: Any) -> int:
    if hasattr(message, "integer_value"):
        return int(message.integer_value)
    stamp = message.clock if hasattr(message, "clock") else message.header.stamp
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def stream(node: Any, task: str, side: str, number: int) -> dict[str, Any]:
    """Publish at a rate, both ways for `stream`, else from a to b; count what comes and how old it is."""
    sends, receives = task == "stream" or side == "a", task == "stream" or side == "b"
    ages: list[int] = []
    newest = [0.0]

    def receive(message: Any) -> None:
        now = time.monotonic_ns()
        ages.append(now - stamp_of(message))
        newest[0] = time.monotonic()

    if receives:
        node.subscribe(KINDS[task], f"/bench/to_{side}", receive)
    publish = node.publisher(task, f"/bench/to_{'b' if side == 'a' else 'a'}") if sends else None
    if publish:
        time.sleep(1.0)  # the other end's discovery may be a little behind
        began = time.monotonic()
        for index in range(number):
            publish(time.monotonic_ns())
            time.sleep(max(0.0, began + (index + 1) / RATES[task] - time.monotonic()))
    deadline = time.monotonic() + LIMIT
    while receives and len(ages) < number and time.monotonic() < deadline:
        if ages and time.monotonic() - newest[0] > QUIET:
            break
        time.sleep(0.05)
    time.sleep(1.0)
    return {"sent": number if sends else 0, "received": len(ages), "ages": sorted(ages)}


def main() -> None:
    library, task, side, number, port = sys.argv[1:]
    node: Any = (Ours if library == "ours" else Genuine)(side, port)
    figures: dict[str, Any] = {}
    if task != "calls":
        figures = stream(node, task, side, int(number))
    elif side == "b":
        node.serve("/bench/types")
        print(json.dumps({"ready": True}), flush=True)
        sys.stdin.readline()
    else:
        call, times = node.client("/bench/types"), []
        for _ in range(int(number)):
            began = time.perf_counter_ns()
            assert call() == 3
            times.append(time.perf_counter_ns() - began)
        figures["ages"] = sorted(times[len(times) // 10 :])  # the first ones warm up
    used = resource.getrusage(resource.RUSAGE_SELF)
    figures["processor"] = used.ru_utime + used.ru_stime
    print(json.dumps(figures), flush=True)
    node.close()


if __name__ == "__main__":
    main()
