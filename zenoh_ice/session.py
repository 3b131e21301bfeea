"""Open Zenoh sessions the way the house needs them."""

from __future__ import annotations

import json
import logging
import re
from collections.abc import Sequence
from typing import Final

import zenoh

from .exceptions import ConfigurationException, EndpointInUseException
from .settings import Settings

__all__ = ["close_session", "connect_endpoints", "open_session", "send_limit"]

_RETRY_FIRST: Final = 50  # ms; with the longest, a restarted server is found again within some 0.2 s
_RETRY_LONGEST: Final = 200  # ms
_OPEN_DELAY: Final = 100  # ms that opening waits for the endpoints; whoever needs a servant waits longer
_SHORTEST_OPENING: Final = 2000  # ms after which the making of a link has failed
_KEEP_ALIVES: Final = 4  # in a lease
_MESSAGE_OVERHEAD: Final = 1 << 16
# Our own messages tell what Zenoh's warnings would. Some of its errors are none for a user: an answer that came
# after its call's timeout, a link that a bad network let fail and that is tried again. RUST_LOG shows all.
_ZENOH_LOG: Final = (
    "error,zenoh::api::handlers=off,zenoh_transport::unicast::establishment=off,zenoh_codec=off"
)
_SOURCE_PLACE: Final = re.compile(r" at /\S+\.rs:\d+\.?")

_logger = logging.getLogger(__name__)


def open_session(settings: Settings) -> zenoh.Session:
    """Open a session as a peer that talks to every other peer directly.

    Raises EndpointInUseException when another process listens already, ConfigurationException for anything
    else that Zenoh refuses.
    """
    zenoh.init_log_from_env_or(_ZENOH_LOG)
    lease = round(settings.lease * 1000)
    values = {
        "mode": "peer",
        # Only endpoints that were named: a robot must never hear the commands for another one.
        "scouting/multicast/enabled": False,
        # Peers do not relay: two clients of one server reach each other by the links that gossip makes.
        "scouting/gossip/enabled": True,
        "scouting/delay": _OPEN_DELAY,
        "listen/endpoints": list(settings.listen),
        "listen/exit_on_failure": True,
        "connect/endpoints": connect_endpoints(settings),
        "connect/exit_on_failure": False,
        "connect/timeout_ms": -1,
        "connect/retry": {
            "period_init_ms": _RETRY_FIRST,
            "period_max_ms": _RETRY_LONGEST,
            "period_increase_factor": 2,
        },
        "transport/link/tx/lease": lease,
        # A link whose making got lost on the way must not keep the next one, that may work, waiting.
        "transport/unicast/open_timeout": max(lease, _SHORTEST_OPENING),
        "transport/unicast/accept_timeout": max(lease, _SHORTEST_OPENING),
        "transport/link/tx/keep_alive": _KEEP_ALIVES,
        "transport/link/tx/queue/congestion_control/block/wait_before_close": round(
            send_limit(settings) * 1e6
        ),
        "transport/link/rx/max_message_size": settings.max_bulk_size + _MESSAGE_OVERHEAD,
        "transport/shared_memory/enabled": settings.shared_memory,
    }
    config = zenoh.Config()
    try:
        for key, value in values.items():
            config.insert_json5(key, json.dumps(value))
        return zenoh.open(config)
    except zenoh.ZError as error:
        raise _explain(error, settings.listen) from error


def close_session(session: zenoh.Session) -> None:
    """Close a session; one whose peer takes nothing any more, so that it cannot end in time, is only told."""
    try:
        session.close()
    except zenoh.ZError as error:
        _logger.warning("the session did not end in time: %s", _SOURCE_PLACE.sub("", str(error)))


def connect_endpoints(settings: Settings) -> list[str]:
    """Return the endpoints of others: a server listens where everybody else connects to by default."""
    return [endpoint for endpoint in settings.connect if endpoint not in settings.listen]


def send_limit(settings: Settings) -> float:
    """Return for how many s sending a message may wait for its peer, before the link is closed."""
    # For as long as a call may take: Zenoh counts it from a message's first fragment that has to wait to its
    # last, and a large one on a busy machine or a slow network must not cost everybody the link.
    return settings.timeout


def _explain(error: zenoh.ZError, listen: Sequence[str]) -> EndpointInUseException | ConfigurationException:
    text = str(error)
    if "in use" in text:  # of the system's "Address already in use"; Zenoh passes no error number
        used = next((endpoint for endpoint in listen if endpoint in text), ", ".join(listen))
        return EndpointInUseException(
            f"port in use: another process listens on {used} already; stop it or choose another with --listen"
        )
    # Zenoh adds the places in its sources, nothing to a user.
    return ConfigurationException(f"Zenoh refuses the settings: {_SOURCE_PLACE.sub('', text)}")
