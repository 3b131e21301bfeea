"""Show what was measured: as a table in the terminal, as Markdown, and as a plot."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from rich.console import Console
from rich.table import Table as RichTable

from .figures import Section, Table

_INTRODUCTION: Final = (
    "Written by `make bench-transport` (`benchmarks/bench_transport.py`). Every server and client is a",
    "process of its own, on loopback. Those of Ice and ours alternate in rounds of random order; the first",
    "round is not counted. A figure is the median of what the rounds gave; their middle half stands in",
    "parentheses. Ice has its memory tuned (`MALLOC_MMAP_THRESHOLD_`, `MALLOC_TRIM_THRESHOLD_`), without",
    "which its large replies take several times as long; ours run under the same tuning. Each image that is",
    "sent is copied out of an array first, as from a camera.",
)


def show(sections: Sequence[Section]) -> None:
    """Print the figures beside what was asked."""
    table = RichTable("", "asked", "measured", "", title="Calls and streams of zenoh_ice, beside Ice 3.7.11")
    for section in sections:
        for figure in section.figures:
            met = "[green]met[/]" if figure.met else "[red]not met[/]"
            table.add_row(figure.what, figure.asked, figure.measured, met)
        table.add_section()
    Console().print(table)


def show_details(section: Section) -> None:
    """Print the tables of a section."""
    console = Console()
    for each in section.tables:
        table = RichTable(*each.columns, title=each.title, title_justify="left")
        for row in each.rows:
            table.add_row(*row)
        console.print(table)


def write_markdown(sections: Sequence[Section], path: Path, plot: Path) -> None:
    """Write the figures and all tables."""
    lines = [
        "# Calls and streams beside Ice",
        "",
        *_INTRODUCTION,
        "",
        *_lines(
            Table(
                "",
                ["figure", "asked", "measured", ""],
                [
                    [figure.what, figure.asked, figure.measured, "met" if figure.met else "**not met**"]
                    for section in sections
                    for figure in section.figures
                ],
            )
        ),
        "",
        f"![the same as a plot]({plot.name})",
    ]
    for section in sections:
        run = section.run
        lines += [
            "",
            f"## {section.name.capitalize()}",
            "",
            f"{run['when']}, {run['took']}, {run['how']}: {run['on']}.",
        ]
        for table in section.tables:
            lines += ["", *_lines(table)]
    path.write_text("\n".join(lines) + "\n")


def _lines(table: Table) -> list[str]:
    head, *columns = table.columns
    rows = [[table.title or head, *columns], ["---"] * len(table.columns), *table.rows]
    return ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows]
