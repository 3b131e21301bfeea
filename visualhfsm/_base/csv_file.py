"""Tables as CSV, for spreadsheets and for pandas."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

from visualhfsm._base.errors import VisualHfsmError
from zenoh_ice.data.text import encodable, printable

_FORMULA: Final = ("=", "+", "-", "@")
"""The first characters of texts that a spreadsheet would calculate."""


def write_csv(path: Path, rows: Iterable[Sequence[str | float]]) -> None:
    """Write rows of texts, numbers and truth values. Raises VisualHfsmError."""
    with VisualHfsmError.in_place_of(
        OSError, "{path}: the table cannot be written: {reason}", path=str(path)
    ):
        path.write_text(csv_text(rows), "utf-8-sig", newline="")  # so that Excel reads it as UTF-8


def csv_text(rows: Iterable[Sequence[str | float]]) -> str:
    """Return rows as CSV in which no text is taken for a formula, or breaks its line.

    Numbers are exact, and truth values are `true` and `false`.
    """
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator="\n").writerows(map(_cell, row) for row in rows)
    return text.getvalue()


def _cell(value: str | float) -> str | float:
    if isinstance(value, bool):
        return "true" if value else "false"
    if not isinstance(value, str):
        return value
    shown = printable(encodable(value))
    return f"'{shown}" if shown.lstrip().startswith(_FORMULA) else shown
