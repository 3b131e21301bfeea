"""What Zenoh is told when a session is opened: our settings in the words of its configuration."""

from __future__ import annotations

from typing import Any, Final

from ..exceptions import ConfigurationException
from ..settings import Security, Settings
from .access import access_control
from .endpoints import protocol

__all__ = ["connect_endpoints", "nested", "send_limit", "session_config"]

_RETRY_FIRST: Final = 50  # ms; with the longest, a restarted server is found again within some 0.2 s
_RETRY_LONGEST: Final = 200  # ms
_OPEN_DELAY: Final = 100  # ms that opening waits for the endpoints; whoever needs a servant waits longer
_SHORTEST_OPENING: Final = 2000  # ms after which the making of a link has failed
_KEEP_ALIVES: Final = 4  # in a lease
# Links that may be in the middle of their making. Zenoh closes further ones at once, so with its default
# of 100 as many silent connections shut everybody else out. A process usually has 1024 files.
_MOST_PENDING: Final = 800
_MESSAGE_OVERHEAD: Final = 1 << 16


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
