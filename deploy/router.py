"""The router: it passes on what the processes of several machines say, and lets each say what it may.

Zenoh's own threads route; none of what passes is seen by Python.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from types import TracebackType
from typing import Self

import zenoh
from zenoh.handlers import Callback

from zenoh_ice.command import stop_on_signals
from zenoh_ice.exceptions import ConfigurationException
from zenoh_ice.session import client_token, close_session, open_session
from zenoh_ice.settings import DEFAULT_ENDPOINT, Settings
from zenoh_ice.text import printable

__all__ = ["DEFAULTS", "Router", "check_router", "serve"]

DEFAULTS = {"mode": "router", "connect": (), "listen": (DEFAULT_ENDPOINT,), "log_level": "info"}
"""Settings of a router where they differ from those of other components."""


_logger = logging.getLogger(__name__)


class Router:
    """A router, until closed.

    Raises ConfigurationException for settings that are not of a router, and what
    `zenoh_ice.session.open_session` does.
    """

    def __init__(self, settings: Settings) -> None:
        check_router(settings)
        self._session = open_session(settings)
        if not all(role.liveliness for role in settings.security.roles.values()):
            # Who may hold no token cannot let a robot know that it reads no memory of the robot's machine.
            token = client_token(settings.realm, str(self._session.zid()))
            self._reader = self._session.liveliness().declare_token(token)
        self._links = self._session.info.declare_link_events_listener(
            Callback(self._on_link, indirect=True), history=True
        )

    def close(self) -> None:
        """Take no more links and end those that there are."""
        self._links.undeclare()
        close_session(self._session)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _on_link(self, event: zenoh.LinkEvent) -> None:
        link = event.link
        who = f"{printable(link.auth_identifier, 64)!r}" if link.auth_identifier else "somebody unnamed"
        came = event.kind == zenoh.SampleKind.PUT
        _logger.info("%s %s, at %s, process %s", who, "came" if came else "left", link.dst, link.zid)


def check_router(settings: Settings) -> None:
    """Raise ConfigurationException for settings that are somebody else's, such as a user's."""
    if settings.mode != "router":
        origin = settings.origins.get("mode", "the program")
        raise ConfigurationException(
            f"{origin}: mode = {settings.mode!r}: not the settings of a router; `nao security init` makes"
            " router.toml for it"
        )
    if not settings.listen:
        origin = settings.origins.get("listen", "the program")
        raise ConfigurationException(f"{origin}: listen = []: a router needs an endpoint to listen on")


def serve(settings: Settings, tell: Callable[[str], None]) -> None:
    """Run a router until a signal comes, then exit; `tell` is given a line once it is reached."""
    with stop_on_signals() as stop, Router(settings):
        security = settings.security
        asks = bool(security.passwords or (security.authority and security.mutual))
        if security.roles:
            access = f"each may do what the roles {', '.join(security.roles)} grant"
        else:
            access = f"{'whoever is let in' if asks else 'everybody'} may do everything"
        tell(f"the router listens on {', '.join(settings.listen)}; {access}")
        stop.wait()
