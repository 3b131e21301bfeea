"""The Nao, with and without joints in its hands."""

from __future__ import annotations

from typing import Final

from naoserver.bodies import family_of, find_body
from naoserver.body import Body
from naoserver.errors import RobotError

H25: Final = find_body("H25")
H21: Final = find_body("H21")
"""The H25 with hands that do not move and feel nothing."""


def require_nao(body: Body, what: str) -> None:
    """Raise RobotError, which begins with `what` needs NAOqi, unless a body is that of a Nao."""
    family = family_of(body)
    if family is None or family[1] is not H25:
        raise RobotError(f"{what}, the system of the Nao; this robot is a {body.title or body.name}")
