"""Series and searches with a bar in the terminal, which go on where Ctrl-C or a crash ended them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from visualhfsm import VisualHfsmError
from visualhfsm.trials import Outcome, Plan, Value
from zenoh_ice.application.cli import stop_on_signals

from ._record import Record
from ._series import KeptSeries, open_pool
from ._summary import Summary, summarize, write_table
from ._tuning import Tuning


class Where(NamedTuple):
    """Where trials run, as the user said."""

    console: Console
    workers: int | None
    cluster: str | None
    again: bool
    """True to replace outcomes that are there."""


def run_all(where: Where, plan: Plan, file: Path) -> Summary:
    """Run the trials of a plan whose outcomes are not in a file yet, and return what all of them say.

    A table of them is written beside the file. Raises TrialsError, and SystemExit after Ctrl-C.
    """
    series, console = KeptSeries(plan), where.console
    with Record(file, series.header, again=where.again) as record:
        record.look(plan.runs)
        missing = sum(number not in record.done for number in plan.trials)
        if missing < plan.runs:
            console.print(f"{file}: goes on with the {plan.runs - missing} outcomes there")
        if missing:
            with (
                stop_on_signals() as stop,
                open_pool(where.workers, where.cluster) as pool,
                _bar(console, Path(plan.document).stem, plan.runs, plan.runs - missing) as advance,
            ):
                ended = successes = 0

                def show(outcome: Outcome) -> None:
                    nonlocal ended, successes
                    ended, successes = ended + 1, successes + outcome.success
                    advance(1, f"{successes} of {ended} succeed")

                series.run(record, pool, show, stop)
                if stop.is_set():
                    console.print(f"{len(record.done)} of {plan.runs} are done; the same command goes on")
    summary = summarize(file, plan.varying, plan.runs)
    try:
        known = None if where.again else summarize(file, plan.varying)
        write_table(file.with_suffix(".csv"), summary, known)
    except VisualHfsmError as error:  # the outcomes are there
        console.print(str(error), style="yellow", markup=False, soft_wrap=True)
    return summary


def search(where: Where, tuning: Tuning, name: str, file: Path) -> dict[str, Value]:
    """Return the best parameters; outcomes of the search are kept in a file.

    Raises TrialsError, and SystemExit after Ctrl-C.
    """
    with (
        stop_on_signals() as stop,
        open_pool(where.workers, where.cluster) as pool,
        _bar(where.console, name, tuning.most_trials) as advance,
    ):
        found = tuning.search(
            file,
            pool,
            lambda trials: advance(trials, f"{tuning.given_up} of {tuning.settings} settings given up"),
            stop,
            again=where.again,
        )
        if found is None:
            where.console.print("the same command goes on")
    return found or {}


@contextmanager
def _bar(console: Console, name: str, total: int, completed: int = 0) -> Iterator[Callable[[int, str], None]]:
    """Show a bar in a `with` block; yield what advances it, and sets the text beside it."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console) as progress:
        task = progress.add_task(name, total=total, completed=completed, rate="")
        yield lambda count, text: progress.update(task, advance=count, rate=text)
