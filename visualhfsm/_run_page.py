"""Write a run as one HTML file that needs neither server nor network, to hand it in.

The file contains the modules of the editor's page that `_web/static/run-page.js` imports. Each is a `data:`
URL in an import map, which browsers know without a build step; nothing relative can be imported from there,
so that modules import each other by name. The run is one block of compressed JSON in base64: no name,
variable or code of it is ever read as HTML or script. The policy of the file allows only scripts and styles
with its nonce, and no connection.
"""

from __future__ import annotations

import base64
import gzip
import html
import json
import os
import posixpath
import re
import secrets
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import msgspec

from codegen.hfsm.document import Document
from hfsm_runtime.recording_file.messages import Shape
from interfaces.hfsm import ComponentStructure
from visualhfsm._editing.views import view
from visualhfsm._errors import VisualHfsmError
from visualhfsm._monitoring.description import nao
from visualhfsm._monitoring.follower import LiveStructure
from visualhfsm._monitoring.run_log import RunLog

STATIC: Final = Path(__file__).parent / "_web" / "static"
LIBRARIES: Final = ("codemirror", "dagre", "lit", "three", "uplot")
"""Libraries that the page imports by name; each is a file in vendor/."""
MOST_PICTURES: Final = 600
"""Pictures of all cameras together in one file; those of 320 x 240 take about 10 MB."""
LARGEST_PAGE: Final = 50 << 20
"""Limit in bytes of a file that can be opened and sent without trouble."""

_LARGEST_MOMENTS: Final = 64 << 20
"""Bytes of the moments as JSON, which the browser unpacks; some minutes at 20 a second fit, longer runs have
fewer a second."""
_ENTRY: Final = "run-page.js"
_STYLES: Final = (
    "vendor/uplot",
    *(f"styles/{name}" for name in ("theme", "shell", "canvas", "panels", "monitor", "run-page")),
)
_IMPORT: Final = re.compile(
    r"""^\s*(?:import|export)\s(?:[^"';]*?\sfrom\s)?\s*["'](?P<name>[^"']+)["']""", re.MULTILINE
)


class Figure(msgspec.Struct, frozen=True):
    """A figure that summarizes a run."""

    name: str
    value: str
    note: str = ""


@dataclass(frozen=True, slots=True)
class Run:
    """The content to export: the log of a component, its document if known, its world and its pictures.

    `imported` are the views of automata that the document imports. `pictures` are JPEG images by camera, each
    with its wall time in s. `complete` says whether the log has the whole run. `body` is the robot, as
    `_monitoring.description` describes it for the page.
    """

    name: str
    structure: ComponentStructure
    log: RunLog
    document: Document | None = None
    imported: Sequence[Mapping[str, Any]] = ()
    world: Sequence[Shape] = ()
    pictures: Mapping[str, Sequence[tuple[float, bytes]]] = field(default_factory=dict)
    complete: bool = True
    figures: Sequence[Figure] = ()
    body: bytes = b""


def check_place(path: Path) -> None:
    """Raise VisualHfsmError when nothing can be written there, before the run begins."""
    directory = path.resolve().parent
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise VisualHfsmError(f"{path}: the page cannot be written: {error.strerror}") from error
    if not os.access(directory, os.W_OK):
        raise VisualHfsmError(f"{path}: the page cannot be written: {directory} is not writable")


def write_run_page(path: Path, run: Run) -> int:
    """Write the page of a run to a file, and return its size in bytes. Raises VisualHfsmError."""
    text = run_page(run)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise VisualHfsmError(f"{path}: the page cannot be written: {error.strerror}") from error
    return len(text.encode())


def run_page(run: Run, largest: int = LARGEST_PAGE) -> str:
    """Return the page of a run as HTML. Raises VisualHfsmError when it is empty, or too large."""
    nonce = secrets.token_urlsafe(16)
    policy = "; ".join(
        [
            "default-src 'none'",
            f"script-src 'nonce-{nonce}'",
            f"style-src 'nonce-{nonce}'",
            "img-src data: blob:",
            "base-uri 'none'",
            "form-action 'none'",
        ]
    )
    modules = {name: _data_url(text) for name, text in imported_modules(_ENTRY).items()}
    styles = "\n".join((STATIC / f"{name}.css").read_text("utf-8") for name in _STYLES)
    forced = (STATIC / "styles/forced-colors.css").read_text("utf-8")
    page = f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>{html.escape(run.name)}</title>
<style nonce="{nonce}">{styles}</style>
<style nonce="{nonce}" media="(forced-colors: active)">{forced}</style>
<script nonce="{nonce}" type="importmap">{json.dumps({"imports": modules})}</script>
</head>
<body>
<noscript>This page shows a run by a script, but this browser does not allow scripts.</noscript>
<script type="text/plain" id="run">{_packed(run)}</script>
<script nonce="{nonce}" type="module">import "{_ENTRY}";</script>
</body>
</html>
"""
    if len(page) > largest:
        raise VisualHfsmError(
            f"the page of this run would have {len(page) >> 20} MB, and at most {largest >> 20} MB can be "
            "exported: record a shorter run, or one without images"
        )
    return page


def imported_modules(entry: str, directory: Path = STATIC) -> dict[str, str]:
    """Return a module of the page and all that it imports when it is loaded: their text by name.

    The names are paths below `directory`; libraries have the names by which they are imported. The imports in
    the texts are by these names, too.
    """
    found: dict[str, str] = {}
    waiting = [entry]
    while waiting:
        name = waiting.pop(0)
        path = directory / (f"vendor/{name}.js" if name in LIBRARIES else name)
        if name in found or not path.is_file():
            continue

        def named(match: re.Match[str], folder: str = posixpath.dirname(name)) -> str:
            target = match["name"]
            if target.startswith("."):
                target = posixpath.normpath(posixpath.join(folder, target))
                if target.startswith("../"):
                    return match[0]
            waiting.append(target)
            return match[0].replace(match["name"], target)

        text = path.read_text("utf-8")
        found[name] = text if name in LIBRARIES else _IMPORT.sub(named, text)
    return found


def _data_url(text: str) -> str:
    return f"data:text/javascript;base64,{base64.b64encode(text.encode()).decode()}"


def _packed(run: Run) -> str:
    """Return the run as run-page.js reads it: lines of JSON, first `Content`, then the moments."""
    newest = run.log.newest
    if newest is None:
        raise VisualHfsmError(f"nothing is known of a run of {run.name}: there is nothing to export")
    moments = run.log.moments(_LARGEST_MOMENTS)
    document = None
    if run.document is not None:
        document = {**view(run.document), "automata": [view(each) for each in run.document.automata]}
    content = {
        "name": run.name,
        "began": newest.component.startedAt,
        "complete": run.complete,
        "figures": run.figures,
        "structure": LiveStructure(run.structure, 1),
        "timeline": run.log.timeline(),
        "document": document,
        "imported": run.imported,
        "world": run.world,
        "body": msgspec.Raw(run.body or nao().page),
        "pictures": run.pictures,
        "times": [time for time, _ in moments],
    }
    lines: Iterable[bytes] = (msgspec.json.encode(content), *(moment for _, moment in moments))
    return base64.b64encode(gzip.compress(b"\n".join(lines), 6, mtime=0)).decode()
