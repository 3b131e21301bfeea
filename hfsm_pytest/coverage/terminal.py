"""Coverage as a table in the terminal."""

from __future__ import annotations

from .summary import DocumentCoverage, Summary

__all__ = ["report_lines"]


def report_lines(summary: Summary) -> list[tuple[str, bool]]:
    """Return the lines of the table, each with whether something is missing there."""
    width = max([len("document"), *(len(document.file) for document in summary.documents)])
    head = f"{'document':<{width}}  {'states':>8}  {'transitions':>11}  {'guards':>8}  {'covered':>8}"
    lines = [(head, False), ("-" * len(head), False)]
    lines += [(_row(each.file, each, width), each.all.hit < each.all.total) for each in summary.documents]
    total = DocumentCoverage("total", tuple(a for d in summary.documents for a in d.automata))
    lines += [("-" * len(head), False), (_row("total", total, width), total.all.hit < total.all.total)]
    missing = [found for document in summary.documents for found in document.missing()]
    if missing:
        lines += [("", False), ("missing:", False), *((f"  {found}", True) for found in missing)]
    return lines


def _row(name: str, of: DocumentCoverage, width: int) -> str:
    states, transitions, guards = str(of.states), str(of.transitions), str(of.guards)
    # Never 100 % while something is missing.
    percent = int(of.all.percent) if of.all.hit < of.all.total else 100
    return f"{name:<{width}}  {states:>8}  {transitions:>11}  {guards:>8}  {percent:>6} %"
