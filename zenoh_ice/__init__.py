"""Ice's object model over Eclipse Zenoh: communicators, adapters, servants, proxies and streams.

The rooms, each of which stands on those below it:

- `application/`: what all commands share: settings as options, signals, logs, children, the emergency stop;
- `objects/`: proxies, servants and the dispatch of calls to them, adapters, streams, presence, the
  communicator; all but the last know their communicator as a `Home`, a protocol;
- `routes/`: the choice between the carriers, of calls and their order, and of streams of large values; the
  calls that servants must not begin any more; the transports that these make;
- `carriers/`: within the process, over Unix sockets and lent memory, and over Zenoh, side by side: they do
  not know one another, and Zenoh is imported in one of them alone;
- `transport.py`: the seam between those above, which stand on any transport, and those below (decision 11);
- `threads/`, `settings/`: the pool, clocks, and `Limits`, what all parts wait for and how much they keep,
  which a test passes; a component's settings and their security;
- `data/`: what travels: values and their encoding, interfaces, exceptions, keys, status; TOML, JSON and
  MessagePack read by types.

Beside them, `lazy.py` and `plugins.py` import names and plug-ins when they are needed, and `generated.py` has
what generated code imports.

The key of an operation is `{realm}/{identity}/{operation}`. A Zenoh get on it is the call; where the IDL
marks the operation `["stream"]`, a subscription to the key yields the same value whenever it changes. Both
carry the same MessagePack map, whose size is checked first, then its types, both from the IDL. A call takes
one of three routes: within the process, through a *channel*, which is a Unix socket between processes of one
user on one machine, or over the network. Large samples have channels, too. The servants' tokens say where
their sockets are, and every promise holds on every route (decision 33).

`["stop"]` marks the operation that stops everything that an interface commands: a component that ends calls
it on each of its proxies (decision 1).

Every process is a Zenoh peer that connects to the robot server, and discovers the other processes by gossip.
Multicast is off, so that a robot is never driven by somebody else's stack; everything listens on loopback
unless configured otherwise.
"""

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
