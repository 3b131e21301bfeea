"""What a node of one distribution does with messages: one of Humble writes other bytes, and no hashes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from plugins.ros2.tests.support.rmw_zenoh import GenuineNode
from zenoh_ros2 import QoS, Types
from zenoh_ros2._wire import HASHLESS


class Stranger:
    """A node that reads and writes messages as a distribution does, in a session with the settings of rmw_zenoh."""

    def __init__(self, node: GenuineNode, types: Types, *, humble: bool) -> None:
        self.node: Final = node
        self.types: Final = types
        self.humble: Final = humble

    def hash(self, type_name: str) -> str:
        """Return what it has for the hash of a type."""
        return HASHLESS if self.humble else self.types.hash(type_name)

    def listen(self, type_name: str, topic: str, qos: QoS = QoS()) -> Callable[[], list[Any]]:  # noqa: B008
        """Subscribe to a topic; return what returns the messages that came."""
        heard = self.node.listen(type_name, self.hash(type_name), topic, qos)
        return lambda: [self._read(data, type_name) for data in heard.copy()]

    def publisher(self, type_name: str, topic: str) -> Callable[..., None]:
        """Return what publishes a message by its fields."""
        publish = self.node.publisher(type_name, self.hash(type_name), topic)
        return lambda **fields: publish(self._write(type_name, fields))

    def client(self, type_name: str, service: str) -> Callable[..., Any]:
        """Return what calls a service by the fields of the request."""
        call = self.node.client(type_name, self.hash(type_name), service)

        def send(limit: float, **fields: Any) -> Any:
            return self._read(
                call(self._write(f"{type_name}_Request", fields), limit), f"{type_name}_Response"
            )

        return send

    def serve(self, type_name: str, service: str, answer: Callable[[Any], dict[str, Any]]) -> None:
        """Serve a service."""
        self.node.serve(
            type_name,
            self.hash(type_name),
            service,
            lambda data: self._write(
                f"{type_name}_Response", answer(self._read(data, f"{type_name}_Request"))
            ),
        )

    def _read(self, data: bytes, name: str) -> Any:
        return self.types.decode(data, name, humble=self.humble)

    def _write(self, name: str, fields: dict[str, Any]) -> bytes:
        return self.types.encode(self.types.make(name, fields), humble=self.humble)
