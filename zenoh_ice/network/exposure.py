"""What others could do because of how a component listens: told before it does."""

from __future__ import annotations

from ..settings import Settings
from .endpoints import is_loopback, protocol

__all__ = ["exposure"]


def exposure(settings: Settings) -> list[str]:
    """Return a sentence for each danger in where, and to whom, a component listens."""
    if settings.mode == "client":
        return []
    security = settings.security
    told: list[str] = []
    for endpoint in settings.listen:
        if is_loopback(endpoint):
            continue
        if not protocol(endpoint).uses_tls:
            told.append(
                f"listening on {endpoint} without TLS: anyone on that network can "
                + (
                    "read and change"
                    if security.passwords
                    else "see through the cameras, move the robot and read"
                )
                + " everything that is said; listen on tls/... with [security] (make its files with "
                "`nao security init`), or on 127.0.0.1 alone"
            )
        elif not security.mutual and not security.passwords:
            told.append(
                f"listening on {endpoint}, where security.mutual is false and there are no passwords: anyone "
                "on that network can see through the cameras and move the robot"
            )
        elif not security.roles:
            told.append(
                f"listening on {endpoint} without security.roles: everybody who is let in may do everything"
            )
    return told
