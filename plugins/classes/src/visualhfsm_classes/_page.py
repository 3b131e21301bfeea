"""The page of a submission: its marks with reasons, and the recording of its worst trial, as one file."""

from __future__ import annotations

import html
import re
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Final

from visualhfsm.plugins import recorded_run, run_page, write_html
from visualhfsm_classes._words import figure, say

if TYPE_CHECKING:
    from visualhfsm_classes._exercise import Exercise
    from visualhfsm_classes._marks import Earned, Listed, Marks

_STYLE: Final = Path(__file__).with_name("page.css")
_POLICY: Final = (
    "base-uri 'none'; form-action 'none'; object-src 'none'; connect-src 'none'; img-src data: blob:"
)
"""The frame, which inherits it, has its own policy for scripts; this page has no script."""


def write_page(path: Path, exercise: Exercise, marks: Marks, recording: Path | None = None) -> None:
    """Write the page of a submission, perhaps with a recording; and its marks beside it, as Markdown.

    Raises VisualHfsmError.
    """
    frame = "" if recording is None else _frame(exercise, marks, recording)
    write_html(
        path,
        _page(marks.language, f"{marks.name}: {_title(exercise, marks)}", _marks(exercise, marks) + frame),
    )
    write_html(path.with_suffix(".md"), _markdown(marks))


def index_page(exercise: Exercise, language: str, rows: Sequence[Listed]) -> str:
    """Return the page of the class: all submissions, each with a link to its page."""
    language = exercise.language(language)
    title = exercise.title[language]
    body = "\n".join(_listed(language, exercise.points, each) for each in rows)
    points = say(language, "points of", of=figure(language, exercise.points))
    head = f'<tr><td></td><th colspan="2">{points}</th><th>{say(language, "happened")}</th></tr>'
    table = f'<table class="class">{head}\n{body}</table>'
    return _page(language, title, f"<h1>{html.escape(title)}</h1>\n{table}")


def _listed(language: str, of: float, row: Listed) -> str:
    name, points, shown = html.escape(row.name), html.escape(row.points), ""
    if row.page:
        name = f'<a href="{html.escape(row.page)}.html">{name}</a>'
    with suppress(ValueError):  # it may be anything that a teacher wrote
        points, shown = figure(language, float(row.points)), _bar(float(row.points), of)
    note = f"<p><b>{_words(row.note)}</b></p>" if row.note else ""
    return (
        f'<tr><td>{name}</td><td class="points">{points}</td>'
        f"<td>{shown}</td><td>{_words(row.reasons)}{note}</td></tr>"
    )


def _title(exercise: Exercise, marks: Marks) -> str:
    return exercise.title[marks.language]


def _page(language: str, title: str, body: str) -> str:
    style = _STYLE.read_text("utf-8")
    return f"""<!doctype html>
<html lang="{html.escape(language)}">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{_POLICY}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{html.escape(title)}</title>
<style>{style}</style>
</head>
<body>
<main>
{body}
</main>
</body>
</html>
"""


def _marks(exercise: Exercise, marks: Marks) -> str:
    language = marks.language
    of = say(language, "points of", of=figure(language, marks.of))
    parts = [
        f'<p class="exercise">{html.escape(_title(exercise, marks))}</p>',
        f"<h1>{html.escape(marks.name)}</h1>",
        f'<p class="total"><b>{figure(language, marks.points)}</b> {of} {_bar(marks.points, marks.of)}</p>',
    ]
    if marks.digest:
        parts.append(f"<p>{html.escape(_document(marks))}</p>")
    if marks.reason:
        parts.append(
            f'<p class="broken">{say(language, "broken")}:</p>\n<pre>{html.escape(marks.reason)}</pre>'
        )
    if marks.error:
        parts.append(
            f'<p class="broken">{say(language, "error")}:</p>\n<pre>{html.escape(marks.error)}</pre>'
        )
    rows = "\n".join(_row(language, each, shown=not marks.reason) for each in marks.earned)
    head = "".join(f"<th>{say(language, each)}</th>" for each in ("asks", "happened", "points"))
    parts.append(f"<table><tr>{head}</tr>\n{rows}</table>")
    if marks.did and marks.points < marks.of:
        parts.append(f"<p>{_words(marks.did[:1].upper() + marks.did[1:])}.</p>")
    return "\n".join(parts)


def _markdown(marks: Marks) -> str:
    """Return marks as the editor shows them beside the task."""

    def row(*cells: str) -> str:
        return "| " + " | ".join(" ".join(each.replace("|", "\\|").split()) for each in cells) + " |"

    def points(found: Marks | Earned) -> str:
        return say(language, "of", points=figure(language, found.points), of=figure(language, found.of))

    language = marks.language
    head = row(*(say(language, each) for each in ("asks", "happened", "points")))
    table = [head, "|---|---|---|", *(row(each.asks, each.words, points(each)) for each in marks.earned)]
    errors = [f"```\n{each.replace('```', '')}\n```" for each in (marks.reason, marks.error) if each]
    document = [_document(marks)] * bool(marks.digest)
    return "\n\n".join([f"**{points(marks)}**", *errors, "\n".join(table), *document, ""])


def _document(marks: Marks) -> str:
    return say(marks.language, "document", digest=marks.digest, time=marks.handed_in)


def _row(language: str, earned: Earned, *, shown: bool) -> str:
    kind = "full" if earned.points == earned.of else "part" if earned.points else "none"
    points = say(language, "of", points=figure(language, earned.points), of=figure(language, earned.of))
    words = _words(earned.words) if shown else ""
    cells = f'<td>{_words(earned.asks)}</td><td>{words}</td><td class="points">{points}</td>'
    return f'<tr class="{kind}">{cells}</tr>'


def _bar(points: float, of: float) -> str:
    return f'<meter min="0" max="{of:g}" value="{points:g}"></meter>'


def _words(text: str) -> str:
    """Return words as HTML, with what stands between backticks as code."""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", html.escape(text))


def _frame(exercise: Exercise, marks: Marks, recording: Path) -> str:
    """Return the page of a recording as a frame, with the policy of that page."""
    page = html.escape(run_page(recorded_run(recording)))
    title = say(marks.language, "all good" if marks.points == marks.of else "worst")
    where = say(
        marks.language,
        "trial of" if len(exercise.plans) > 1 else "trial",
        plan=marks.worst_plan,
        number=marks.worst_number,
        count=exercise.plans[marks.worst_plan].runs,
    )
    return f"""
<h2>{title} <small>({html.escape(where)})</small></h2>
<iframe title="{title}" srcdoc="{page}"></iframe>"""
