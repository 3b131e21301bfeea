"""Take what a recording says of its component: which one it was, and its sources. Nothing of it is run."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from hfsm_recording.reader import RecordingError, RecordingFile
from visualhfsm.errors import VisualHfsmError

__all__ = ["RecordedSources", "open_file", "sources_of"]

_NAME: Final = re.compile(r"(document|component|extension)/([\w.\- ]{1,200}\.(?:xml|py))")


@dataclass(frozen=True)
class RecordedSources:
    """The component of a recording: its name, its start in ns, and names and texts of its files, by kind."""

    name: str
    start: int
    files: dict[str, tuple[str, bytes]] = field(default_factory=dict)

    def write(self, folder: Path) -> Path:
        """Write the component's Python into a folder; return its file. Raises VisualHfsmError."""
        if "component" not in self.files:
            raise VisualHfsmError("the recording does not hold its component: name the document")
        for kind in ("component", "extension"):
            if kind in self.files:
                name, text = self.files[kind]
                (folder / name).write_bytes(text)
        return folder / self.files["component"][0]


def open_file(path: Path) -> RecordingFile:
    """Return a recording; raises VisualHfsmError."""
    try:
        return RecordingFile(path)
    except RecordingError as error:
        raise VisualHfsmError(str(error)) from error


def sources_of(recording: RecordingFile) -> RecordedSources:
    """Return the component of a recording."""
    found = RecordedSources(recording.name, recording.start)
    for name, text in recording.sources.items():
        if match := _NAME.fullmatch(name):
            found.files[match[1]] = match[2], text
    return found
