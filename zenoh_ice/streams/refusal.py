"""Whether a stream that is silent may not be read: access control drops subscriptions without a word."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Final

from ..exceptions import SystemException

if TYPE_CHECKING:
    from ..communicator import Communicator
    from ..identity import Target

__all__ = ["is_refused"]

_STATUS_LIMIT: Final = 0.25  # s
_LOOKS: Final = 2
_ON_ITS_WAY: Final = 0.05  # s in which word of a subscription comes to the servant


def is_refused(communicator: Communicator, target: Target, stream: str) -> bool:
    """Return whether servants are there, and all of them tell that nobody listens to a stream.

    Whoever asks does listen. False where others listen, too: then that it may not cannot be known.
    """
    for look in range(_LOOKS):
        if look:
            time.sleep(_ON_ITS_WAY)
        servers = [info.server for info in communicator.presence.servers(target)]
        if not servers or any(_listens(communicator, target, server, stream) for server in servers):
            return False
    return True


def _listens(communicator: Communicator, target: Target, server: str, stream: str) -> bool:
    """Return whether somebody listens, or that cannot be known."""
    try:
        status = communicator.processStatus(server, realm=target.realm, timeout=_STATUS_LIMIT)
    except SystemException:
        return True
    servant = status.servants.get(str(target))
    return servant is None or servant.listened is None or stream in servant.listened
