"""What the patterns of a role grant, by keys of Zenoh."""

from __future__ import annotations

import zenoh

from zenoh_ice.settings import Role, Security, Settings
from zenoh_ice.settings.security import access_control


def parse_role(table: object) -> Role:
    return Settings().override(security={"roles": {"r": table}}).security.roles["r"]


def rules(role: Role, realm: str = "nao") -> list[dict[str, object]]:
    compiled = access_control(Security(roles={"r": role}, users={"u": "r"}, authority="ca.pem"), realm)
    return compiled["rules"]  # type: ignore[no-any-return]


def allows(role: Role, message: str, flow: str, key: str) -> bool:
    wanted = zenoh.KeyExpr(key)
    return any(
        message in rule["messages"]  # type: ignore[operator]
        and flow in rule["flows"]  # type: ignore[operator]
        and any(zenoh.KeyExpr(granted).includes(wanted) for granted in rule["key_exprs"])  # type: ignore[attr-defined]
        for rule in rules(role)
    )
