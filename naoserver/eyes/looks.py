"""What eyes look for in pictures: colors, balls, fields, robots and tags, as a TOML file says it."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Annotated

from msgspec import Meta, Struct

from naoserver.soccer_field import Field
from zenoh_ice import ZenohIceError
from zenoh_ice.data.toml_file import parse_toml, read_text

_Hue = Annotated[float, Meta(ge=0.0, le=360.0, description="write degrees from 0 to 360")]
_Share = Annotated[float, Meta(ge=0.0, le=1.0, description="write a share from 0 to 1")]
_Size = Annotated[float, Meta(gt=0.0, le=5.0, description="write m above 0, 5 at most")]


class EyesError(ZenohIceError):
    """Something that eyes cannot do; the text says why, and what to do."""


class _Table(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A table of the file."""


class Tint(_Table, frozen=True):
    """Which pixels have a color: hues in degrees from the first to the second, also past 360."""

    hue: tuple[_Hue, _Hue]
    saturation: _Share
    value: _Share


class FieldLooks(_Table, frozen=True):
    """A soccer field: the color of its grass, and the width of its lines in m."""

    grass: Tint
    line: _Size


class RobotLooks(_Table, frozen=True):
    """Other robots: the colors that their shirts may have, and where their middle is in m.

    That is behind the edge of their feet, and above the floor.
    """

    shirts: tuple[str, ...]
    depth: _Size
    height: _Size


class TagLooks(_Table, frozen=True):
    """Tags of ArUco's 4x4_250: the side of their black square in m."""

    size: _Size


class Looks(_Table, frozen=True):
    """What eyes look for. Raises ValueError for a color without a tint."""

    colors: dict[str, Tint]
    balls: dict[str, _Size]
    """The radius in m of balls of a color."""
    field: FieldLooks
    robots: RobotLooks
    tags: TagLooks
    soccer: Field = Field()
    """The soccer field on which they are, whose ball is orange."""

    def __post_init__(self) -> None:
        for name in (*self.balls, *self.robots.shirts):
            if name not in self.colors:
                raise ValueError(f"there is no color {name}: write it in [colors]")


def read_looks(path: Path | None = None) -> Looks:
    """Return what a file says, by default eyes.toml. Raises EyesError that names file, line and key."""
    if path is None:
        path = Path(str(resources.files(__package__) / "eyes.toml"))
    return parse_toml(read_text(path, EyesError), Looks, str(path), EyesError)
