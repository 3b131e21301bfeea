"""An editor that is killed while it runs something for a document."""

from __future__ import annotations

from pathlib import Path

import psutil

from codegen.messages import Message
from tests.support.documents import document, state, sub
from tests.support.limits import START_LIMIT
from tests.support.processes import children
from tests.support.waiting import until
from visualhfsm._document.serialization import parse
from visualhfsm._monitor.messages import Source

HANGS = "import threading\nopen('begun', 'w').close()\nthreading.Event().wait()"
COUNTS = "self.count = 1"
"""Code that runs for a moment, and code that never ends once its file `begun` is there."""


def opened(path: Path) -> Source:
    """Return an open document."""
    return Source(1, 0, parse(path.read_text(), Message("Cannot read")), path, False, path.stem)


def written(folder: Path, code: str) -> Path:
    path = folder / "documents" / "behavior.xml"
    path.parent.mkdir()
    path.write_text(document(sub(1, 0, state(1, "only", code, initial=True), variables="self.count = 0")))
    return path


def eventually_below(process: psutil.Process, module: str) -> list[psutil.Process]:
    """Wait until a process has started some of a module, directly or not."""
    found: list[psutil.Process] = []

    def are_there() -> bool:
        found[:] = [each for each in children(module) if process in each.parents()]
        return bool(found)

    until(are_there, START_LIMIT)
    return found
