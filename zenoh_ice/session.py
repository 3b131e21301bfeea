"""Zenoh sessions as the settings ask for them: their configuration, opening and closing, and what fails."""

from __future__ import annotations

import contextlib
import json
import logging
import socket
import threading
import time
from collections.abc import Iterable, Sequence
from typing import Any, Final

import zenoh

from ._tokens import client_token
from .endpoints import host_and_port, protocol
from .exceptions import ConfigurationException, ConnectFailedException, EndpointInUseException
from .security import access_control, check_security, exposure
from .settings import Security, Settings
from .text import printable, without_source

__all__ = [
    "client_token",
    "close_session",
    "connect_endpoints",
    "explain_endpoint",
    "explain_endpoints",
    "nested",
    "open_session",
    "send_limit",
    "session_config",
]

# The configuration.

_RETRY_FIRST: Final = 50  # ms; with the longest, a restarted server is found again within some 0.2 s
_RETRY_LONGEST: Final = 200  # ms
_OPEN_DELAY: Final = 100  # ms that opening waits for the endpoints; a call waits longer for its servant
_SHORTEST_OPENING: Final = 2000  # ms after which the making of a link has failed
_KEEP_ALIVES: Final = 4  # in a lease
# Links that may be in the middle of their making. Zenoh closes further ones at once, so with its default
# of 100 as many silent connections shut everybody else out. A process usually has 1024 files.
_MOST_PENDING: Final = 800
_MESSAGE_OVERHEAD: Final = 1 << 16

# Opening and closing.

# Our own messages say what Zenoh's warnings would. Some of its errors are none for a user: an answer that
# came after its call's timeout, a link that a bad network let fail and that is tried again, the end of what
# was never allowed to begin. RUST_LOG shows everything.
_ZENOH_LOG: Final = (
    "error,zenoh::api::handlers=off,zenoh::net::routing::hat=off,zenoh_transport::unicast=off,zenoh_codec=off"
)
# What tells that another process listens already; Zenoh passes no error number.
_IN_USE: Final = ("in use", "Unable to acquire lock")

_CLOSE_LIMIT: Final = 2.0  # s

# What keeps a link from being made.

_STEP_LIMIT: Final = 1.0  # s for each step at an endpoint
_ALL_LIMIT: Final = 2.5  # s for all of them
_SLOW: Final = "it does not answer in time, or the name of its machine is not found"
_START: Final = (
    "start a server there, for instance with `naoserver-sim`, or name another endpoint with --connect"
)
# What the other side says when it refuses a certificate, by words in the alert's name.
_ALERTS: Final = {
    "CERTIFICATE_REQUIRED": "it asks for a certificate: give security.certificate and security.key",
    "UNKNOWN_CA": "it does not trust the authority of our certificate",
    "CERTIFICATE_UNKNOWN": "it does not accept our certificate",
    "CERTIFICATE_EXPIRED": "our certificate has expired, or a clock is wrong",
    "BAD_CERTIFICATE": "it does not accept our certificate",
    "DECRYPT_ERROR": "it does not trust the authority of our certificate",
}

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


def session_config(settings: Settings) -> dict[str, Any]:
    """Return the values of Zenoh's configuration by their paths, such as `connect/endpoints`.

    Raises ConfigurationException for a TLS endpoint without an authority or, to listen, a certificate, and
    for a client that would grant access.
    """
    lease = round(settings.lease * 1000)
    values: dict[str, Any] = {
        "mode": settings.mode,
        # Only endpoints that were named: a robot must never hear the commands for another one.
        "scouting/multicast/enabled": False,
        # Peers do not relay: two clients of one server reach each other by the links that gossip makes. Where
        # there are roles nobody is to find a way past those who grant them.
        "scouting/gossip/enabled": not settings.security.roles,
        "scouting/delay": _OPEN_DELAY,
        # A client has one link, to whom it connects.
        "listen/endpoints": [] if settings.mode == "client" else list(settings.listen),
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
        "transport/unicast/accept_pending": _MOST_PENDING,
        "transport/link/tx/keep_alive": _KEEP_ALIVES,
        "transport/link/tx/queue/congestion_control/block/wait_before_close": round(
            send_limit(settings) * 1e6
        ),
        "transport/link/rx/max_message_size": settings.max_bulk_size + _MESSAGE_OVERHEAD,
        # Ours is another: see `wire.shared_memory`.
        "transport/shared_memory/enabled": False,
    }
    if settings.mode == "client":
        # Zenoh waits for the first link of a client before a session is open: not for ever.
        values["connect/exit_on_failure"] = True
        values["connect/timeout_ms"] = round(settings.timeout * 1000)
    values |= _tls(settings)
    values |= _passwords(settings.security)
    if settings.security.roles:
        if settings.mode == "client":
            raise ConfigurationException(
                "security.roles in a client: they belong into the settings of the router, or of the server, "
                "that others connect to"
            )
        mute = [name for name, role in settings.security.roles.items() if not role.liveliness]
        if mute and settings.mode == "peer" and settings.shared_memory:
            raise ConfigurationException(
                f"security.roles.{mute[0]}.liveliness = false needs shared_memory = false: who holds no "
                "token cannot let this component know that it reads no memory of this machine"
            )
        values["access_control"] = access_control(
            settings.security.roles,
            settings.security.users,
            settings.realm,
            certificates=settings.security.has_tls and settings.security.mutual,
            passwords=bool(settings.security.passwords),
        )
    return values


def nested(values: dict[str, Any]) -> dict[str, Any]:
    """Return values by paths as the tables in tables of a configuration file."""
    root: dict[str, Any] = {}
    for path, value in values.items():
        *tables, name = path.split("/")
        table = root
        for key in tables:
            table = table.setdefault(key, {})
        table[name] = value
    return root


def connect_endpoints(settings: Settings) -> list[str]:
    """Return the endpoints of others: a server listens where everybody else connects to by default."""
    return [endpoint for endpoint in settings.connect if endpoint not in settings.listen]


def send_limit(settings: Settings) -> float:
    """Return for how many s sending a message may wait for its peer, before the link is closed."""
    # For as long as a call may take: Zenoh counts it from a message's first fragment that has to wait to its
    # last, and a large one on a busy machine or a slow network must not cost everybody the link.
    return settings.timeout


def _tls(settings: Settings) -> dict[str, Any]:
    security = settings.security
    listening = [] if settings.mode == "client" else settings.listen
    for endpoint in (*connect_endpoints(settings), *listening):
        if protocol(endpoint).uses_tls and not security.authority:
            raise ConfigurationException(
                f"{endpoint} needs security.authority: the certificate of who vouches for the other side"
            )
    for endpoint in listening:
        if protocol(endpoint).uses_tls and not security.certificate:
            raise ConfigurationException(
                f"to listen on {endpoint} needs security.certificate and security.key: what the others know "
                "this component by"
            )
    if not security.has_tls:
        return {}
    named = {protocol(endpoint).name for endpoint in (*connect_endpoints(settings), *listening)}
    values: dict[str, Any] = {
        # No link without TLS to where others say that somebody is.
        "transport/link/protocols": sorted(named),
        "transport/link/tls/root_ca_certificate": security.authority,
        "transport/link/tls/close_link_on_expiration": True,
    }
    if security.certificate:
        for direction in ("connect", "listen"):
            values[f"transport/link/tls/{direction}_certificate"] = security.certificate
            values[f"transport/link/tls/{direction}_private_key"] = security.key
        # Of a client it means that it shows its certificate.
        values["transport/link/tls/enable_mtls"] = security.mutual or settings.mode == "client"
    return values


def _passwords(security: Security) -> dict[str, Any]:
    values: dict[str, Any] = {}
    if security.user:
        values["transport/auth/usrpwd/user"] = security.user
        values["transport/auth/usrpwd/password"] = security.password
    if security.passwords:
        values["transport/auth/usrpwd/dictionary_file"] = security.passwords
    return values


def explain_endpoints(endpoints: Iterable[str], security: Security) -> str:
    """Return why none of some endpoints leads anywhere, and what to do; it takes some two seconds at most."""
    endpoints = list(dict.fromkeys(endpoints))
    found: dict[str, str] = {}

    def explain(endpoint: str) -> None:
        found[endpoint] = explain_endpoint(endpoint, security)

    # On threads: looking up the name of a machine takes as long as it takes.
    threads = [
        threading.Thread(target=explain, args=(endpoint,), name=f"looking at {endpoint}", daemon=True)
        for endpoint in endpoints
    ]
    for thread in threads:
        thread.start()
    deadline = time.monotonic() + _ALL_LIMIT
    for thread in threads:
        thread.join(max(0.0, deadline - time.monotonic()))
    reasons = {endpoint: found.get(endpoint, _SLOW) for endpoint in endpoints}
    absent = [endpoint for endpoint, reason in reasons.items() if not reason]
    told = [f"{endpoint}: {reason}" for endpoint, reason in reasons.items() if reason]
    if absent:
        told.insert(0, f"nothing answers at {', '.join(absent)}: {_START}")
    return "; ".join(told) or "there is no endpoint to connect to: name one with --connect"


def explain_endpoint(endpoint: str, security: Security) -> str:
    """Return why a process that listens at an endpoint makes no link with us; nothing if none listens."""
    place = host_and_port(endpoint)
    if place is None or protocol(endpoint).name not in ("tcp", "tls", "ws"):
        return ""
    try:
        with socket.create_connection(place, _STEP_LIMIT) as connection:
            if protocol(endpoint).uses_tls:
                return _explain_tls(connection, place[0], security)
    except socket.gaierror:
        return f"the machine {place[0]} is not known"
    except OSError:
        return ""
    return _refused(security)


def _explain_tls(connection: socket.socket, host: str, security: Security) -> str:
    import ssl  # here: it takes long to load, and few need it

    context = ssl.create_default_context(cafile=security.authority)
    if security.certificate:
        context.load_cert_chain(security.certificate, security.key)
    try:
        with context.wrap_socket(connection, server_hostname=host) as secured:
            # In TLS 1.3 the other side judges our certificate after the handshake; if it likes it, it waits
            # for us to speak.
            secured.settimeout(_STEP_LIMIT / 4)
            with contextlib.suppress(TimeoutError):
                secured.recv(1)
    except ssl.SSLCertVerificationError as error:
        why = printable(error.verify_message)
        return f"its certificate is not accepted: {why}; is security.authority right?"
    except ssl.SSLError as error:
        reason = error.reason or ""
        for alert, meaning in _ALERTS.items():
            if alert in reason:
                return meaning
        return f"TLS fails, is it a TLS endpoint? ({printable(reason or str(error))})"
    except OSError:
        return "it ends the connection: is it a TLS endpoint, and our certificate one of its authority?"
    return _refused(security)


def _refused(security: Security) -> str:
    if security.user:
        return f"it does not let {security.user!r} in: are security.user and the password right?"
    return (
        "it listens, but makes no link with us: does it hang, or ask for a user and a password, or for TLS?"
    )
