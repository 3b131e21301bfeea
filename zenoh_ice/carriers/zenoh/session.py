"""Zenoh sessions according to the settings: configuration, opening, closing, and reasons of failures."""

from __future__ import annotations

import json
import logging
import math
import re
import socket
import threading
import time
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Final

import zenoh
from zenoh.handlers import Callback

from zenoh_ice.data.codec import LARGEST_BULK
from zenoh_ice.data.exceptions import (
    BusyException,
    ConfigurationException,
    ConnectFailedException,
    EndpointInUseException,
)
from zenoh_ice.data.text import printable, without_source
from zenoh_ice.settings import (
    LOOPBACK_6,
    Security,
    Settings,
    bound_endpoint,
    has_address,
    has_only_ipv6,
    host_and_port,
    uses_tls,
)
from zenoh_ice.settings.security import access_control, check_security, exposure
from zenoh_ice.threads._starting import await_at_exit, start

if TYPE_CHECKING:
    import ssl

# Our own messages say what Zenoh's warnings would, and some of its errors are none for a user, such as an
# answer after its call's timeout. RUST_LOG shows everything.
_ZENOH_LOG: Final = (
    "error,zenoh::api::handlers=off,zenoh::net::routing::hat=off,zenoh::bug=off,"
    "zenoh_transport::unicast=off,zenoh_codec=off"
)
_DELAY: Final = 100  # ms that opening waits for the endpoints; a call waits longer for its servant
_LINK_PERIOD: Final = 0.001  # s between two looks at the links that are waited for
_SELF_LIMIT: Final = 2.0  # s for the answer to its own query
_MOST_SESSIONS: Final = 1 << 14  # of a router, which counts links by itself
_STEP_LIMIT: Final = 1.0  # s for each step of finding out why an endpoint makes no link
_ALL_LIMIT: Final = 2.5  # s for all of them
# Alerts of the other side when it refuses a certificate, by patterns of their names.
_ALERTS: Final = {
    "CERTIFICATE_REQUIRED": "it asks for a certificate: give security.certificate and security.key",
    "CERTIFICATE_EXPIRED": "our certificate has expired, or a clock is wrong",
    "UNKNOWN_CA|DECRYPT_ERROR": "it does not trust the authority of our certificate",
    "CERTIFICATE_UNKNOWN|BAD_CERTIFICATE": "it does not accept our certificate",
}

_OUT_OF_DATE: Final = (9, 10)  # OpenSSL's X509_V_ERR_CERT_NOT_YET_VALID and X509_V_ERR_CERT_HAS_EXPIRED
_ANY_TIME: Final = 0x200000  # OpenSSL's X509_V_FLAG_NO_CHECK_TIME

_logger = logging.getLogger(__name__)


def open_session(settings: Settings, *, session_id: str = "") -> zenoh.Session:
    """Open a session in the mode of the settings.

    Its id is random unless `session_id` gives one, as a hexadecimal number of 128 bits. A client waits for
    the router, or the server, that it connects to, for as long as a call may take. Raises
    ConnectFailedException when none answers or lets it in, EndpointInUseException when another process
    listens already, ConfigurationException for anything else that is wrong with the settings.
    """
    zenoh.init_log_from_env_or(_ZENOH_LOG)
    for danger in (*check_security(settings), *exposure(settings)):
        _logger.warning("%s", danger)
    config = session_config(settings)
    if session_id:
        config["id"] = session_id
    try:
        session = zenoh.open(zenoh.Config.from_json5(json.dumps(config)))
    except zenoh.ZError as error:
        text = without_source(error)
        if settings.mode == "client" and "Unable to connect" in text:
            why = explain_endpoints(connect_endpoints(settings), settings.security)
            raise ConnectFailedException(why) from error
        if "in use" in text or "Unable to acquire lock" in text:  # Zenoh passes no error number
            used = [each for each in settings.listen if each.partition("/")[2] in text] or settings.listen
            why = f"port in use: another process listens on {', '.join(used)} already"
            if "Unable to acquire lock" in text:
                why = f"in use: another process holds the file .lock beside the path of {', '.join(used)}"
                why += (
                    ", as a server does that listens there; put the path in a folder that only you may write"
                )
            raise EndpointInUseException(f"{why}; stop it or choose another with --listen") from error
        if "Unable to open lock file" in text:
            raise ConfigurationException(
                f"{text}: put the path of a unixsock-stream in a folder that only you may write,"
                " or remove the file .lock beside it, which somebody else has made"
            ) from error
        if "assign requested address" in text:
            raise ConfigurationException(_explain_address(settings.listen)) from error
        raise ConfigurationException(f"Zenoh refuses the settings: {text}") from error
    if "open" in config:
        _wait_for_links(session, len(connect_endpoints(settings)))
    return session


def _wait_for_links(session: zenoh.Session, wanted: int) -> None:
    """Wait for as many links to others as are wanted, at most as long as Zenoh would."""
    end, info = time.monotonic() + _DELAY / 1000, session.info
    while len(info.peers_zid()) + len(info.routers_zid()) < wanted and time.monotonic() < end:
        time.sleep(_LINK_PERIOD)


def _explain_address(listen: Iterable[str]) -> str:
    """Return which endpoints cannot be listened on because they are not of this machine, and what to do."""
    places = {endpoint: host_and_port(endpoint) for endpoint in listen}
    absent = [endpoint for endpoint, place in places.items() if place and not has_address(place[0])]
    why = (
        f"this machine does not have the address of {', '.join(absent or places)}: name another with --listen"
    )
    return f"{why}, such as --listen '{LOOPBACK_6}', as it has only IPv6" if has_only_ipv6() else why


def close_session(session: zenoh.Session, limit: float = 2.0) -> None:
    """Close a session; continue in the background after `limit` s, if its peer accepts nothing.

    The end of the process waits for it, at most as long as Zenoh does.
    """

    def close() -> None:
        try:
            session.close()
        except zenoh.ZError as error:
            _logger.warning("the session did not end in time: %s", without_source(error))

    # Zenoh would wait for 10 s, and takes no other limit.
    thread = threading.Thread(target=close, name="zenoh_ice closing", daemon=True)
    try:
        start(thread)
    except BusyException:
        close()
        return
    thread.join(limit)
    if thread.is_alive():
        await_at_exit(thread)
        _logger.warning("the session has not ended after %g s: its peer accepts nothing any more", limit)


def undeclare(declared: Any) -> None:  # noqa: ANN401 - a queryable, a token, a listener
    """Undeclare what was declared, unless the session was closed meanwhile."""
    try:
        declared.undeclare()
    except zenoh.ZError as error:
        _logger.debug("not undeclared: %s", error)


def problem_of(session: zenoh.Session) -> str:
    """Return what keeps a session from working, or nothing: it must answer its own query within 2 s."""
    key = f"@session/{session.zid()}"

    def answer(query: zenoh.Query) -> None:
        with query:
            query.reply(key, b"")

    try:
        with session.declare_queryable(key, Callback(answer, indirect=True)):
            replies = list(session.get(key, timeout=_SELF_LIMIT))
    except zenoh.ZError as error:
        return without_source(error)
    return "" if any(reply.ok is not None for reply in replies) else f"no answer within {_SELF_LIMIT:g} s"


def session_config(settings: Settings) -> dict[str, Any]:
    """Return the configuration of Zenoh for settings that `check_security` accepts."""
    security, client = settings.security, settings.mode == "client"
    connect, listen = (
        connect_endpoints(settings),
        [] if client else [bound_endpoint(each) for each in settings.listen],
    )
    lease = round(settings.lease * 1000)
    # us for which sending may wait for its peer before the link is closed. Zenoh counts to the last
    # fragment: a large message on a slow network must not cost everybody the link.
    congestion = {"block": {"wait_before_close": round(settings.timeout * 1e6)}}
    link: dict[str, Any] = {
        "tx": {"lease": lease, "queue": {"congestion_control": congestion}},
        "rx": {"max_message_size": LARGEST_BULK + (1 << 16)},
    }
    if security.authority:
        # No link without TLS to endpoints that others report.
        link["protocols"] = sorted({endpoint.partition("/")[0] for endpoint in (*connect, *listen)})
        certificate, key = security.certificate or None, security.key or None
        link["tls"] = {
            "root_ca_certificate": security.authority,
            "close_link_on_expiration": True,
            "connect_certificate": certificate,
            "connect_private_key": key,
            "listen_certificate": certificate,
            "listen_private_key": key,
            # For a client, it means that the client shows its certificate.
            "enable_mtls": bool(certificate) and (security.mutual or client),
        }
    login = {"user": security.user, "password": security.password, "dictionary_file": security.passwords}
    config: dict[str, Any] = {
        "mode": settings.mode,
        "scouting": {
            # Only endpoints that were named: a robot must never hear the commands for another one.
            "multicast": {"enabled": False},
            # Peers do not relay: two clients of one server reach each other by the links that gossip makes.
            # With roles, no path may bypass the router that grants them.
            "gossip": {"enabled": not security.roles},
            "delay": _DELAY,
        },
        "listen": {"endpoints": listen, "exit_on_failure": True},
        "connect": {
            "endpoints": connect,
            # Zenoh waits for the first link of a client before a session is open: not forever.
            "exit_on_failure": client,
            "timeout_ms": round(settings.timeout * 1000) if client else -1,
            # A restarted server is found again within some 0.2 s.
            "retry": {"period_init_ms": 50, "period_max_ms": 200, "period_increase_factor": 2},
        },
        "transport": {
            "unicast": {
                # ms: a lost attempt to make a link must not delay the next one, which may work.
                "open_timeout": max(lease, 2000),
                "accept_timeout": max(lease, 2000),
                # Zenoh closes further connections: with its default of 100, that many silent ones would
                # lock everybody else out. A process can usually open 1024 files.
                "accept_pending": 800,
                "max_sessions": _MOST_SESSIONS if settings.mode == "router" else 1000,
            },
            "link": link,
            "auth": {"usrpwd": {name: text or None for name, text in login.items()}},
            "shared_memory": {"enabled": False},  # large values go through local sockets
        },
    }
    if settings.mode == "peer" and len(connect) > 1:
        # Zenoh would wait for the whole delay when gossip makes the link to one endpoint before it does.
        config["open"] = {"return_conditions": {"connect_scouted": False}}
    if security.roles:
        config["access_control"] = access_control(security, settings.realm)
    return config


def connect_endpoints(settings: Settings) -> list[str]:
    """Return the endpoints to connect to, without its own: a server listens on the default one."""
    return [endpoint for endpoint in settings.connect if endpoint not in settings.listen]


def explain_endpoints(endpoints: Iterable[str], security: Security, limit: float = math.inf) -> str:
    """Return why none of the endpoints can be reached, and what to do, after at most 2.5 s, or `limit` s."""
    slow = "it does not answer in time, or the name of its machine is not found"
    reasons = {endpoint: f"{endpoint}: {slow}" for endpoint in endpoints}

    def explain(endpoint: str) -> None:
        reasons[endpoint] = _explain_endpoint(endpoint, security)

    # On threads: there is no limit for looking up the name of a machine.
    threads = []
    for endpoint in reasons:
        thread = threading.Thread(target=explain, args=(endpoint,), daemon=True)
        try:
            start(thread)
        except BusyException as error:
            reasons[endpoint] = f"{endpoint}: {error}"
        else:
            threads.append(thread)
    deadline = time.monotonic() + min(_ALL_LIMIT, limit)
    for thread in threads:
        thread.join(max(0.0, deadline - time.monotonic()))
    return "; ".join(reasons.values()) or "there is no endpoint to connect to: name one with --connect"


def _explain_endpoint(endpoint: str, security: Security) -> str:
    """Return why a process that listens at an endpoint makes no link with us, or that none listens."""
    start = "start a server there, such as `naoserver-sim`, or name another endpoint with --connect"
    absent = f"nothing answers at {endpoint}: {start}"
    place = host_and_port(endpoint)
    if place is None or not endpoint.startswith(("tcp/", "tls/", "ws/")):
        return absent
    why = "it listens, but makes no link with us: does it hang, or ask for a user, a password or TLS?"
    if security.user:
        why = f"it does not accept {security.user!r}: are security.user and the password right?"
    try:
        with socket.create_connection(place, _STEP_LIMIT) as connection:
            if uses_tls(endpoint):
                why = _explain_tls(connection, place, security) or why
    except socket.gaierror:
        why = f"the machine {place[0]} is not known"
    except OSError:
        return absent
    return f"{endpoint}: {why}"


def _explain_tls(connection: socket.socket, place: tuple[str, int], security: Security) -> str:
    """Return what is wrong with TLS on a connection; nothing if it works."""
    import ssl  # here: it takes long to load, and few need it

    context = ssl.create_default_context(cafile=security.authority)
    if security.certificate:
        context.load_cert_chain(security.certificate, security.key)
    try:
        with context.wrap_socket(connection, server_hostname=place[0]) as secured:
            # In TLS 1.3 the other side checks our certificate after the handshake; if it accepts it, it waits
            # for us to send.
            secured.settimeout(_STEP_LIMIT / 4)
            secured.recv(1)
    except ssl.SSLCertVerificationError as error:
        if error.verify_code in _OUT_OF_DATE and (why := _explain_dates(place, context)):
            return why
        return f"its certificate is not accepted: {error.verify_message}; is security.authority right?"
    except ssl.SSLError as error:
        reason = error.reason or ""
        unknown = f"TLS fails, is it a TLS endpoint? ({printable(reason or str(error))})"
        return next((meaning for alert, meaning in _ALERTS.items() if re.search(alert, reason)), unknown)
    except TimeoutError:
        return ""
    except OSError:
        pass
    return "it ends the connection: is it a TLS endpoint, and our certificate one of its authority?"


def _explain_dates(place: tuple[str, int], context: ssl.SSLContext) -> str:
    """Return which certificate is not valid by our clock; nothing if it cannot be seen."""
    import ssl

    context.verify_flags |= _ANY_TIME
    try:
        with (
            socket.create_connection(place, _STEP_LIMIT) as connection,
            context.wrap_socket(connection, server_hostname=place[0]) as secured,
        ):
            shown = secured.getpeercert()
    except OSError:
        return ""
    now = time.time()
    certificates = [("its certificate", shown or {})]
    certificates += [("that of the authority", each) for each in context.get_ca_certs()]
    for whose, certificate in certificates:
        begin, end = (ssl.cert_time_to_seconds(str(certificate[name])) for name in ("notBefore", "notAfter"))
        if not begin <= now <= end:
            renew = " or renew the certificate" if now > end else ""
            return (
                f"your clock says {_date(now)}, {whose} is valid from {_date(begin)} to {_date(end)}: "
                f"set the clock{renew}"
            )
    return ""


def _date(seconds: float) -> str:
    return time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime(seconds))
