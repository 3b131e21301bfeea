"""Why no link can be made: try the endpoints by hand, since Zenoh tells no reasons."""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from collections.abc import Iterable
from typing import Final

from ..settings import Security
from ..text import printable
from .endpoints import host_and_port, protocol

__all__ = ["explain_endpoint", "explain_endpoints"]

_LIMIT: Final = 1.0  # s for each step at an endpoint
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
    """Return why whoever listens at an endpoint makes no link with us; nothing if nobody listens."""
    place = host_and_port(endpoint)
    if place is None or protocol(endpoint).name not in ("tcp", "tls", "ws"):
        return ""
    try:
        with socket.create_connection(place, _LIMIT) as connection:
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
            secured.settimeout(_LIMIT / 4)
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
