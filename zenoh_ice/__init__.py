"""Ice's object model over Eclipse Zenoh: communicators, adapters, servants, proxies and streams."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .lazy import import_on_use

if TYPE_CHECKING:
    from .data.exceptions import AccessDeniedException as AccessDeniedException
    from .data.exceptions import AlreadyRegisteredException as AlreadyRegisteredException
    from .data.exceptions import BusyException as BusyException
    from .data.exceptions import CommunicatorDestroyedException as CommunicatorDestroyedException
    from .data.exceptions import ConfigurationException as ConfigurationException
    from .data.exceptions import ConnectFailedException as ConnectFailedException
    from .data.exceptions import ConnectionLostException as ConnectionLostException
    from .data.exceptions import EndpointInUseException as EndpointInUseException
    from .data.exceptions import InterfaceMismatchException as InterfaceMismatchException
    from .data.exceptions import MarshalException as MarshalException
    from .data.exceptions import ObjectNotExistException as ObjectNotExistException
    from .data.exceptions import OperationNotExistException as OperationNotExistException
    from .data.exceptions import SystemException as SystemException
    from .data.exceptions import TimeoutException as TimeoutException
    from .data.exceptions import UnknownException as UnknownException
    from .data.exceptions import UserException as UserException
    from .data.exceptions import ZenohIceError as ZenohIceError
    from .data.status import ProcessStatus as ProcessStatus
    from .data.status import ServantStatus as ServantStatus
    from .objects._adapter import ObjectAdapter as ObjectAdapter
    from .objects._communicator import Communicator as Communicator
    from .objects._communicator import initialize as initialize
    from .objects._presence import ClientWatch as ClientWatch
    from .objects._presence import ServantInfo as ServantInfo
    from .objects._servant import Current as Current
    from .objects._servant import Object as Object
    from .objects.proxy import ObjectPrx as ObjectPrx
    from .objects.streams import Publisher as Publisher
    from .objects.streams import Sample as Sample
    from .objects.streams import Samples as Samples
    from .objects.streams import Subscription as Subscription
    from .settings import Settings as Settings
    from .settings import load_settings as load_settings
    from .threads.clock import Clock as Clock
    from .threads.clock import RobotClock as RobotClock
    from .threads.clock import VirtualClock as VirtualClock
    from .threads.clock import WallClock as WallClock

# Each command begins with `zenoh_ice.application`, before anything that takes time to import.
__getattr__, __dir__ = import_on_use(__name__)
