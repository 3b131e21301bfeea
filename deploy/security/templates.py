"""The files of settings that go with the certificates: of the router, of the robot, and of each user."""

from __future__ import annotations

import json
from typing import Final

__all__ = ["CLIENT_ROLES", "client_settings", "router_settings"]

CLIENT_ROLES: Final = ("robot", "operator", "student")
"""The roles that the file of a router begins with."""

_ROUTER: Final = """\
# Settings of the router: nao router --config router.toml
realm = {realm}
mode = "router"
connect = []
listen = [{listen}]

[security]
authority = "authority.pem"
certificate = "router.pem"
key = "router.key"

# What each role may do. What no role grants is denied.
#   call    operations to call, and to read where they are streams, as IDENTITY.OPERATION
#   read    streams to read, without calling anything
#   oneway  operations to call oneway
#   serve   identities to serve
# `*` stands for any characters of a name; `**` alone is everything.

[security.roles.robot]
serve = ["**"]

[security.roles.operator]
call = ["**"]
oneway = ["**"]
serve = ["Hfsm.*"]

[security.roles.student]
call = ["*.get*", "Safety.emergencyStop"]
read = ["**"]

# The role of each certificate, by its common name; "*" is everybody who is let in.
[security.users]
{users}"""

_CLIENT: Final = """\
# Settings of {name}, who has the role {role} at the router: COMMAND --config {name}.toml
realm = {realm}
mode = "client"
connect = [{connect}]
listen = []

[security]
authority = "authority.pem"
certificate = "{name}.pem"
key = "{name}.key"
"""


def router_settings(realm: str, listen: str, users: dict[str, str]) -> str:
    """Return the text of the router's file; `users` gives the role of each."""
    lines = "".join(f"{json.dumps(user)} = {json.dumps(role)}\n" for user, role in users.items())
    return _ROUTER.format(realm=json.dumps(realm), listen=json.dumps(listen), users=lines)


def client_settings(name: str, role: str, realm: str, connect: str) -> str:
    """Return the text of the file of a robot or a user."""
    return _CLIENT.format(name=name, role=role, realm=json.dumps(realm), connect=json.dumps(connect))
