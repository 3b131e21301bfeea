"""Marks in the terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final

from rich.console import Console
from rich.table import Table
from rich.text import Text

from visualhfsm_classes._words import figure, say

if TYPE_CHECKING:
    from visualhfsm_classes._exercise import Exercise
    from visualhfsm_classes._marks import Marks

_BAR: Final = 12


def show(console: Console, exercise: Exercise, language: str, marks: Sequence[Marks]) -> None:
    """Print the marks of a class, each with the reasons for lost points."""
    table = _table(f"{exercise.title[language]}", "", "", "", say(language, "happened"))
    for each in marks:
        full = round(each.points / each.of * _BAR)
        bar = Text.assemble(("█" * full, "green"), ("░" * (_BAR - full), "red"))
        table.add_row(Text(each.name), Text(figure(language, each.points), "bold"), bar, Text(each.summary))
    console.print(table)
    if not any(each.points for each in marks):
        console.print(
            "\nNobody has points. Does the exercise work? visualhfsm grade EXERCISE --check", style="red"
        )
    broken = [each.name for each in marks for earned in each.earned if earned.failed]
    if broken:
        console.print(
            f"\nA judge of the exercise failed for {', '.join(dict.fromkeys(broken))}: see their reasons",
            style="red",
            markup=False,
        )


def show_check(
    console: Console, exercise: Exercise, marks: Sequence[Marks], expected: Mapping[str, float]
) -> bool:
    """Print what the solution and the mistakes earn; return whether each earns what is expected."""
    table = _table(exercise.name, "", "earns", "expected", "")
    good = True
    for each in marks:
        right = each.points == expected[each.name]
        good = good and right
        earned = Text(f"{each.points:g}", "" if right else "bold red")
        table.add_row(Text(each.name), earned, f"{expected[each.name]:g}", Text(each.summary))
    console.print(table)
    return good


def _table(title: str, *columns: str) -> Table:
    table = Table(box=None, title=title, title_justify="left", title_style="bold", padding=(0, 2, 0, 0))
    for index, name in enumerate(columns):
        inner = 0 < index < len(columns) - 1
        table.add_column(
            name, justify="right" if inner else "left", header_style="dim", overflow="fold", no_wrap=inner
        )
    return table
