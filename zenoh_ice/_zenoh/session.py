"""Open Zenoh sessions the way the house needs them."""

from __future__ import annotations

import json
import logging
import threading
from collections.abc import Sequence
from typing import Final

import zenoh

from ..exceptions import ConfigurationException, ConnectFailedException, EndpointInUseException
from ..network.link_check import explain_endpoints
from ..network.security import check_security, exposure
from ..network.session_config import connect_endpoints, send_limit, session_config
from ..settings import Settings
from ..text import without_source

__all__ = ["close_session", "connect_endpoints", "open_session", "send_limit"]

# Our own messages tell what Zenoh's warnings would. Some of its errors are none for a user: an answer that
# came after its call's timeout, a link that a bad network let fail and that is tried again, the end of what
# was never allowed to begin. RUST_LOG shows everything.
_ZENOH_LOG: Final = (
    "error,zenoh::api::handlers=off,zenoh::net::routing::hat=off,zenoh_transport::unicast=off,zenoh_codec=off"
)
# What tells that another process listens already; Zenoh passes no error number.
_IN_USE: Final = ("in use", "Unable to acquire lock")

_CLOSE_LIMIT: Final = 2.0  # s

_logger = logging.getLogger(__name__)


def open_session(settings: Settings) -> zenoh.Session:
    """Open a session in the mode of the settings, usually as a peer that talks to every other peer directly.

    A client waits for the router, or the server, that it connects to, for as long as a call may take. Raises
    ConnectFailedException when none answers or lets it in, EndpointInUseException when another process
    listens already, ConfigurationException for anything else that is wrong with the settings.
    """
    zenoh.init_log_from_env_or(_ZENOH_LOG)
    for danger in (*check_security(settings.security), *exposure(settings)):
        _logger.warning("%s", danger)
    values = session_config(settings)
    config = zenoh.Config()
    try:
        for key, value in values.items():
            config.insert_json5(key, json.dumps(value))
        return zenoh.open(config)
    except zenoh.ZError as error:
        if settings.mode == "client" and "Unable to connect" in str(error):
            endpoints = connect_endpoints(settings)
            raise ConnectFailedException(
                explain_endpoints(endpoints, settings.security), endpoints
            ) from error
        raise _explain(error, settings.listen) from error


def close_session(session: zenoh.Session) -> None:
    """Close a session; one that takes long, since its peer takes nothing any more, goes on by itself."""

    def close() -> None:
        try:
            session.close()
        except zenoh.ZError as error:
            _logger.warning("the session did not end in time: %s", without_source(error))

    # Zenoh would wait for 10 s, and takes no other limit.
    thread = threading.Thread(target=close, name="zenoh_ice closing", daemon=True)
    thread.start()
    thread.join(_CLOSE_LIMIT)
    if thread.is_alive():
        _logger.warning("the session has not ended after %g s: its peer takes nothing any more", _CLOSE_LIMIT)


def _explain(error: zenoh.ZError, listen: Sequence[str]) -> EndpointInUseException | ConfigurationException:
    text = str(error)
    if any(words in text for words in _IN_USE):
        used = next(
            (endpoint for endpoint in listen if endpoint in text or endpoint.partition("/")[2] in text),
            ", ".join(listen),
        )
        return EndpointInUseException(
            f"port in use: another process listens on {used} already; stop it or choose another with --listen"
        )
    return ConfigurationException(f"Zenoh refuses the settings: {without_source(error)}")
