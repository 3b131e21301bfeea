"""Ice's object model over Eclipse Zenoh: communicators, adapters, servants, proxies and streams."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .lazy import import_on_use

if TYPE_CHECKING:
    from ._communicator import Communicator as Communicator
    from ._communicator import initialize as initialize
    from ._presence import ClientWatch as ClientWatch
    from ._presence import ServantInfo as ServantInfo
    from .clock import Clock as Clock
    from .clock import RobotClock as RobotClock
    from .clock import VirtualClock as VirtualClock
    from .clock import WallClock as WallClock
    from .exceptions import AccessDeniedException as AccessDeniedException
    from .exceptions import AlreadyRegisteredException as AlreadyRegisteredException
    from .exceptions import BusyException as BusyException
    from .exceptions import CommunicatorDestroyedException as CommunicatorDestroyedException
    from .exceptions import ConfigurationException as ConfigurationException
    from .exceptions import ConnectFailedException as ConnectFailedException
    from .exceptions import ConnectionLostException as ConnectionLostException
    from .exceptions import EndpointInUseException as EndpointInUseException
    from .exceptions import InterfaceMismatchException as InterfaceMismatchException
    from .exceptions import MarshalException as MarshalException
    from .exceptions import ObjectNotExistException as ObjectNotExistException
    from .exceptions import OperationNotExistException as OperationNotExistException
    from .exceptions import SystemException as SystemException
    from .exceptions import TimeoutException as TimeoutException
    from .exceptions import UnknownException as UnknownException
    from .exceptions import UserException as UserException
    from .exceptions import ZenohIceError as ZenohIceError
    from .proxy import ObjectPrx as ObjectPrx
    from .servant import Current as Current
    from .servant import Object as Object
    from .servant import ObjectAdapter as ObjectAdapter
    from .settings import Settings as Settings
    from .settings import load_settings as load_settings
    from .status import ProcessStatus as ProcessStatus
    from .status import ServantStatus as ServantStatus
    from .streams import Publisher as Publisher
    from .streams import Sample as Sample
    from .streams import Samples as Samples
    from .streams import Subscription as Subscription

# Each command begins with `zenoh_ice.application`, before anything that takes time to import.
__getattr__, __dir__ = import_on_use(__name__)
