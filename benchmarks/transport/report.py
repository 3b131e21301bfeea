"""Show the results as a table in the terminal, as Markdown, and as a plot."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from rich.console import Console
from rich.table import Table as RichTable

from .figures import Section, Table

_INTRODUCTION: Final = (
    "Written by `make bench-transport` (`benchmarks/bench_transport.py`). Every server and client is a",
    "separate process, on loopback. Those of Ice and ours alternate in rounds of random order; the first",
    "round is not counted. A figure is the median of the rounds, with the quartiles in parentheses. The",
    "memory allocation is tuned for Ice (`MALLOC_MMAP_THRESHOLD_`, `MALLOC_TRIM_THRESHOLD_`): otherwise its",
    "large replies take several times as long. Ours run with the same settings. Each image is copied from",
    "an array before it is sent, as from a camera.",
)


def show(sections: Sequence[Section]) -> None:
    """Print the figures with the requirements."""
    table = RichTable(
        "", "required", "measured", "", title="Calls and streams of zenoh_ice and of Ice 3.7.11"
    )
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
        "# Calls and streams compared with Ice",
        "",
        *_INTRODUCTION,
        "",
        *_lines(
            Table(
                "",
                ["figure", "required", "measured", ""],
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
