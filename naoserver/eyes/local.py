"""Eyes that see the pictures of a robot that is served in this process."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from msgspec.structs import replace

from naoserver.eyes._pictures import PictureEyes
from naoserver.eyes.looks import read_looks
from naoserver.serving._sight import SightI
from naoserver.soccer_field import Field

_USUAL: Final = Field()
_BALL: Final = "orange"
"""The color of the ball of a soccer field."""


class _Camera:
    """A servant of a camera with the operations of its proxy. Implements `PictureCamera`."""

    def __init__(self, servant: Any) -> None:  # noqa: ANN401 - its operations are asked for by name
        self._servant: Final = servant

    def __getattr__(self, operation: str) -> Any:  # noqa: ANN401
        return lambda *arguments: getattr(self._servant, operation)(*arguments, None)


def local_sight(cameras: Mapping[str, Any], field: Field = _USUAL) -> SightI:
    """Return a servant of `Sight` that sees the pictures of cameras, given as servants by their names.

    They are on a soccer field with its ball.
    """
    looks = read_looks()
    balls = {**looks.balls, _BALL: field.ball_radius}
    looks = replace(looks, balls=balls, soccer=field, field=replace(looks.field, line=field.line))
    return SightI(PictureEyes({name: _Camera(servant) for name, servant in cameras.items()}, looks))
