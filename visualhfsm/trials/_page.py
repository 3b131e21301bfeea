"""A series of trials as one HTML file, with the pages of its worst trials beside it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import msgspec

from codegen.messages import Message
from visualhfsm._editing.serialization import parse
from visualhfsm._html_file import html_file, write_html
from visualhfsm._languages import in_all_languages
from visualhfsm._live.recordings import open_recording
from visualhfsm._run_page import write_run_page

from ._messages import TrialsView
from ._plan import Plan
from ._summary import Summary
from ._view import view_of

_ENTRY: Final = "trials-page.js"
_STYLES: Final = tuple(f"styles/{name}" for name in ("theme", "shell", "panels", "monitor", "trials"))


def trials_page(view: TrialsView) -> str:
    """Return the page of a series as HTML."""
    return html_file(view.name, _ENTRY, _STYLES, msgspec.json.encode(view, enc_hook=in_all_languages))


def write_trials_page(
    path: Path,
    plan: Plan,
    summary: Summary,
    outcomes: Path,
    record: Callable[[Mapping[int, Path]], object],
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
            run = open_recording(recording)
            document = parse(run.document, Message("The document cannot be read")) if run.document else None
            page = folder / f"{number}.html"
            write_run_page(page, run.exported(document))
            pages[number] = f"{folder.name}/{page.name}"
    return write_html(path, trials_page(view_of(plan, summary, outcomes, pages)))
