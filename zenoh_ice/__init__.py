"""Ice's object model over Eclipse Zenoh: communicators, adapters, servants, proxies and streams."""

from .adapter import ObjectAdapter
from .calls.implicit_context import ImplicitContext
from .calls.invocation import InvocationFuture
from .clocks.clock import Clock, VirtualClock, WallClock
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
from .network.clients import ClientWatch
from .network.process_status import ProcessStatus, ServantStatus
from .network.servant_table import ServantInfo
from .object import Current, Object
from .proxy import ObjectPrx
from .serving.servant_locator import ServantLocator
from .settings import Settings, load_settings
from .streams.publisher import Publisher
from .streams.sample import Sample
from .streams.subscription import Subscription

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
