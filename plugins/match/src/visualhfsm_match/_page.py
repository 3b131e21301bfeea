"""A match as one HTML file, with all robots in 3D, and a tournament as a table with its matches."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import msgspec

from visualhfsm.plugins import html_file
from visualhfsm_match._film import Film
from visualhfsm_match._match import SHIRTS, Plan, Result

_STATIC: Final = Path(__file__).with_name("static")
_STYLES: Final[tuple[str | Path, ...]] = (
    "styles/theme",
    "styles/shell",
    "styles/panels",
    _STATIC / "match-page.css",
)


def outcome_of(result: Result) -> str:
    """Return what a match came to in one sentence."""
    first, second = result.teams
    score = f"{first} {result.score[0]} : {result.score[1]} {second}"
    return f"{score}; {ending_of(result)}"


def ending_of(result: Result) -> str:
    """Return why a match has ended early, or who has won."""
    return result.reason.partition("\n")[0] or f"{result.winner or 'nobody'} wins"


def watched_page(plan: Plan) -> str:
    """Return the page of a match that is being played, which asks for its film where it comes from."""
    content = {**_head(plan), "live": True}
    data = msgspec.json.encode(content)
    return html_file(content["title"], _STATIC / "match-page.js", _STYLES, data, connects=True)


def _head(plan: Plan) -> dict[str, Any]:
    return {
        "title": " : ".join(plan.teams),
        "teams": plan.teams,
        "shirts": SHIRTS,
        "seed": plan.seed,
        "rules": f"{plan.rules.book}; what is ours in it: rules.toml. Seed {plan.seed}.",
        "outcome": "",
        "events": [],
        "frames": [],
    }


def match_page(plan: Plan, result: Result, film: Film) -> str:
    """Return the page of a match as HTML."""
    content: dict[str, Any] = {
        **_head(plan),
        "outcome": ending_of(result),
        "events": result.events,
        **film.content(),
    }
    data = msgspec.json.encode(content)
    return html_file(content["title"], _STATIC / "match-page.js", _STYLES, data)
