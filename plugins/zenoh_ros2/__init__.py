"""ROS 2 without ROS: a node that speaks the wire format of rmw_zenoh.

with Node("talker") as node:
    publisher = node.create_publisher("std_msgs/msg/String", "/chatter")
    publisher.publish(data="hello")
"""

try:
    import rosbags.typesys as _rosbags  # noqa: F401
    import xxhash as _xxhash  # noqa: F401
except ImportError as error:
    raise ImportError(f"{error.name} is missing: install it with pip install 'visualhfsm[ros2]'") from error

from ._actions import Aborted, ActionClient, ActionServer, Canceled, Goal, ServerGoal, Status
from ._graph import Graph, Sender
from ._messages import Types
from ._node import DEFAULT_SETTINGS, Node, settings_of_node
from ._parameters import Parameters
from ._rosout import RosoutHandler
from ._services import LARGEST_COMMAND, Client, Service
from ._topics import Publisher, Subscription
from ._wire import LATCHED, SENSOR_DATA, Entity, QoS
from .exceptions import (
    CallError,
    CallTimeoutError,
    DefinitionError,
    GoalRejectedError,
    InvalidNameError,
    MessageError,
    NodeClosedError,
    RosError,
    TypeUnknownError,
)

__all__ = [
    "DEFAULT_SETTINGS",
    "LARGEST_COMMAND",
    "LATCHED",
    "SENSOR_DATA",
    "Aborted",
    "ActionClient",
    "ActionServer",
    "CallError",
    "CallTimeoutError",
    "Canceled",
    "Client",
    "DefinitionError",
    "Entity",
    "Goal",
    "GoalRejectedError",
    "Graph",
    "InvalidNameError",
    "MessageError",
    "Node",
    "NodeClosedError",
    "Parameters",
    "Publisher",
    "QoS",
    "RosError",
    "RosoutHandler",
    "Sender",
    "ServerGoal",
    "Service",
    "Status",
    "Subscription",
    "TypeUnknownError",
    "Types",
    "settings_of_node",
]
