"""A run as one HTML file, to hand it in: automata, variables, timeline, robot in 3D and pictures.

The file contains the modules of the editor's page that `_editor/static/onefile/run-page.js` imports, and the
run.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import msgspec

from codegen.hfsm.document import Document
from codegen.messages import NO_MESSAGE, Message
from hfsm_runtime.recording_file.messages import Shape
from interfaces.hfsm import ComponentStructure
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._base.html_file import html_file, write_html
from visualhfsm._base.languages import in_all_languages
from visualhfsm._document.views import view
from visualhfsm._monitor.realm.description import nao
from visualhfsm._monitor.realm.follower import LiveStructure
from visualhfsm._monitor.realm.moments import translate_moment
from visualhfsm._monitor.realm.run_log import RunLog

MOST_PICTURES: Final = 600
"""Pictures of all cameras together in one file; those of 320 x 240 take about 10 MB."""
LARGEST_PAGE: Final = 50 << 20
"""Limit in bytes of a file that can be opened and sent without trouble."""

_LARGEST_MOMENTS: Final = 64 << 20
"""Bytes of the moments as JSON, which the browser unpacks; some minutes at 20 a second fit, longer runs have
fewer a second."""
_SAYS: Final = re.compile(rb'"message":|"refusal":"[^"]')
"""The bytes of each moment with errors, a refusal or events of the robot."""
_ENTRY: Final = "onefile/run-page.js"
_STYLES: Final = (
    "vendor/uplot",
    *(f"styles/{name}" for name in ("theme", "shell", "canvas", "panels", "run", "monitor", "run-page")),
)


@dataclass(frozen=True, slots=True)
class ExportedRun:
    """The content to export: the log of a component, its document if known, its world and its pictures.

    `imported` are the views of automata that the document imports. `pictures` are JPEG images by camera, each
    with its wall time in s. `shortened` says that it is only the beginning of a run. `body` is the robot, as
    `_monitoring.description` describes it for the page.
    """

    name: str
    structure: ComponentStructure
    log: RunLog
    document: Document | None = None
    imported: Sequence[Mapping[str, Any]] = ()
    world: Sequence[Shape] = ()
    pictures: Mapping[str, Sequence[tuple[float, bytes]]] = field(default_factory=dict)
    shortened: Message = NO_MESSAGE
    body: bytes = b""


def write_run_page(path: Path, run: ExportedRun) -> int:
    """Write the page of a run to a file, and return its size in bytes. Raises VisualHfsmError."""
    return write_html(path, run_page(run))


def run_page(run: ExportedRun, largest: int = LARGEST_PAGE) -> str:
    """Return the page of a run as HTML. Raises VisualHfsmError when it is empty, or too large."""
    page = html_file(run.name, _ENTRY, _STYLES, _content(run))
    if len(page) > largest:
        raise VisualHfsmError.because(
            "the page of this run would have {count} MB, and at most {largest} MB can be "
            "exported: record a shorter run, or one without images",
            count=len(page) >> 20,
            largest=largest >> 20,
        )
    return page


def _content(run: ExportedRun) -> bytes:
    """Return the run as run-page.js reads it: lines of JSON, first `Content`, then the moments."""
    newest = run.log.newest
    if newest is None:
        raise VisualHfsmError.because(
            "nothing is known of a run of {run}: there is nothing to export", run=run.name
        )
    moments = run.log.moments(_LARGEST_MOMENTS)
    document = None
    if run.document is not None:
        document = {**view(run.document), "automata": [view(each) for each in run.document.automata]}
    content = {
        "name": run.name,
        "began": newest.component.startedAt,
        "shortened": run.shortened,
        "structure": LiveStructure(run.structure, 1),
        "timeline": run.log.timeline(),
        "document": document,
        "imported": run.imported,
        "world": run.world,
        "body": msgspec.Raw(run.body or nao().page),
        "pictures": run.pictures,
        "times": [time for time, _ in moments],
    }
    head = msgspec.json.encode(content, enc_hook=in_all_languages)
    return b"\n".join([head, *(_readable(moment) for _, moment in moments)])


def _readable(moment: bytes) -> bytes:
    """Return a moment of a log with what is said in it in all languages."""
    if not _SAYS.search(moment):
        return moment
    return msgspec.json.encode(translate_moment(msgspec.Raw(moment)), enc_hook=in_all_languages)
