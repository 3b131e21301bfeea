"""A series of trials as one HTML file, with the pages of its worst trials beside it."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import msgspec

from visualhfsm.plugins import html_file, in_all_languages, recorded_run, run_page, write_html
from visualhfsm.trials import Plan

from ._drawn import view_of
from ._messages import Origin, TrialsView
from ._record import read_header
from ._summary import Summary

_DIGITS: Final = 12
"""Characters of a digest that are shown."""
_GIT_LIMIT: Final = 10.0  # s
_STATIC: Final = Path(__file__).with_name("static")
_ENTRY: Final = _STATIC / "trials-page.js"
_STYLES: Final[tuple[str | Path, ...]] = (
    *(f"styles/{name}" for name in ("theme", "shell", "panels", "run", "monitor")),
    _STATIC / "trials.css",
)


def trials_page(view: TrialsView) -> str:
    """Return the page of a series as HTML."""
    return html_file(view.name, _ENTRY, _STYLES, msgspec.json.encode(view, enc_hook=in_all_languages))


def write_trials_page(
    path: Path, plan: Plan, summary: Summary, outcomes: Path, record: Callable[[Mapping[int, Path]], object]
) -> int:
    """Write the page of a series, and those of its worst trials into a folder beside it.

    `record` runs trials again, each recorded in a file; one that does not come to its end has no page.
    Returns the size of the page in bytes. Raises VisualHfsmError.
    """
    folder = path.with_suffix("")
    pages = {}
    with TemporaryDirectory() as files:
        recordings = {row.number: Path(files) / f"{row.number}.mcap" for row in summary.worst}
        record(recordings)
        for number, recording in recordings.items():
            if not recording.is_file():
                continue
            page = folder / f"{number}.html"
            write_html(page, run_page(recorded_run(recording)))
            pages[number] = f"{folder.name}/{page.name}"
    view = msgspec.structs.replace(view_of(plan, summary, outcomes, pages), origin=origin_of(plan, outcomes))
    return write_html(path, trials_page(view))


def origin_of(plan: Plan, outcomes: Path) -> Origin | None:
    """Return what the outcomes in a file are of. Raises TrialsError."""
    header = read_header(outcomes)
    if header is None:
        return None
    ended = datetime.fromtimestamp(outcomes.stat().st_mtime, UTC)
    return Origin(
        header.document,
        plan.seed,
        header.digest[:_DIGITS],
        header.versions,
        ended.isoformat(" ", "seconds"),
        _commit(Path(plan.document).parent),
    )


def _commit(folder: Path) -> str:
    """Return the commit of a folder; empty if git does not know it."""
    try:
        commit = _git(folder, "rev-parse", "--short=12", "HEAD")
        return f"{commit}+" if _git(folder, "status", "--porcelain", "--", ".") else commit
    except (OSError, subprocess.SubprocessError):
        return ""


def _git(folder: Path, *arguments: str) -> str:
    command = ["git", "-C", str(folder), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=_GIT_LIMIT, check=True)
    return done.stdout.strip()
