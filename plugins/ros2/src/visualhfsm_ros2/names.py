"""What generated components import for ROS; its libraries are loaded when they are first needed."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from hfsm_runtime.component import Component, Endpoint, endpoints_of

if TYPE_CHECKING:
    from zenoh_ros2 import Types


class Ros(Endpoint):
    """Declare a topic, service or action of ROS 2 that a component uses.

    `kind` is `publish`, `subscribe`, `service` or `action`, and `qos` has fields of `zenoh_ros2.QoS`. With
    `stop` a default message is published when the component stops, if it has published before.
    """

    of = "ros"
    title = "ROS"

    def __init__(self, kind: str, target: str, type: str, *, stop: bool = False, **qos: object) -> None:
        super().__init__(target)
        self.kind = kind
        self.type = type
        self.stop = stop
        self.qos = qos


def ros_of(component: Component | type[Component]) -> dict[str, Ros]:
    """Return the topics, services and actions of ROS that a component declares, by attribute."""
    return {name: each for name, each in endpoints_of(component).items() if isinstance(each, Ros)}


@functools.lru_cache(maxsize=8)
def _types_with(texts: tuple[tuple[str, str], ...]) -> Types:
    """Return all types of ROS, with a project's own ones, by their texts."""
    from zenoh_ros2 import Types

    types = Types()
    for name, text in texts:  # each after those that it needs
        types.add(name, text)
    return types


def ros_message(name: str, texts: Mapping[str, str] | None = None) -> Callable[..., Any]:
    """Return a function that makes messages of a type with some fields, the others zero, as in ROS 1."""

    def make(**fields: object) -> Any:  # noqa: ANN401
        return _types_with(tuple((texts or {}).items())).make(name, **fields)

    return make


def ros_tf() -> SimpleNamespace:
    """Return the part of the module `tf` of ROS 1 that documents of VisualStates use."""
    return SimpleNamespace(transformations=SimpleNamespace(euler_from_quaternion=_euler_from_quaternion))


def _euler_from_quaternion(quaternion: Sequence[float]) -> tuple[float, float, float]:
    """Return roll, pitch and yaw in rad of a quaternion x, y, z, w (REP 103: about fixed x, y, z)."""
    x, y, z, w = quaternion
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    return roll, pitch, math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
