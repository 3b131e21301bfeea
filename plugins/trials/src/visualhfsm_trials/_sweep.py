"""The command `visualhfsm sweep`: a behavior under each failure of its robot, and what becomes of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from visualhfsm.plugins import examples
from zenoh_ice.application.cli import finite

from ._options import Again, Cluster, Out, Seed, Workers

if TYPE_CHECKING:
    from rich.console import Console

    from visualhfsm.trials import Outcome

_EPILOG: Final = examples(
    "sweep behaviors/follow_ball.xml",
    "sweep behaviors/score.xml --limit 40 --report score.html",
    "sweep dance.xml --part InertialUnit --part Camera --moments 5",
    notes="Exit codes: 0 done, 1 an error, 2 wrong usage, 130 Ctrl-C.",
)
_FATES: Final = {
    "succeeded": ("·", "went on, and succeeded"),
    "stopped": ("s", "stopped"),
    "failed": ("x", "went on, and did not get there"),
    "fell": ("F", "fell"),
    "hung": ("H", "hung"),
}
"""The letter of each fate in the matrix, and what it means."""

app: Final = typer.Typer(add_completion=False)


@app.command(epilog=_EPILOG)
def sweep(
    document: Annotated[
        Path,
        typer.Argument(
            metavar="DOCUMENT",
            exists=True,
            dir_okay=False,
            help="A document, with the plan NAME.trials.toml beside it if there is one, or a plan.",
        ),
    ],
    *,
    part: Annotated[
        list[str] | None,
        typer.Option(metavar="PART", help="Only this part fails; may be repeated.", show_default="all"),
    ] = None,
    both_sides: Annotated[
        bool, typer.Option("--both-sides", help="Let parts of the right side fail, too, not the left alone.")
    ] = False,
    moments: Annotated[
        int, typer.Option(metavar="N", min=1, max=1000, help="Trials of each failure, at drawn moments.")
    ] = 1,
    limit: Annotated[
        float | None,
        typer.Option(metavar="SECONDS", min=1.0, callback=finite, help="End of a trial, in robot time."),
    ] = None,
    seed: Seed = None,
    workers: Workers = None,
    cluster: Cluster = None,
    out: Out = None,
    report: Annotated[
        Path | None,
        typer.Option(metavar="HTML", dir_okay=False, help="Write everything as a page."),
    ] = None,
    again: Again = False,
) -> None:
    """Run a behavior under each failure of its robot, and say what becomes of it.

    Each joint, sense and camera, the server and its link fail in each way, in virtual time, at a moment that
    is drawn: does the behavior go on and succeed, notice and stop, go on and fail, fall, or hang? Code of the
    document runs as you: try only documents that you trust.
    """
    from msgspec.structs import replace
    from rich.console import Console

    from naoserver.bodies import DEFAULT_BODY
    from naoserver.bodies.faults import failures_of, kinds_of
    from naoserver_sim.named_body import named_body
    from visualhfsm.trials import Spread, TrialsError, plan_of

    from ._command import write_page
    from ._progress import Where, run_all
    from ._record import SUFFIX, read_outcomes

    given = {"limit": limit, "seed": seed}
    plan = plan_of(document, None, **{name: value for name, value in given.items() if value is not None})
    body = plan.scene.get("body", DEFAULT_BODY)
    if not isinstance(body, str) or plan.robot == "none":
        raise TrialsError.because("a sweep is of one robot: write its body in the plan, or none")
    kinds = kinds_of(named_body(body), physics=plan.robot == "sim")
    if unknown := [name for name in part or () if not kinds.get(name)]:
        raise TrialsError.because(
            "there is no part {part} that can fail; there are {parts}",
            part=unknown[0],
            parts=", ".join(kinds),
        )
    failures = tuple(failures_of(kinds, part or (), both_sides=both_sides))
    moment = Spread(lowest=min(1.0, plan.limit / 4), highest=plan.limit / 2)
    plan = replace(plan, failures=failures, fails_at=moment, runs=moments * len(failures))
    where = Where(Console(), workers, cluster, again)
    name = f"{Path(plan.document).stem}.sweep"
    file = (out or Path(plan.document).parent) / f"{name}{SUFFIX}"
    summary = run_all(where, plan, file)
    if report is not None:
        write_page(where, report, plan, summary, file)
    _show(where.console, [*read_outcomes(file)], plan.runs)


def _show(console: Console, outcomes: Sequence[Outcome], runs: int) -> None:
    """Print the matrix of parts and kinds, how often there is each fate, and the worst of going on."""
    from rich.table import Table
    from rich.text import Text

    cells: dict[tuple[str, str], list[str]] = {}
    walked = [(0.0, "")]
    for outcome in sorted(outcomes, key=lambda outcome: outcome.number):
        if outcome.number <= runs:
            what = str(outcome.values["failure"])
            part, _, kind = what.rpartition(" ")
            # Without a fate it took too long, or its process ended.
            fate = outcome.groups.get("fate", "hung")
            cells.setdefault((part, kind), []).append(fate)
            if fate != "succeeded":  # who gets there was right to walk on
                walked.append((outcome.numbers.get("walks on", 0.0), what))
    parts, kinds = (dict.fromkeys(names) for names in zip(*cells, strict=True))
    table = Table(box=None, padding=(0, 1, 0, 0))
    for column in ("", *kinds):
        table.add_column(column, header_style="dim", justify="center" if column else "left", no_wrap=True)
    for part in parts:
        found = (cells.get((part, kind), ()) for kind in kinds)
        table.add_row(part, *("".join(sorted(_FATES[fate][0] for fate in each)) for each in found))
    console.print()
    console.width = max(console.width, max(map(len, parts)) + sum(len(kind) + 1 for kind in kinds) + 1)
    console.print(table)
    console.print()
    fates = Counter(fate for each in cells.values() for fate in each)
    for fate, (letter, meaning) in _FATES.items():
        console.print(Text.assemble((f"{letter} ", "bold"), f"{meaning}: {fates[fate]}"))
    longest, what = max(walked)
    if longest > 0.0:
        console.print(f"walked on without a word: {longest:.1f} s at most, with {what}", highlight=False)
