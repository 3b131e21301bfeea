"""Ice's object model over Eclipse Zenoh: communicators, adapters, servants, proxies and streams."""

from .adapter import ObjectAdapter
from .clients import ClientWatch
from .clock import Clock, VirtualClock, WallClock
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
    FacetNotExistException,
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
from .identity import Identity, identityToString, stringToIdentity
from .implicit_context import ImplicitContext
from .invocation import InvocationFuture
from .object import Current, Object
from .presence import ServantInfo
from .process_status import ProcessStatus, ServantStatus
from .proxy import ObjectPrx
from .publisher import Publisher
from .sample import Sample
from .servant_locator import ServantLocator
from .settings import Settings, load_settings
from .subscription import Subscription

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
    "FacetNotExistException",
    "Identity",
    "ImplicitContext",
    "InterfaceMismatchException",
    "InvocationFuture",
    "MarshalException",
    "Object",
    "ObjectAdapter",
    "ObjectNotExistException",
    "ObjectPrx",
    "OperationNotExistException",
    "ProcessStatus",
    "Publisher",
    "Sample",
    "ServantInfo",
    "ServantLocator",
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
    "identityToString",
    "initialize",
    "load_settings",
    "stringToIdentity",
]
