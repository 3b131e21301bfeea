"""The commands `visualhfsm match` and `visualhfsm tournament`."""

from __future__ import annotations

import os
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from naoserver.bodies import DEFAULT_BODY
from visualhfsm.plugins import examples
from visualhfsm_match._rules import RULES, Rules, load_rules

if TYPE_CHECKING:
    from rich.console import Console

    from visualhfsm_match._match import Plan, Result
    from visualhfsm_match._series import Fixture

_PATIENCE: Final = 10.0
"""s by the wall that a match may take for each of its seconds, and `_BEGIN` more."""
_BEGIN: Final = 120.0

match: Final = typer.Typer(add_completion=False)
tournament: Final = typer.Typer(add_completion=False)

_Players = Annotated[int, typer.Option(metavar="N", min=1, max=4, help="Robots of each team.")]
_Minutes = Annotated[float, typer.Option(metavar="N", min=0.1, max=90.0, help="How long a match lasts.")]
_Seed = Annotated[int, typer.Option(metavar="N", min=0, help="Seed of all that is drawn.")]
_Body = Annotated[str, typer.Option(metavar="NAME", help="The robots, such as T1.")]
_Noise = Annotated[bool, typer.Option("--noise", help="Senses, pictures and gears as of real robots.")]
_Rules = Annotated[
    Path,
    typer.Option(
        metavar="TOML",
        exists=True,
        dir_okay=False,
        help="Other figures of the rules.",
        show_default="its own",
    ),
]


@match.command(
    "match",
    epilog=examples(
        "match red.xml blue.xml",
        "match red.xml blue.xml --players 2 --minutes 4 --seed 3",
        "match red.xml blue.xml --watch",
        notes="Exit codes: 0 played, 1 an error, 2 wrong usage, 130 Ctrl-C.",
    ),
)
def play(
    first: Annotated[Path, typer.Argument(metavar="RED", exists=True, dir_okay=False, help="A document.")],
    second: Annotated[Path, typer.Argument(metavar="BLUE", exists=True, dir_okay=False, help="Another one.")],
    *,
    players: _Players = 2,
    minutes: _Minutes = 4.0,
    seed: _Seed = 1,
    body: _Body = DEFAULT_BODY,
    noise: _Noise = False,
    rules: _Rules = RULES,
    report: Annotated[
        Path, typer.Option(metavar="HTML", dir_okay=False, help="The page of the match, in 3D.")
    ] = Path("match.html"),
    watch: Annotated[
        bool, typer.Option("--watch", help="Show the match in a browser here as it is played.")
    ] = False,
) -> None:
    """Let two documents play football against each other in virtual time, judged by a referee.

    The same documents and seed give the same match. A document that raises an error, hangs or cannot be run
    loses. Code of the documents runs as you: let only documents play that you trust.
    """
    from rich.console import Console

    from visualhfsm.plugins import check_place
    from visualhfsm_match._page import outcome_of
    from visualhfsm_match._series import Fixture, play_match

    check_place(report)
    plan = _plan(
        (first, second),
        players=players,
        minutes=minutes,
        seed=seed,
        body=body,
        rules=load_rules(rules),
        noise=noise,
    )
    console = Console()
    fixture = Fixture(plan, report.resolve())
    result = _watched(fixture, _limit(minutes), console) if watch else play_match(fixture, _limit(minutes))
    for event in result.events:
        minute, second_ = divmod(event.time, 60.0)
        console.print(f"{minute:3.0f}:{second_:04.1f}  {event.text}", markup=False, soft_wrap=True)
    console.print(f"\n{outcome_of(result)}", markup=False, soft_wrap=True)
    if report.is_file():
        console.print(f"{report} shows it in 3D", markup=False, soft_wrap=True)


@tournament.command(
    "tournament",
    epilog=examples(
        "tournament documents --out tournament",
        "tournament documents --matches 4 --workers 2",
        notes="Exit codes: 0 played, 1 an error, 2 wrong usage, 130 Ctrl-C.",
    ),
)
def play_tournament(
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", exists=True, file_okay=False, help="Documents.")
    ],
    *,
    players: _Players = 2,
    minutes: _Minutes = 4.0,
    matches: Annotated[
        int, typer.Option(metavar="N", min=1, max=100, help="Matches of each two, sides change.")
    ] = 2,
    seed: _Seed = 1,
    body: _Body = DEFAULT_BODY,
    noise: _Noise = False,
    rules: _Rules = RULES,
    workers: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, max=1000, help="Matches at a time.", show_default="one a processor"),
    ] = None,
    out: Annotated[
        Path, typer.Option(metavar="DIR", file_okay=False, help="Where table and matches are written.")
    ] = Path("tournament"),
) -> None:
    """Let everybody's document play against everybody's: a table, and the page of each match.

    Each match has a separate process: a document that raises an error, hangs or ends its process loses its
    matches, and changes no other. Code of the documents runs as you: let only documents play that you trust.
    """
    from rich.console import Console
    from rich.table import Table

    from visualhfsm_match._errors import MatchError
    from visualhfsm_match._page import outcome_of
    from visualhfsm_match._series import Fixture, play_all, team_names
    from visualhfsm_match._table import HEAD, table_of, write_table

    documents = sorted(folder.glob("*.xml"))
    if len(documents) < 2:
        raise MatchError.because("{folder}: a tournament needs two documents", folder=str(folder))
    out.mkdir(parents=True, exist_ok=True)
    fixtures, judged = [], load_rules(rules)
    for number, pair in enumerate(combinations(documents, 2)):
        for again in range(matches):
            sides = pair if again % 2 == 0 else pair[::-1]
            plan = _plan(
                sides,
                players=players,
                minutes=minutes,
                seed=seed + again,
                body=body,
                rules=judged,
                noise=noise,
                among=documents,
            )
            fixtures.append(Fixture(plan, (out / f"match{number * matches + again + 1}.html").resolve()))
    console = Console()
    played = {}
    for fixture, result in play_all(fixtures, workers or len(os.sched_getaffinity(0)), _limit(minutes)):
        played[fixture.page] = result
        console.print(outcome_of(result), markup=False, soft_wrap=True)
    results = {fixture.page.name: played[fixture.page] for fixture in fixtures if fixture.page is not None}
    rows = table_of(team_names(documents), [*results.values()])
    write_table(out, rows, results)
    table = Table(*HEAD)
    for row in rows:
        table.add_row(*row.cells)
    console.print(table)
    console.print(f"{out / 'index.html'} has all matches", markup=False, soft_wrap=True)


def _plan(
    documents: tuple[Path, ...],
    *,
    players: int,
    minutes: float,
    seed: int,
    body: str,
    rules: Rules,
    noise: bool,
    among: list[Path] | None = None,
) -> Plan:
    from visualhfsm_match._match import Plan
    from visualhfsm_match._series import team_names

    among = among or [*documents]
    names = team_names(among)
    first, second = documents
    index = among.index(first)
    other = among.index(second, index + 1) if first == second else among.index(second)
    return Plan(
        documents=(str(first.resolve()), str(second.resolve())),
        teams=(names[index], names[other]),
        players=players,
        seconds=60.0 * minutes,
        seed=seed,
        rules=rules,
        body=body,
        noise=noise,
    )


def _watched(fixture: Fixture, limit: float, console: Console) -> Result:
    """Play a match that can be watched meanwhile at an address that is printed."""
    from tempfile import TemporaryDirectory

    from visualhfsm_match._page import outcome_of, watched_page
    from visualhfsm_match._series import play_match
    from visualhfsm_match._watch import Watched

    with TemporaryDirectory(prefix="visualhfsm-watch-") as folder:
        film = Path(folder, "film")
        film.touch(mode=0o600)
        watched = Watched(watched_page(fixture.plan), film)
        with watched.served():
            console.print(f"watch it at {watched.address}", markup=False, soft_wrap=True)
            result = play_match(fixture._replace(film=film), limit)
            watched.end({"outcome": outcome_of(result), "events": result.events})
    return result


def _limit(minutes: float) -> float:
    return _BEGIN + _PATIENCE * 60.0 * minutes
