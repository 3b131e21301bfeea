"""Outcomes as a table, for pandas and for spreadsheets."""

from __future__ import annotations

import csv
from pathlib import Path

from ._errors import TrialsError
from ._summary import Summary


def write_table(path: Path, summary: Summary) -> None:
    """Write a row for each trial as CSV: its quantities, what it came to, and its numbers.

    Raises TrialsError.
    """
    values = list(dict.fromkeys(name for row in summary.rows for name in row.values))
    numbers = list(dict.fromkeys(name for row in summary.rows for name in row.numbers))
    try:
        with path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(["number", "success", "reason", "states", *values, *numbers])
            for row in summary.rows:
                writer.writerow(
                    [
                        row.number,
                        "true" if row.success else "false",
                        row.reason,
                        row.states,
                        *(row.values.get(name, "") for name in values),
                        *(row.numbers.get(name, "") for name in numbers),
                    ]
                )
    except OSError as error:
        raise TrialsError(f"{path}: the table cannot be written: {error.strerror}") from error
