"""Show who may do what, as a table, and as the configuration of Zenoh's own router."""

from __future__ import annotations

import json
from pathlib import Path

from rich.table import Table

from deploy.router import check_router
from zenoh_ice.network.security import check_security
from zenoh_ice.network.session_config import nested, session_config
from zenoh_ice.settings import Settings

__all__ = ["access_table", "identification", "zenohd_config"]


def identification(settings: Settings) -> str:
    """Return as whom a component with these settings is known, and until when.

    Raises SecurityFilesError for a certificate that cannot be read.
    """
    from deploy.security.certificates import common_name, load_certificate

    if not settings.security.certificate:
        user = settings.security.user
        return f"known as user {user}, by a password" if user else "known by nothing"
    certificate = load_certificate(Path(settings.security.certificate))
    return f"known as {common_name(certificate)}, until {certificate.not_valid_after_utc:%Y-%m-%d}"


def access_table(settings: Settings) -> Table:
    """Return a table of the roles of some settings: who has them, and what they grant."""
    table = Table("role", "users", "call", "read", "oneway", "serve", title=f"realm {settings.realm}")
    for name, role in settings.security.roles.items():
        users = [user for user, granted in settings.security.users.items() if granted == name]
        lists = (users, role.call, role.read, role.oneway, role.serve)
        table.add_row(name, *("\n".join(items) or "-" for items in lists))
    return table


def zenohd_config(settings: Settings, source: Path) -> str:
    """Return what `zenohd --config` reads, so that it does what our router does with these settings.

    Raises ConfigurationException for settings that are no router's, and what making a session of them would.
    """
    check_router(settings)
    check_security(settings.security)
    values = nested(session_config(settings))
    comment = f"// Made from {source.name} by `nao security zenohd`; do not edit.\n"
    return comment + json.dumps(values, indent=2) + "\n"
