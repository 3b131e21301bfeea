"""Who wrote the file of a document, and in which step: a note for others who have it open.

Programs with a name leave it in a hidden folder beside the document, for the last version that they wrote.
What it says was written by others: a page shows it, and nothing follows from it.
"""

from __future__ import annotations

import hashlib
from contextlib import suppress
from pathlib import Path
from typing import Final

import msgspec

from visualhfsm._base.errors import EditError
from zenoh_ice.data import typed
from zenoh_ice.data.text import cut, printable

from .files import make_folder, read_file, write_file

_FOLDER: Final = ".visualhfsm"
_LONGEST: Final = 80  # characters


class _Note(msgspec.Struct, frozen=True):
    """The digest of a version of the file, who wrote it, and the step."""

    digest: str
    author: str
    step: str


def sign(path: Path, content: bytes, author: str, step: str) -> None:
    """Leave a note on the content that a file is about to have; where none can be written it has none."""
    file = _file(path)
    if file.is_symlink() or file.parent.is_symlink():  # it may lead out of the project
        return
    note = _Note(hashlib.sha256(content).hexdigest(), author, cut(step, _LONGEST))
    with suppress(EditError):  # the document itself is what matters
        make_folder(file.parent)
        write_file(file, msgspec.json.encode(note))


def signed(path: Path, digest: str) -> str:
    """Return author and step of a version of a file, such as `agent: Add state`; blank if nobody said so."""
    try:
        note = typed.from_json(read_file(_file(path))[0], _Note)
    except (EditError, msgspec.MsgspecError):
        return ""
    return cut(printable(f"{note.author}: {note.step}"), _LONGEST) if note.digest == digest else ""


def _file(path: Path) -> Path:
    return path.parent / _FOLDER / f"{path.name}.json"
