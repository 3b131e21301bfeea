"""The figures of the rules of a match: `rules.toml` has ours, each with where it is from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

from msgspec import Meta, Struct

from visualhfsm_match._errors import MatchError
from zenoh_ice.data.toml_file import parse_toml, read_text

RULES: Final = Path(__file__).with_name("rules.toml")

Seconds = Annotated[float, Meta(ge=0.0, le=3600.0)]
Meters = Annotated[float, Meta(gt=0.0, le=50.0)]
Places = Annotated[tuple[tuple[float, float], ...], Meta(min_length=1, max_length=11)]


class Rules(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The figures of a match, in s, m and m/s; `rules.toml` says what each is for."""

    book: str
    ready: Seconds
    set: Seconds
    ball_free: Seconds
    mercy: Annotated[int, Meta(ge=1)]
    penalty: Seconds
    penalty_increase: Seconds
    get_up: Seconds
    up: Seconds
    pushing: Seconds
    contact: Meters
    push_speed: Meters
    fall: Seconds
    motion: Meters
    stuck: Seconds
    stuck_distance: Meters
    still: Seconds
    still_distance: Meters
    reach: Meters
    kick_off: Places
    waiting: Places

    @property
    def most_players(self) -> int:
        """How many robots of a team have a place to begin at, whoever has the kick-off."""
        return min(len(self.kick_off), len(self.waiting))


def load_rules(path: Path = RULES) -> Rules:
    """Return the rules of a TOML file. Raises MatchError."""
    return parse_toml(read_text(path, MatchError.of), Rules, str(path), MatchError.of)
