"""What is played and by which rules: `rules.toml` has their figures, `formats/` what else differs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Final

from msgspec import Meta, Struct

from naoserver.bodies import DEFAULT_BODY
from visualhfsm_match._errors import MatchError
from zenoh_ice.data.toml_file import convert, parse_toml, read_text

RULES: Final = Path(__file__).with_name("rules.toml")
_FORMATS: Final = Path(__file__).with_name("formats")
DEFAULT_FORMAT: Final = "robocup"

Seconds = Annotated[float, Meta(ge=0.0, le=3600.0)]
Meters = Annotated[float, Meta(gt=0.0, le=50.0)]
Places = Annotated[tuple[tuple[float, float], ...], Meta(min_length=1, max_length=11)]


class Rules(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The figures of a match, in s, m and m/s; `rules.toml` says what each is for."""

    book: str
    ready: Seconds
    set: Seconds
    whole_ball: bool
    ball_free: Seconds
    mercy: Annotated[int, Meta(ge=1)]
    beside: Annotated[float, Meta(ge=-50.0, le=50.0)]
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


class Format(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A way to play: what a file of `formats/` says, or one of somebody's own."""

    description: str
    world: str
    """The pitch with its ball: a world by its name, or its file."""
    body: str = DEFAULT_BODY
    players: Annotated[int, Meta(ge=1, le=4)]
    """Robots of each team."""
    minutes: Annotated[float, Meta(ge=0.1, le=90.0)]
    rules: dict[str, Any] = {}
    """The figures that are other than those of `rules.toml`."""


def formats() -> tuple[str, ...]:
    """Return the names of the formats that come with this package."""
    return tuple(sorted(path.stem for path in _FORMATS.glob("*.toml")))


def load_format(name: str = DEFAULT_FORMAT, rules: Path | None = None) -> tuple[Format, Rules]:
    """Return a format by its name or its file, and its rules: those of a TOML file, if there is one.

    Raises MatchError.
    """
    path = _FORMATS / f"{name}.toml" if name in formats() else Path(name)
    if not path.is_file():
        raise MatchError.because(
            "there is no format {name}: there is {known}; or give the file of one",
            name=name,
            known=", ".join(formats()),
        )
    text = read_text(path, MatchError.of)
    found = parse_toml(text, Format, str(path), MatchError.of)
    if rules is not None:
        return found, load_rules(rules)
    usual = parse_toml(read_text(RULES, MatchError.of), dict[str, Any], str(RULES), MatchError.of)
    judged = convert({**usual, **found.rules}, Rules, str(path), MatchError.of, path=("rules",), text=text)
    return found, judged


def load_rules(path: Path = RULES) -> Rules:
    """Return the rules of a TOML file. Raises MatchError."""
    return parse_toml(read_text(path, MatchError.of), Rules, str(path), MatchError.of)
