"""Ice's object model over Eclipse Zenoh: communicators, adapters, servants, proxies and streams."""

from .adapter import ObjectAdapter
from .clients import ClientWatch
from .clock import Clock, VirtualClock, WallClock
from .communicator import Communicator, initialize
from .exceptions import (
    AlreadyRegisteredException,
    CommunicatorDestroyedException,
    ConfigurationException,
    ConnectFailedException,
    ConnectionLostException,
    EndpointInUseException,
    InterfaceMismatchException,
    MarshalException,
    ObjectNotExistException,
    OperationNotExistException,
    OverloadedException,
    SystemException,
    TimeoutException,
    UnknownException,
    UserException,
    ZenohIceError,
)
from .object import Current, Object
from .proxy import ObjectPrx
from .publisher import Publisher
from .settings import Settings, load_settings
from .stream_reader import Sample
from .subscription import Subscription

__all__ = [
    "AlreadyRegisteredException",
    "ClientWatch",
    "Clock",
    "Communicator",
    "CommunicatorDestroyedException",
    "ConfigurationException",
    "ConnectFailedException",
    "ConnectionLostException",
    "Current",
    "EndpointInUseException",
    "InterfaceMismatchException",
    "MarshalException",
    "Object",
    "ObjectAdapter",
    "ObjectNotExistException",
    "ObjectPrx",
    "OperationNotExistException",
    "OverloadedException",
    "Publisher",
    "Sample",
    "Settings",
    "Subscription",
    "SystemException",
    "TimeoutException",
    "UnknownException",
    "UserException",
    "VirtualClock",
    "WallClock",
    "ZenohIceError",
    "initialize",
    "load_settings",
]
