"""The router: it forwards messages between the processes of several machines, as far as each has the right.

Zenoh's own threads do the routing. Python only passes on the encrypted bytes of TLS connections, as
`admission.py` says.
"""

from __future__ import annotations

import logging
import os
import socket
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import partial
from typing import Final

import zenoh
from zenoh.handlers import Callback

from nao_tools._deployment.admission import LIMITS, LISTENERS, Admission, AdmissionLimits
from zenoh_ice.application.cli import stop_on_signals
from zenoh_ice.application.watchdog import Watchdog
from zenoh_ice.carriers.zenoh.session import close_session, open_session, problem_of
from zenoh_ice.data.exceptions import ConfigurationException, EndpointInUseException
from zenoh_ice.data.text import printable
from zenoh_ice.settings import Settings, host_and_port
from zenoh_ice.settings.security import exposure

# For endpoints without TLS: a second thread that makes and ends links, so that silent connections shut nobody
# out (docs/decisions/0007-limits-of-a-lab-network.md).
_THREADS: Final = "(acc: (worker_threads: 2))"
_TLS: Final = "tls/"
_ATTEMPTS: Final = 3  # to find free ports

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


def serve(
    settings: Settings, report: Callable[[str], Watchdog | None], limits: AdmissionLimits = LIMITS
) -> None:
    """Run a router until a signal arrives, then exit; `report` gets a line once the router can be reached.

    What it returns gets reports from then on that the router works: its session answers its own query.

    Raises ConfigurationException for settings that are not a router's, and the exceptions of
    `zenoh_ice.carriers.zenoh.session.open_session`.
    """
    check_router(settings)
    security = settings.security
    if security.roles:
        access = f"each may do what the roles {', '.join(security.roles)} grant"
    else:
        asks = bool(security.passwords or (security.authority and security.mutual))
        access = f"{'every accepted user' if asks else 'everybody'} may do everything"
    os.environ.setdefault("ZENOH_RUNTIME", _THREADS)
    with stop_on_signals() as stop, ExitStack() as opened:
        session, ports = _open(settings)
        opened.callback(close_session, session)
        doors = [each for each in settings.listen if each.startswith(_TLS)]
        admission = Admission(doors, ports, limits)
        opened.callback(admission.close)
        listener = Callback(partial(_on_link, admission), indirect=True)
        links = session.info.declare_link_events_listener(listener, history=True)
        opened.callback(links.undeclare)
        watchdog = report(f"the router listens on {', '.join(settings.listen)}; {access}") or Watchdog()
        watchdog.wait(stop, partial(problem_of, session))


def _open(settings: Settings) -> tuple[zenoh.Session, Sequence[int]]:
    """Open a session that listens on loopback in place of its TLS endpoints; return its ports there, too."""
    secure = [each for each in settings.listen if each.startswith(_TLS)]
    if not secure:
        return open_session(settings), ()
    for danger in exposure(settings.override(listen=secure)):
        _logger.warning("%s", danger)
    others = [each for each in settings.listen if each not in secure]
    left = _ATTEMPTS
    while True:
        ports = _free_ports(LISTENERS)
        inner = [f"{_TLS}127.0.0.1:{port}" for port in ports]
        try:
            return open_session(settings.override(listen=[*others, *inner])), ports
        except EndpointInUseException:  # somebody took one of them meanwhile
            left -= 1
            if not left:
                raise


def _free_ports(number: int) -> list[int]:
    """Return ports of loopback that nobody uses now: Zenoh does not report which it takes by itself."""
    with ExitStack() as held:
        probes = [held.enter_context(socket.create_server(("127.0.0.1", 0))) for _ in range(number)]
        return [int(probe.getsockname()[1]) for probe in probes]


def _on_link(admission: Admission, event: zenoh.LinkEvent) -> None:
    """Log a link that came or left, and let it count for its certificate."""
    link = event.link
    certificate = printable(link.auth_identifier or "", 64)
    who = repr(certificate) if certificate else "an unnamed client"
    came = event.kind == zenoh.SampleKind.PUT
    place = host_and_port(link.dst)
    if place and came:
        admission.identify(place[1], certificate)
    where = (place and admission.origin(place[1])) or link.dst
    _logger.info("%s %s, at %s, process %s", who, "came" if came else "left", where, link.zid)
