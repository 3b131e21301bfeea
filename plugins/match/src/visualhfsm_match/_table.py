"""The table of a tournament: points, goals, and how sure the share of won matches is."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from visualhfsm.plugins import success_rate, write_csv, write_html
from visualhfsm_match._match import Result
from visualhfsm_match._page import outcome_of
from visualhfsm_match._tally import HEAD as COUNTED
from visualhfsm_match._tally import Tally

_WIN, _DRAW = 3, 1
_POLICY: Final = "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"
_STYLE: Final = """
body { font: 16px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 60rem; padding: 0 1rem; }
table { border-collapse: collapse; width: 100%; margin-bottom: 2rem; }
th, td { padding: 0.3rem 0.6rem; text-align: start; border-bottom: 1px solid #ccc; }
td.number { text-align: end; font-variant-numeric: tabular-nums; }
"""
HEAD: Final = ("team", "played", "won", "drawn", "lost", "goals", "points", "share won", *COUNTED[1:])


@dataclass(slots=True)
class Row:
    """How one document did."""

    team: str
    won: int = 0
    drawn: int = 0
    lost: int = 0
    scored: int = 0
    taken: int = 0
    tally: Tally = field(default_factory=Tally)
    """What its robots did."""
    reasons: list[str] = field(default_factory=list)
    """Why it lost matches, where that was not by the score."""

    @property
    def points(self) -> int:
        """Three for each match that was won, one for each that was drawn."""
        return _WIN * self.won + _DRAW * self.drawn

    @property
    def played(self) -> int:
        """The number of its matches."""
        return self.won + self.drawn + self.lost

    @property
    def cells(self) -> tuple[str, ...]:
        """What the table says of it."""
        share = str(success_rate(self.won, self.played))
        counts = (self.played, self.won, self.drawn, self.lost)
        goals = f"{self.scored} : {self.taken}"
        return (self.team, *map(str, counts), goals, str(self.points), share, *self.tally.cells[1:])


def table_of(teams: Sequence[str], results: Sequence[Result]) -> list[Row]:
    """Return the rows of a tournament, the best first; equal ones by their goals, then by name."""
    rows = {team: Row(team) for team in teams}
    for result in results:
        for team, own, other in zip(result.teams, result.score, reversed(result.score), strict=True):
            row = rows[team]
            row.scored += own
            row.taken += other
            row.won += result.winner == team
            row.drawn += not (result.winner or result.reason)
            row.lost += bool(result.winner or result.reason) and result.winner != team
            if result.tallies:
                row.tally.add(result.tallies[result.teams.index(team)])
            if result.reason and result.winner != team:
                row.reasons.append(result.reason)
    return sorted(rows.values(), key=lambda row: (-row.points, row.taken - row.scored, -row.scored, row.team))


def write_table(folder: Path, rows: Sequence[Row], matches: Mapping[str, Result]) -> None:
    """Write `index.html` and `table.csv`; `matches` by the names of their pages. Raises VisualHfsmError."""
    write_csv(folder / "table.csv", [HEAD, *(row.cells for row in rows)])
    table = "".join(f"<tr>{''.join(_cell(text) for text in row.cells)}</tr>\n" for row in rows)
    listed = "".join(
        f"<tr><td>{_link(folder, page, outcome_of(result))}</td></tr>\n" for page, result in matches.items()
    )
    heads = "".join(f"<th>{text}</th>" for text in HEAD)
    write_html(
        folder / "index.html",
        f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{_POLICY}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Tournament</title>
<style>{_STYLE}</style>
</head>
<body>
<h1>Tournament</h1>
<table><tr>{heads}</tr>
{table}</table>
<h2>Matches</h2>
<table>{listed}</table>
</body>
</html>
""",
    )


def _cell(text: str) -> str:
    kind = "" if text[:1].isalpha() else ' class="number"'
    return f"<td{kind}>{html.escape(text)}</td>"


def _link(folder: Path, page: str, text: str) -> str:
    if not (folder / page).is_file():
        return html.escape(text)
    return f'<a href="{html.escape(page)}">{html.escape(text)}</a>'
