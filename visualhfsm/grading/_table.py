"""The marks of a class as a table for a spreadsheet."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from zenoh_ice.text import printable

from ._errors import GradingError

if TYPE_CHECKING:
    from ._exercise import Exercise
    from ._marks import Marks

_FORMULA = ("=", "+", "-", "@")
"""What a cell begins with that a spreadsheet would calculate."""


def write_table(path: Path, exercise: Exercise, language: str, marks: Sequence[Marks]) -> None:
    """Write a row for each submission as CSV: all points, those of each criterion, and why.

    Raises GradingError.
    """
    language = exercise.language(language)
    asks = [each.asks[language] for each in exercise.criteria]
    try:
        with path.open("w", encoding="utf-8-sig", newline="") as file:  # so that Excel reads it as UTF-8
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(["name", "points", "of", *map(_cell, asks), "reasons"])
            for each in marks:
                points = [f"{earned.points:g}" for earned in each.earned]
                writer.writerow(
                    [_cell(each.name), f"{each.points:g}", f"{each.of:g}", *points, _cell(each.summary)]
                )
    except OSError as error:
        raise GradingError(f"{path}: the table cannot be written: {error.strerror}") from error


def _cell(text: str) -> str:
    """Return a text that no spreadsheet takes for a formula."""
    shown = printable(text)
    return f"'{shown}" if shown.lstrip().startswith(_FORMULA) else shown
