"""Coverage as a page for the browser, which needs nothing but itself."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from importlib import resources
from pathlib import Path

from .drawing import draw, rank_state, rank_transition, times
from .summary import AutomatonCoverage, DocumentCoverage, Ratio, Summary

__all__ = ["write_page"]


def write_page(summary: Summary, directory: Path) -> Path:
    """Write `index.html` into a directory, which is made when it is missing; return its path."""
    directory.mkdir(parents=True, exist_ok=True)
    page = directory / "index.html"
    page.write_text("\n".join(_page(summary)), encoding="utf-8")
    return page


def _page(summary: Summary) -> Iterator[str]:
    style = resources.files(__package__).joinpath("page.css").read_text(encoding="utf-8")
    yield '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
    yield '<meta name="viewport" content="width=device-width, initial-scale=1">'
    yield f"<title>Coverage of automata: {_percent(summary.all)}</title><style>{style}</style></head><body>"
    yield f'<header><h1>Coverage of automata</h1><p class="total">{_percent(summary.all)}</p></header><main>'
    yield "<table class='documents'><thead><tr><th>Document<th>States<th>Transitions<th>Guards<th>Covered"
    yield "</tr></thead><tbody>"
    for number, document in enumerate(summary.documents):
        yield _document_row(document, number)
    yield "</tbody></table>"
    yield (
        "<p class='legend'><span class='hit'>covered</span> "
        "<span class='part'>the guard was only true, or only false</span> <span class='miss'>never</span></p>"
    )
    for number, document in enumerate(summary.documents):
        percent = _percent(document.all)
        yield f"<section id='d{number}'><h2>{escape(document.file)} <small>{percent}</small></h2>"
        for automaton in document.automata:
            elsewhere = automaton.items.file if automaton.items.file != document.file else ""
            yield from _automaton(automaton, elsewhere)
        yield "</section>"
    yield "</main></body></html>"


def _document_row(document: DocumentCoverage, number: int) -> str:
    cells = "".join(f"<td>{ratio}" for ratio in (document.states, document.transitions, document.guards))
    bar = f"<meter min='0' max='100' value='{document.all.percent:.1f}'></meter>"
    return (
        f"<tr><td><a href='#d{number}'>{escape(document.file)}</a>{cells}"
        f"<td>{bar} {_percent(document.all)}</tr>"
    )


def _automaton(automaton: AutomatonCoverage, file: str) -> Iterator[str]:
    """Yield an automaton; `file` is where it is imported from, if it is."""
    items = automaton.items
    source = f"from {escape(file)}, " if file else ""
    yield f"<article><h3>{escape(items.name)} <small>{source}{_percent(automaton.all)}</small></h3>"
    if items.states:
        yield f"<figure>{draw(automaton)}</figure>"
    yield "<table class='items'><thead><tr><th>Line<th>State or transition<th>Times<th>Guard true, false"
    yield "</tr></thead><tbody>"
    for state in items.states:
        yield (
            f"<tr class='{rank_state(automaton, state)}'><td>{state.line}<td>{escape(state.name)}"
            f"<td>{times(automaton.entered(state))}<td></tr>"
        )
    for each in items.transitions:
        held, held_not = automaton.guard(each)
        guard = f"{held}, {held_not}" if each.guarded else ""
        way = f"{items.state(each.origin)} → {items.state(each.destination)}"
        yield (
            f"<tr class='{rank_transition(automaton, each)}'><td>{each.line}<td>{escape(each.name)}: "
            f"{escape(way)} <span class='trigger'>{escape(each.trigger)}</span>"
            f"<td>{times(automaton.times_fired(each))}<td>{guard}</tr>"
        )
    yield "</tbody></table></article>"


def _percent(ratio: Ratio) -> str:
    # Never 100 % while something is missing.
    return f"{int(ratio.percent) if ratio.hit < ratio.total else 100} %"
