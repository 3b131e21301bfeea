"""The command `visualhfsm trials`: run a behavior many times, and say how often it succeeds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

import typer

from visualhfsm.plugins import examples
from zenoh_ice.application.cli import finite

from ._options import Again, Cluster, Out, Seed, Workers

if TYPE_CHECKING:
    from visualhfsm.trials import Plan

    from ._progress import Where
    from ._summary import Summary

_TUNING: Final = ".tuning.jsonl"

_EPILOG: Final = examples(
    "trials behaviors/follow_ball.xml",
    "trials behaviors/score.trials.toml --runs 1000",
    "trials behaviors/score.trials.toml --only 417 --record run417.mcap",
    "trials mine.xml theirs.xml --runs 300",
    'trials follow_ball.xml --tune --minimize "aim mean" --runs 40',
    "trials score.trials.toml --cluster tcp://192.168.0.4:8786",
    notes="Exit codes: 0 done, 1 an error, 2 wrong usage, 130 Ctrl-C.",
)


app: Final = typer.Typer(add_completion=False)


@app.command(epilog=_EPILOG)
def trials(
    documents: Annotated[
        list[Path],
        typer.Argument(
            metavar="DOCUMENT",
            exists=True,
            dir_okay=False,
            help="A document, with the plan NAME.trials.toml beside it if there is one, or a plan; two "
            "of them are compared, both by the plan of the first one.",
        ),
    ],
    *,
    runs: Annotated[
        int | None, typer.Option(metavar="N", min=1, max=1_000_000, help="Number of trials.")
    ] = None,
    seed: Seed = None,
    success: Annotated[
        str | None, typer.Option(metavar="STATE", help="The state that a trial must reach.")
    ] = None,
    limit: Annotated[
        float | None,
        typer.Option(metavar="SECONDS", min=0.001, callback=finite, help="End of a trial, in robot time."),
    ] = None,
    robot: Annotated[
        Literal["sim", "fake", "none"] | None,
        typer.Option(help="The simulated robot, the fake one without physics, or none."),
    ] = None,
    workers: Workers = None,
    cluster: Cluster = None,
    only: Annotated[
        int | None,
        typer.Option(metavar="NUMBER", min=1, help="Run one trial here, the first is 1, and show it."),
    ] = None,
    record: Annotated[
        Path | None, typer.Option(metavar="MCAP", dir_okay=False, help="Record that one for the editor.")
    ] = None,
    out: Out = None,
    report: Annotated[
        Path | None,
        typer.Option(
            metavar="HTML",
            dir_okay=False,
            help="Write everything as a page, with those of the ten worst trials in a folder beside it.",
        ),
    ] = None,
    tune: Annotated[
        bool, typer.Option("--tune", help="Search the parameters that have a range for those that do best.")
    ] = False,
    settings: Annotated[
        int, typer.Option(metavar="N", min=1, max=100_000, help="Settings that --tune tries.")
    ] = 40,
    minimize: Annotated[
        str,
        typer.Option(metavar="NUMBER", help="What a successful trial costs for --tune, such as 'aim mean'."),
    ] = "time",
    again: Again = False,
) -> None:
    """Run a behavior many times in virtual time, with other places, noise and disturbances each time.

    A plan says what varies and what counts as success. The same plan and seed give the same outcomes,
    wherever they are computed. Outcomes are kept as they come: after Ctrl-C the same command goes on. Code of
    the document runs as you: try only documents that you trust.
    """
    _check_options(documents, only=only, record=record, report=report, tune=tune)
    plans = _plans_of(documents, success, {"runs": runs, "seed": seed, "limit": limit, "robot": robot})
    if only is not None:
        for plan in plans:
            _run_one(plan, only, record)
        return
    from rich.console import Console

    from ._progress import Where

    where = Where(Console(), workers, cluster, again)
    if tune:
        _tune(where, plans[0], settings, minimize, out)
    else:
        _run_series(where, plans, out, report)


def _check_options(
    documents: Sequence[Path], *, only: int | None, record: Path | None, report: Path | None, tune: bool
) -> None:
    """Raise BadParameter for options that exclude one another.

    Raises VisualHfsmError for a page that cannot be written.
    """
    if len(documents) > 2:
        raise typer.BadParameter("at most two documents are compared", param_hint="DOCUMENT")
    if record is not None and only is None:
        raise typer.BadParameter("--record needs --only NUMBER")
    if report is not None and (len(documents) > 1 or tune):
        raise typer.BadParameter("a page is of one document", param_hint="--report")
    if tune and (len(documents) > 1 or only is not None):
        raise typer.BadParameter("one document is tuned, without --only", param_hint="--tune")
    if report is not None:
        from visualhfsm.plugins import check_place

        check_place(report)


def _plans_of(documents: Sequence[Path], success: str | None, options: Mapping[str, Any]) -> list[Plan]:
    """Return the plan of each document, with the options that are given. Raises TrialsError."""
    from msgspec.structs import replace

    from visualhfsm.trials import plan_of

    given = {name: value for name, value in options.items() if value is not None}
    plans = [plan_of(documents[0], success, **given)]
    for path in documents[1:]:  # the plan of the first one, so that all values are the same
        own = plan_of(path, success, **given)
        plans.append(own if path.suffix == ".toml" else replace(plans[0], document=own.document))
    return plans


def _run_series(where: Where, plans: Sequence[Plan], out: Path | None, report: Path | None) -> None:
    """Run the trials of a plan, or of two that are compared, and print what they came to."""
    from ._comparison import Comparison
    from ._facts import facts_of
    from ._progress import run_all
    from ._record import SUFFIX
    from ._statistics import require_scipy
    from ._terminal import show, show_comparison

    if len(plans) > 1:
        require_scipy()  # now, not after the trials
    console, places = where.console, _places(plans, out)
    summaries = []
    for plan, place in zip(plans, places, strict=True):
        file = place.with_name(place.name + SUFFIX)
        summaries.append(run_all(where, plan, file))
        if report is not None:
            write_page(where, report, plan, summaries[-1], file)
    for summary, place in zip(summaries, places, strict=True):
        show(console, summary, place.name)
    if plans[0].success.state is None and plans[0].success.function is None:
        counts = "".join(f", {each}" for each in facts_of(plans[0], "").counts)
        words = f"no error ends it within {plans[0].limit:g} s{counts}"
        console.print(f"Success: {words}; --success STATE asks for more.", style="dim", highlight=False)
    if len(summaries) == 2:
        comparison = Comparison(*summaries, limit=max(plan.limit for plan in plans))
        show_comparison(console, comparison, (places[0].name, places[1].name))


def _tune(where: Where, plan: Plan, settings: int, cost: str, out: Path | None) -> None:
    """Search the best parameters of a plan, and print what they change in fresh trials."""
    from ._comparison import Comparison
    from ._progress import run_all, search
    from ._record import SUFFIX
    from ._statistics import require_scipy
    from ._terminal import show, show_comparison
    from ._tuning import Tuning

    require_scipy()  # now, not after the trials
    (path,) = _places([plan], out)
    tuning = Tuning(plan, settings=settings, cost=cost)
    found = search(where, tuning, path.name, path.with_name(path.name + _TUNING))
    plans = {"untuned": tuning.fresh, "tuned": tuning.with_parameters(found, tuning.fresh)}
    before, after = (
        run_all(where, each, path.with_name(f"{path.name}.{name}{SUFFIX}")) for name, each in plans.items()
    )
    show(where.console, after, "tuned")
    show_comparison(where.console, Comparison(before, after, limit=plan.limit), ("untuned", "tuned"))
    where.console.print()
    for name, value in found.items():
        where.console.print(f"{name} = {value!r}", highlight=False)
        if border := tuning.border(name, value):
            where.console.print(f"  {border}", style="yellow", highlight=False)


def _places(plans: Sequence[Plan], out: Path | None) -> list[Path]:
    """Return where the outcomes of each plan are kept, without an ending; numbered where two are alike."""
    stems = [Path(plan.document).stem for plan in plans]
    if len(set(stems)) < len(stems):
        stems = [f"{stem}-{index}" for index, stem in enumerate(stems, 1)]
    return [(out or Path(plan.document).parent) / stem for plan, stem in zip(plans, stems, strict=True)]


def write_page(where: Where, path: Path, plan: Plan, summary: Summary, file: Path) -> None:
    """Write the page of a series; its worst trials are run again, and recorded."""
    from ._page import write_trials_page
    from ._series import KeptSeries

    record = partial(KeptSeries(plan).record, workers=where.workers)
    with where.console.status("runs the worst trials again, to record them"):
        size = write_trials_page(path, plan, summary, file, record)
    where.console.print(f"{path}: {size / 1e6:.1f} MB")


def _run_one(plan: Plan, number: int, record: Path | None) -> None:
    """Run one trial, and print what it came to."""
    from ._series import KeptSeries

    outcome = KeptSeries(plan).show(number, record)
    for name, value in outcome.values.items():
        typer.echo(f"{name} = {value!r}")
    for change in outcome.changes:
        typer.echo(f"{change.time:10.3f} s  {change.states}")
    for name, figure in outcome.numbers.items():
        typer.echo(f"{name}: {figure:.6g}")
    if outcome.error:
        typer.echo(outcome.error)
    typer.echo(
        f"trial {number} of {Path(plan.document).name}: {outcome.reason or 'success'} at {outcome.time:g} s"
    )
    if record is not None and record.is_file():
        typer.echo(f"Recorded in {record}: open it in the editor, or `visualhfsm report {record}`.")
