"""The commands `visualhfsm match` and `visualhfsm tournament`."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from visualhfsm.plugins import examples
from visualhfsm.simulation import EyesKind
from visualhfsm_match._rules import DEFAULT_FORMAT, load_format
from zenoh_ice.application.cli import unwind_on_signals

if TYPE_CHECKING:
    from rich.console import Console

    from visualhfsm_match._match import Plan, Result
    from visualhfsm_match._series import Match, Matches, Played

_PATIENCE: Final = 10.0
"""s by the wall that a match may take for each of its seconds, and `_BEGIN` more."""
_BEGIN: Final = 120.0

match: Final = typer.Typer(add_completion=False)
tournament: Final = typer.Typer(add_completion=False)

_OF_FORMAT: Final = "that of the format"
_Format = Annotated[
    str, typer.Option("--format", metavar="NAME", help="What is played: robocup, league, or a TOML file.")
]
_Players = Annotated[
    int | None,
    typer.Option(metavar="N", min=1, max=4, help="Robots of each team.", show_default=_OF_FORMAT),
]
_Minutes = Annotated[
    float | None,
    typer.Option(metavar="N", min=0.1, max=90.0, help="How long a match lasts.", show_default=_OF_FORMAT),
]
_Seed = Annotated[int, typer.Option(metavar="N", min=0, help="Seed of all that is drawn.")]
_Body = Annotated[
    str | None, typer.Option(metavar="NAME", help="The robots, such as T1.", show_default=_OF_FORMAT)
]
_Eyes = Annotated[
    EyesKind, typer.Option(help="What robots see: what the simulation knows, or pictures, by OpenCV.")
]
_Noise = Annotated[bool, typer.Option("--noise", help="Senses, pictures and gears as of real robots.")]
_Rules = Annotated[
    Path | None,
    typer.Option(
        metavar="TOML",
        exists=True,
        dir_okay=False,
        help="Other figures of the rules.",
        show_default=_OF_FORMAT,
    ),
]


_Unsafe = Annotated[
    bool, typer.Option("--unsafe", help="Run code of documents as you, where nothing can contain it.")
]


@match.command(
    "match",
    epilog=examples(
        "match red.xml blue.xml",
        "match red.xml blue.xml --players 2 --minutes 4 --seed 3",
        "match red.xml blue.xml --format league",
        "match red.xml blue.xml --watch",
        notes="Exit codes: 0 played, 1 an error, 2 wrong usage, 130 Ctrl-C.",
    ),
)
def play(
    first: Annotated[Path, typer.Argument(metavar="RED", exists=True, dir_okay=False, help="A document.")],
    second: Annotated[Path, typer.Argument(metavar="BLUE", exists=True, dir_okay=False, help="Another one.")],
    *,
    format: _Format = DEFAULT_FORMAT,
    players: _Players = None,
    minutes: _Minutes = None,
    seed: _Seed = 1,
    body: _Body = None,
    noise: _Noise = False,
    eyes: _Eyes = "truth",
    rules: _Rules = None,
    unsafe: _Unsafe = False,
    report: Annotated[
        Path, typer.Option(metavar="HTML", dir_okay=False, help="The page of the match, in 3D.")
    ] = Path("match.html"),
    watch: Annotated[
        bool, typer.Option("--watch", help="Show the match in a browser here as it is played.")
    ] = False,
) -> None:
    """Let two documents play football against each other in virtual time, judged by a referee.

    The same documents and seed give the same match. Their code runs in processes that reach neither files
    nor network. A document that raises an error, hangs or cannot be run loses.
    """
    _require_physics()
    from rich.console import Console

    from visualhfsm.plugins import check_place, write_html
    from visualhfsm_match._page import outcome_of
    from visualhfsm_match._series import Match, Matches, pack, team_names

    check_place(report)
    plan = _plan(format, rules, players, minutes, body, seed=seed, noise=noise, eyes=eyes)
    _require_sandbox(unsafe=unsafe)
    archive, documents = pack([first.resolve(), second.resolve()])
    plan = _between(plan, documents, team_names([first, second]))
    console = Console()
    one = Match(plan, 1, archive, page=True, unsafe=unsafe)
    with unwind_on_signals(), closing(Matches()) as matches:
        played = _watched(matches, one, console) if watch else matches.run(one).require()
    for event in played.result.events:
        console.print(f"{event.clock}  {event.text}", markup=False, soft_wrap=True)
    console.print(f"\n{outcome_of(played.result)}", markup=False, soft_wrap=True)
    _print_tallies(played, console)
    write_html(report, played.page)
    console.print(f"{report} shows it in 3D", markup=False, soft_wrap=True)


@tournament.command(
    "tournament",
    epilog=examples(
        "tournament documents --out tournament",
        "tournament documents --matches 4 --workers 2",
        "tournament documents --cluster tcp://lab:8786",
        notes="Exit codes: 0 played, 1 an error, 2 wrong usage, 130 Ctrl-C.",
    ),
)
def play_tournament(
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", exists=True, file_okay=False, help="Documents.")
    ],
    *,
    format: _Format = DEFAULT_FORMAT,
    players: _Players = None,
    minutes: _Minutes = None,
    matches: Annotated[
        int, typer.Option(metavar="N", min=1, max=100, help="Matches of each two, sides change.")
    ] = 2,
    seed: _Seed = 1,
    body: _Body = None,
    noise: _Noise = False,
    eyes: _Eyes = "truth",
    rules: _Rules = None,
    workers: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, max=1000, help="Matches at a time.", show_default="one a processor"),
    ] = None,
    cluster: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Play on a cluster of Dask, such as tcp://lab:8786.")
    ] = None,
    unsafe: _Unsafe = False,
    out: Annotated[
        Path, typer.Option(metavar="DIR", file_okay=False, help="Where table and matches are written.")
    ] = Path("tournament"),
    again: Annotated[
        bool, typer.Option("--again", help="Replace the tournament that is in DIR, with what you changed.")
    ] = False,
) -> None:
    """Let everybody's document play against everybody's: a table, and the page of each match.

    Their code runs in processes that reach neither files nor network. A document that raises an error, hangs
    or ends its process loses its matches, and changes no other.
    """
    _require_physics()
    from rich.console import Console
    from rich.table import Table

    from visualhfsm.plugins import write_html
    from visualhfsm.trials import ProcessPool, find_runner, run_tasks
    from visualhfsm_match._errors import MatchError
    from visualhfsm_match._page import outcome_of
    from visualhfsm_match._series import Match, Matches, pack, team_names
    from visualhfsm_match._table import HEAD, table_of, write_table

    found = sorted(folder.glob("*.xml"))
    if len(found) < 2:
        raise MatchError.because("{folder}: a tournament needs two documents", folder=str(folder))
    if not again and (there := [*out.glob("*.html"), *out.glob("*.csv")]):
        raise MatchError.because(
            "{file} is there: --again replaces it and what is beside it, --out DIR keeps it",
            file=str(min(there)),
        )
    plan = _plan(format, rules, players, minutes, body, seed=seed, noise=noise, eyes=eyes)
    if cluster is None:
        _require_sandbox(unsafe=unsafe)
    archive, documents = pack(found)
    teams = team_names(found)
    out.mkdir(parents=True, exist_ok=True)
    fixtures: dict[int, Match] = {}
    for pair in combinations(range(len(found)), 2):
        for turn in range(matches):
            sides = pair if turn % 2 == 0 else pair[::-1]
            of = _between(plan, [documents[side] for side in sides], [teams[side] for side in sides], turn)
            number = len(fixtures) + 1
            fixtures[number] = Match(of, number, archive, page=True, unsafe=unsafe)
    console = Console()
    results: dict[int, Result] = {}
    failed: list[str] = []
    with unwind_on_signals(), find_runner(cluster) if cluster else ProcessPool(Matches(), workers) as pool:
        for number, answer in run_tasks(fixtures.items(), pool):
            if (played := answer.played) is None:  # the others go on
                where = " : ".join(fixtures[number].plan.teams)
                failed.append(f"error: {where}: the match cannot be judged: {answer.refused}")
                continue
            results[number] = played.result
            write_html(out / f"match{number}.html", played.page)
            console.print(outcome_of(played.result), markup=False, soft_wrap=True)
    in_order = [number for number in fixtures if number in results]
    rows = table_of(teams, [results[number] for number in in_order])
    write_table(out, rows, {f"match{number}.html": results[number] for number in in_order})
    table = Table(*HEAD)
    for row in rows:
        table.add_row(*row.cells)
    console.print(table)
    console.print(f"{out / 'index.html'} has all matches", markup=False, soft_wrap=True)
    for text in failed:
        console.print(text, style="red", markup=False, soft_wrap=True)
    if failed:
        raise typer.Exit(1)


def _print_tallies(played: Played, console: Console) -> None:
    """Print what the teams did, and what the match has cost."""
    from rich.table import Table

    from visualhfsm_match._tally import HEAD

    result, cost = played.result, played.cost
    table = Table("(a robot and minute)", *HEAD)
    for team, tally in zip(result.teams, result.tallies, strict=False):
        table.add_row(team, *tally.cells)
    console.print(table)
    code = ", ".join(f"{spent:g} s for {team}" for team, spent in zip(result.teams, cost.spent, strict=False))
    faster = result.seconds / max(cost.wall, 0.1)
    console.print(
        f"{result.seconds:.0f} s of match in {cost.wall:.0f} s, {faster:.1f} times as fast; "
        f"of these the code and its robots took {code}",
        markup=False,
        soft_wrap=True,
    )


def _require_physics() -> None:
    """Raise MissingPackageError where no robot can be simulated."""
    from visualhfsm.plugins import MissingPackageError

    try:
        import mujoco  # noqa: F401
    except ModuleNotFoundError as error:
        raise MissingPackageError("MuJoCo", "sim") from error


def _require_sandbox(*, unsafe: bool) -> None:
    """Raise VisualHfsmError if this computer cannot contain the code of documents."""
    from visualhfsm.trials import find_sandbox

    with find_sandbox(files=(), unsafe=unsafe):
        pass


def _plan(
    name: str,
    rules: Path | None,
    players: int | None,
    minutes: float | None,
    body: str | None,
    *,
    seed: int,
    noise: bool,
    eyes: EyesKind,
) -> Plan:
    """Return the plan of a match in a format whose documents are not known yet. Raises MatchError."""
    from naoserver.errors import RobotError
    from naoserver_sim.world import load_world
    from visualhfsm_match._errors import MatchError
    from visualhfsm_match._match import Plan

    played, judged = load_format(name, rules)
    players, minutes = players or played.players, minutes or played.minutes
    try:
        world = load_world(played.world)
    except RobotError as error:
        raise MatchError.of(str(error)) from error
    if judged.most_players < players:
        raise MatchError.because(
            "{rules}: there are {count} places for --players {players}: add some, or play with fewer",
            rules=str(rules or name),
            count=judged.most_players,
            players=players,
        )
    return Plan(
        players=players,
        seconds=60.0 * minutes,
        seed=seed,
        rules=judged,
        world=world,
        body=body or played.body,
        noise=noise,
        eyes=eyes,
        patience=_BEGIN + _PATIENCE * 60.0 * minutes,
    )


def _between(plan: Plan, documents: Sequence[str], teams: Sequence[str], again: int = 0) -> Plan:
    """Return the plan of two documents' match; the sides change each time, and the kick-off with them."""
    import msgspec

    first, second = documents
    ours, theirs = teams
    return msgspec.structs.replace(
        plan, documents=(first, second), teams=(ours, theirs), seed=plan.seed + again // 2
    )


def _watched(matches: Matches, match: Match, console: Console) -> Played:
    """Play a match that can be watched meanwhile at an address that is printed. Raises MatchError."""
    from dataclasses import replace
    from tempfile import TemporaryDirectory

    from visualhfsm_match._page import ending_of, watched_page
    from visualhfsm_match._watch import Watched

    with TemporaryDirectory(prefix="visualhfsm-watch-") as folder:
        film = Path(folder, "film")
        film.touch(mode=0o600)
        watched = Watched(watched_page(match.plan), film)
        with watched.served():
            console.print(f"watch it at {watched.address}", markup=False, soft_wrap=True)
            played = matches.run(replace(match, film=str(film))).require()
            watched.end({"outcome": ending_of(played.result), "events": played.result.events})
    return played
