"""Read what a recording says of its component: which one it was, and its sources. Nothing of it is run."""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from visualhfsm.errors import VisualHfsmError

__all__ = ["RecordedSources", "read_sources"]

_METADATA: Final = "visualhfsm.component"
_LARGEST: Final = 16 << 20
_NAME: Final = re.compile(r"(document|component|extension)/([\w.\- ]{1,200}\.(?:xml|py))")
_BROKEN: Final = (ValueError, EOFError, KeyError, IndexError, struct.error)


@dataclass(frozen=True)
class RecordedSources:
    """The component of a recording, and the names and texts of its files, by kind."""

    metadata: dict[str, str] = field(default_factory=dict)
    files: dict[str, tuple[str, bytes]] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The name of the component."""
        return self.metadata.get("name", "?")[:200]

    @property
    def start(self) -> int:
        """When it started, in s since the epoch."""
        text = self.metadata.get("start", "")
        return int(text) // 1_000_000_000 if text.isascii() and text.isdigit() and len(text) < 20 else 0

    def write(self, folder: Path) -> Path:
        """Write the component's Python into a folder; return its file. Raises VisualHfsmError."""
        if "component" not in self.files:
            raise VisualHfsmError("the recording does not hold its component: name the document")
        for kind in ("component", "extension"):
            if kind in self.files:
                name, text = self.files[kind]
                (folder / name).write_bytes(text)
        return folder / self.files["component"][0]


def read_sources(recording: Path) -> RecordedSources:
    """Return what stands at the beginning of a recording; raises VisualHfsmError."""
    from mcap.exceptions import McapError
    from mcap.records import Attachment, Chunk, Metadata
    from mcap.stream_reader import StreamReader

    found = RecordedSources()
    try:
        with recording.open("rb") as file:
            for record in StreamReader(file, emit_chunks=True, record_size_limit=_LARGEST).records:
                if isinstance(record, Chunk):  # all of it stands before the first message
                    break
                if isinstance(record, Metadata) and record.name == _METADATA:
                    found.metadata.update(record.metadata)
                elif isinstance(record, Attachment) and (match := _NAME.fullmatch(record.name)):
                    found.files[match[1]] = match[2], record.data
    except OSError as error:
        raise VisualHfsmError(f"the recording {recording} cannot be read: {error.strerror}") from error
    except (McapError, *_BROKEN) as error:
        if not found.metadata:
            raise VisualHfsmError(f"{recording} is not an MCAP file, or damaged at its beginning") from error
    if not found.metadata:
        raise VisualHfsmError(f"{recording} is no recording of a component")
    return found
