"""The router: it forwards messages between the processes of several machines, as far as each has the right.

Zenoh's own threads do the routing; no message passes through Python.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from functools import partial

import zenoh
from zenoh.handlers import Callback

from hfsm_command.cli import stop_on_signals
from hfsm_command.watchdog import Watchdog
from zenoh_ice.exceptions import ConfigurationException
from zenoh_ice.session import client_token, close_session, open_session, problem_of
from zenoh_ice.settings import DEFAULT_ENDPOINT, Settings
from zenoh_ice.text import printable

__all__ = ["DEFAULTS", "check_router", "serve"]

DEFAULTS = {"mode": "router", "connect": (), "listen": (DEFAULT_ENDPOINT,), "log_level": "info"}
"""Settings of a router where they differ from those of other components."""

_logger = logging.getLogger(__name__)


def check_router(settings: Settings) -> None:
    """Raise ConfigurationException for settings that are not a router's."""
    if settings.mode != "router":
        origin = settings.origins.get("mode", "the program")
        raise ConfigurationException(
            f"{origin}: mode = {settings.mode!r}: not the settings of a router; `nao security init` makes"
            " router.toml for it"
        )
    if not settings.listen:
        origin = settings.origins.get("listen", "the program")
        raise ConfigurationException(f"{origin}: listen = []: a router needs an endpoint to listen on")


def serve(settings: Settings, report: Callable[[str], Watchdog | None]) -> None:
    """Run a router until a signal arrives, then exit; `report` gets a line once the router can be reached.

    What it returns gets reports from then on that the router works: its session answers its own query.

    Raises ConfigurationException for settings that are not a router's, and the exceptions of
    `zenoh_ice.session.open_session`.
    """
    check_router(settings)
    security = settings.security
    if security.roles:
        access = f"each may do what the roles {', '.join(security.roles)} grant"
    else:
        asks = bool(security.passwords or (security.authority and security.mutual))
        access = f"{'every accepted user' if asks else 'everybody'} may do everything"
    with stop_on_signals() as stop:
        session = open_session(settings)
        try:
            if not all(role.liveliness for role in security.roles.values()):
                # A client without a token cannot report that it does not share the robot's memory.
                token = client_token(settings.realm, str(session.zid()))
                _held = session.liveliness().declare_token(token)
            listener = Callback(_log_link, indirect=True)
            links = session.info.declare_link_events_listener(listener, history=True)
            watchdog = report(f"the router listens on {', '.join(settings.listen)}; {access}") or Watchdog()
            watchdog.wait(stop, partial(problem_of, session))
            links.undeclare()
        finally:
            close_session(session)


def _log_link(event: zenoh.LinkEvent) -> None:
    link = event.link
    who = f"{printable(link.auth_identifier, 64)!r}" if link.auth_identifier else "an unnamed client"
    came = event.kind == zenoh.SampleKind.PUT
    _logger.info("%s %s, at %s, process %s", who, "came" if came else "left", link.dst, link.zid)
