"""Ice's object model over Eclipse Zenoh: communicators, adapters, servants, proxies and streams."""

from ._presence import ClientWatch, ServantInfo
from .clock import Clock, RobotClock, VirtualClock, WallClock
from .communicator import Communicator, initialize
from .exceptions import (
    AccessDeniedException,
    AlreadyRegisteredException,
    BusyException,
    CommunicatorDestroyedException,
    ConfigurationException,
    ConnectFailedException,
    ConnectionLostException,
    EndpointInUseException,
    InterfaceMismatchException,
    MarshalException,
    ObjectNotExistException,
    OperationNotExistException,
    SystemException,
    TimeoutException,
    TwowayOnlyException,
    UnknownException,
    UserException,
    ZenohIceError,
)
from .proxy import ObjectPrx
from .servant import Current, Object, ObjectAdapter
from .settings import Settings, load_settings
from .status import ProcessStatus, ServantStatus
from .streams import Publisher, Sample, Samples, Subscription

__all__ = [
    "AccessDeniedException",
    "AlreadyRegisteredException",
    "BusyException",
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
    "ProcessStatus",
    "Publisher",
    "RobotClock",
    "Sample",
    "Samples",
    "ServantInfo",
    "ServantStatus",
    "Settings",
    "Subscription",
    "SystemException",
    "TimeoutException",
    "TwowayOnlyException",
    "UnknownException",
    "UserException",
    "VirtualClock",
    "WallClock",
    "ZenohIceError",
    "initialize",
    "load_settings",
]
