"""The Nao, with and without joints in its hands."""

from __future__ import annotations

from typing import Final

from naoserver.bodies import find_body, require_family
from naoserver.bodies.body import Body

H25: Final = find_body("H25")
H21: Final = find_body("H21")
"""The H25 with hands that do not move and feel nothing."""


def require_nao(body: Body, what: str) -> None:
    """Raise RobotError, which begins with `what` needs NAOqi, unless a body is that of a Nao."""
    require_family(body, H25.name, f"{what}, the system of the Nao")
