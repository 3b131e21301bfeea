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

from ._actions import Aborted as Aborted
from ._actions import ActionClient as ActionClient
from ._actions import ActionServer as ActionServer
from ._actions import Canceled as Canceled
from ._actions import Goal as Goal
from ._actions import ServerGoal as ServerGoal
from ._actions import Status as Status
from ._graph import Graph as Graph
from ._graph import Sender as Sender
from ._messages import Types as Types
from ._node import DEFAULT_SETTINGS as DEFAULT_SETTINGS
from ._node import Node as Node
from ._node import settings_of_node as settings_of_node
from ._parameters import Parameters as Parameters
from ._rosout import RosoutHandler as RosoutHandler
from ._services import LARGEST_COMMAND as LARGEST_COMMAND
from ._services import Client as Client
from ._services import Service as Service
from ._topics import Publisher as Publisher
from ._topics import Subscription as Subscription
from ._wire import LATCHED as LATCHED
from ._wire import SENSOR_DATA as SENSOR_DATA
from ._wire import Entity as Entity
from ._wire import QoS as QoS
from .exceptions import CallError as CallError
from .exceptions import CallTimeoutError as CallTimeoutError
from .exceptions import DefinitionError as DefinitionError
from .exceptions import GoalRejectedError as GoalRejectedError
from .exceptions import InvalidNameError as InvalidNameError
from .exceptions import MessageError as MessageError
from .exceptions import NodeClosedError as NodeClosedError
from .exceptions import RosError as RosError
from .exceptions import TypeUnknownError as TypeUnknownError
