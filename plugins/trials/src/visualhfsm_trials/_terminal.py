"""The summary of trials as tables in a terminal."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from visualhfsm.plugins import percent

from ._comparison import Comparison
from ._statistics import SMALL, Mean, figure, rarest
from ._summary import Summary

_BAR: Final = 20
_SHORT_BAR: Final = 8
_MOST_COLUMNS: Final = 6
_COLUMN: Final = 10
"""Characters of a column with the means of a number, and what the other columns take is `_OTHERS`."""
_OTHERS: Final = 56
_MANY: Final = 10
"""Parts of which some differ by chance, whatever success depends on."""
_SAYS_LITTLE: Final = f"Fewer than {SMALL} trials say little."
_MOST_NAMED: Final = 8
_MOST_WAYS: Final = 8


def show(console: Console, summary: Summary, title: str) -> None:
    """Print a summary."""
    rate = summary.rate
    console.print()
    console.print(
        Text.assemble((title, "bold"), f"  {rate.successes} of {rate.trials} succeed: ", (str(rate), "bold"))
    )
    for warning in summary.warnings:
        console.print(warning, style="yellow", highlight=False)
    if 0 < rate.trials < SMALL:
        console.print(_SAYS_LITTLE, style="dim")
    if len(summary.looks) > 1:
        looks = ", then ".join(map(str, summary.looks))
        console.print(
            f"Trials were added after a look ({looks}): the interval is that of a single look.", style="dim"
        )
    for part in (_numbers(summary), _dependences(summary, console.width), _ways(summary), _worst(summary)):
        if part is not None:
            console.print()
            console.print(part)


def show_comparison(console: Console, comparison: Comparison, names: tuple[str, str]) -> None:
    """Print what differs between two series."""
    table = _table("", names[0], names[1], "difference")
    first, second = comparison.rates
    table.add_row("success", str(first), str(second), _of_difference(comparison.difference, percent, " %"))
    for name, change in comparison.numbers.items():
        shown = _of_difference(change.difference, figure)
        table.add_row(f"{name}, mean", figure(change.first), figure(change.second), shown)
    console.print()
    console.print(table)
    console.print(f"success: {comparison.verdict}", highlight=False)
    if comparison.looks > 1:
        console.print("Fresh trials, of another --seed, are looked at once.", style="dim")
    if comparison.numbers:
        few = f" {_SAYS_LITTLE}" if comparison.both < SMALL else ""
        unseen = f"What happens in fewer than {percent(rarest(comparison.both))} % may be missing."
        console.print(
            f"The means are of the {comparison.both} trials in which both succeed.{few} {unseen}", style="dim"
        )
    for label, numbers in ((names[0], comparison.only_first), (names[1], comparison.only_second)):
        if numbers:
            console.print(f"only {label} succeeds in {len(numbers)}: {_named(numbers)}")


def _of_difference(difference: Mean, shown: Callable[..., str], unit: str = "") -> str:
    mean = shown(difference.mean, sign=True) + unit
    if difference.interval is None:
        return f"{mean} {difference.why}"
    low, high = (shown(each, sign=True) for each in difference.interval)
    return f"{mean}  ({low} to {high}{unit}) {difference.why}".rstrip()


def _bar(part: float, length: int) -> Text:
    """Return a part, from 0 to 1, as a bar."""
    full = round(part * length)
    return Text.assemble(("█" * full, "green"), ("░" * (length - full), "red"))


def _table(*columns: str, title: str = "") -> Table:
    table = Table(
        box=None, title=title or None, title_justify="left", title_style="bold", padding=(0, 2, 0, 0)
    )
    for index, name in enumerate(columns):
        table.add_column(name, justify="left" if index == 0 else "right", header_style="dim")
    return table


def _numbers(summary: Summary) -> RenderableType | None:
    if not summary.numbers:
        return None
    of = "of those that succeed" if summary.rate.successes else "of all"
    table = _table("", "least", "25 %", "median", "75 %", "most", "mean", title=f"Numbers {of}")
    for name, each in summary.numbers.items():
        figures = (each.least, each.lower, each.median, each.upper, each.greatest, each.mean)
        table.add_row(name, *map(figure, figures))
    return table


def _dependences(summary: Summary, width: int) -> RenderableType | None:
    """Return success by the values of each quantity, beside the means of the plan's own numbers."""
    rate, most = summary.rate, max(0, min(_MOST_COLUMNS, (width - _OTHERS) // _COLUMN))
    shown = summary.own_numbers[:most]
    if not summary.dependences or (rate.successes in (0, rate.trials) and not shown):
        return None
    title = "What it depends on" + (", with the means of the numbers" if shown else "")
    table = _table("", "", "", "success", *shown, title=title)
    for name, parts in summary.dependences.items():
        for index, part in enumerate(parts):
            means = (figure(part.means[each]) if each in part.means else "" for each in shown)
            succeed = f"{part.rate.successes} of {part.rate.trials}"
            length = _SHORT_BAR if shown else _BAR
            table.add_row("" if index else name, part.label, _bar(part.rate.rate, length), succeed, *means)
    trials = [part.rate.trials for parts in summary.dependences.values() for part in parts]
    words = ["Means are of all trials of a part, failed ones, too."] if shown else []
    if min(trials) < SMALL:
        words.append(f"Parts with fewer than {SMALL} trials may differ by chance.")
    if len(trials) >= _MANY:
        words.append(f"Of {len(trials)} parts, some differ by chance alone.")
    return Group(table, Text("\n".join(words), style="dim")) if words else table


def _ways(summary: Summary) -> RenderableType | None:
    if not summary.ways:
        return None
    table = Table(
        box=None, title="How it fails", title_justify="left", title_style="bold", padding=(0, 2, 0, 0)
    )
    for name in ("trials", "why", "in", "numbers"):
        table.add_column(name, header_style="dim", overflow="fold")
    for way in summary.ways[:_MOST_WAYS]:
        table.add_row(str(len(way.numbers)), way.reason, way.states, _named(way.numbers))
    left = len(summary.ways) - _MOST_WAYS
    return table if left <= 0 else Group(table, Text(f"and {left} other ways", style="dim"))


def _worst(summary: Summary) -> RenderableType | None:
    if summary.are_equal:
        return None
    numbers = [row.number for row in summary.worst]
    return Text.assemble(
        "The worst: ", (_named(numbers), "bold"), ("  one again: --only NUMBER --record FILE", "dim")
    )


def _named(numbers: Sequence[int]) -> str:
    shown = ", ".join(map(str, numbers[:_MOST_NAMED]))
    return f"{shown}, ..." if len(numbers) > _MOST_NAMED else shown
