"""The table that `visualhfsm grade` writes."""

from __future__ import annotations

import csv
from pathlib import Path

__all__ = ["marks_in"]


def marks_in(folder: Path) -> dict[str, dict[str, str]]:
    """Return the rows of `marks.csv` in a folder, by the names of the pupils."""
    with (folder / "marks.csv").open(encoding="utf-8-sig", newline="") as file:
        return {row["name"]: row for row in csv.DictReader(file)}
