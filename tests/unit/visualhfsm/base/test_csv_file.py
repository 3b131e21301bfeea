"""Tables as CSV: exact numbers, and texts that are nothing but texts."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from visualhfsm._base.csv_file import write_csv


def written(path: Path, *rows: list[str | float]) -> list[list[str]]:
    write_csv(path, rows)
    with path.open(encoding="utf-8-sig", newline="") as file:
        return list(csv.reader(file))


@pytest.mark.parametrize("text", ["=1+1", "@SUM(A1)", "+1", "-1", " =1+1", "=cmd|' /C calc'!A0"])
def test_no_text_is_a_formula(tmp_path: Path, text: str) -> None:
    assert written(tmp_path / "table.csv", [text, 1]) == [[f"'{text}", "1"]]


@pytest.mark.parametrize(
    ("text", "cell"),
    [
        ("a, b", "a, b"),
        ('says "hello"', 'says "hello"'),
        ("two\nlines", "two lines"),
        ("red\x1b[31m", "red [31m"),
        ("a\r=1", "a =1"),
        ("\udcff", "\\udcff"),
        ("niño", "niño"),
        ("", ""),
    ],
)
def test_a_text_stays_in_its_cell_and_line(tmp_path: Path, text: str, cell: str) -> None:
    path = tmp_path / "table.csv"
    assert written(path, [text, 2.0], ["next", 3.0]) == [[cell, "2.0"], ["next", "3.0"]]
    assert len(path.read_text("utf-8-sig").splitlines()) == 2


def test_numbers_are_exact_and_truth_values_are_words(tmp_path: Path) -> None:
    ((third, tiny, negative, whole, yes, no),) = written(
        tmp_path / "table.csv", [1 / 3, 5e-324, -0.5, 7, True, False]
    )
    assert (float(third), float(tiny), negative, whole) == (1 / 3, 5e-324, "-0.5", "7")
    assert (yes, no) == ("true", "false")
