"""The submissions of a class: what was handed in, copied to a folder that has nothing else.

A name of a file is data: it may be anything. Links are not followed: nobody hands in a file of the teacher.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Final

from codegen.files import read_regular
from visualhfsm_classes._errors import GradingError
from zenoh_ice.data.text import encodable, printable

_SUFFIX: Final = ".xml"
_LARGEST_DOCUMENT: Final = 12 << 20
"""Bytes of the largest document."""
_MOST_FILES: Final = 50
_LONGEST_NAME: Final = 100
_DIGITS: Final = 12
"""Of a digest, which a teacher may compare by eye."""
_LEFT_OUT: Final = frozenset({"__MACOSX", "Thumbs.db", "desktop.ini"})
"""The files that systems put into folders and archives, besides names that begin with a dot."""


class UnreadableSubmission(Exception):
    """A submission has no document that could be read; the text says why."""


@dataclass(frozen=True, slots=True)
class Submission:
    """A submission: a document, or a folder with one."""

    name: str
    """As it is shown."""
    path: Path
    page: str
    """The name of its page, without its suffix."""


def find_submissions(folder: Path) -> list[Submission]:
    """Return what was handed in, sorted by name. Raises GradingError when there is nothing."""
    with GradingError.in_place_of(OSError, "{folder}: cannot be read: {reason}", folder=str(folder)):
        inside = [*folder.iterdir()]
    found = [each for each in inside if not each.name.startswith(".") and each.name not in _LEFT_OUT]
    if not found:
        raise GradingError.because(
            "{folder}: there are no submissions: a document, or a folder, for each pupil", folder=str(folder)
        )
    found.sort(key=lambda path: os.fsencode(path.name))
    stems = Counter(_stem(path) for path in found)
    alike = Counter(_stem(path).casefold() for path in found)
    return [
        Submission(
            printable(encodable(path.name if stems[_stem(path)] > 1 else _stem(path)), _LONGEST_NAME),
            path,
            _page(path, alone=alike[_stem(path).casefold()] == 1),
        )
        for path in found
    ]


@dataclass(frozen=True, slots=True)
class Copied:
    """What was copied of a submission."""

    document: Path
    """The one to run, `NAME.xml`: the only one, or the one that has that name already."""
    digest: str
    """The first digits of its SHA-256; of several documents that of all, with their names."""
    written: str
    """When the last of them was written, as ISO 8601."""


def copy_submission(path: Path, folder: Path, name: str) -> Copied:
    """Copy the documents of a submission into a folder. Raises UnreadableSubmission."""
    try:
        documents = _documents(path, name)
    except OSError as error:
        raise UnreadableSubmission(f"it cannot be read: {error.strerror}") from error
    digest, written = hashlib.sha256(), 0.0
    for document in documents:
        target = f"{name}{_SUFFIX}" if document == documents[0] else document.name
        content = _content(document)
        (folder / target).write_bytes(content)
        digest.update(content if len(documents) == 1 else os.fsencode(f"{target}\n") + content)
        with suppress(OSError):  # it has just gone
            written = max(written, document.stat().st_mtime)
    when = datetime.fromtimestamp(written).astimezone().isoformat(" ", "seconds")
    return Copied(folder / f"{name}{_SUFFIX}", digest.hexdigest()[:_DIGITS], when)


def _documents(path: Path, name: str) -> list[Path]:
    """Return the documents of a submission, the one to run first."""
    if path.is_symlink():
        raise UnreadableSubmission("it is a link: hand in the document itself")
    if not path.is_dir():
        if path.suffix.lower() != _SUFFIX:
            raise UnreadableSubmission(f"it is no document: hand in a file that ends in {_SUFFIX}")
        return [path]
    documents = sorted(each for each in path.iterdir() if each.suffix.lower() == _SUFFIX)
    if not documents:
        raise UnreadableSubmission(f"the folder has no document: hand in a file that ends in {_SUFFIX}")
    if len(documents) > _MOST_FILES:
        raise UnreadableSubmission(
            f"the folder has {len(documents)} documents: at most {_MOST_FILES} are read"
        )
    main = path / f"{name}{_SUFFIX}"
    if main in documents:
        return [main, *(each for each in documents if each != main)]
    if len(documents) > 1:
        raise UnreadableSubmission(f"the folder has {len(documents)} documents, and none is {main.name}")
    return documents


def _content(path: Path) -> bytes:
    """Return the bytes of a regular file, of nothing that a link, a pipe or a device could be."""
    try:
        content = read_regular(path, _LARGEST_DOCUMENT + 1, links=False)
    except OSError as error:
        raise UnreadableSubmission(f"it cannot be read: {error.strerror}") from error
    if len(content) > _LARGEST_DOCUMENT:
        raise UnreadableSubmission(f"it is larger than {_LARGEST_DOCUMENT >> 20} MB")
    return content


def _stem(path: Path) -> str:
    return path.stem if path.suffix.lower() == _SUFFIX else path.name


def _page(path: Path, *, alone: bool) -> str:
    """Return the name of a page: letters, digits and dashes, and a number if that changes or repeats it."""
    stem = _stem(path)
    plain = re.sub(r"[^A-Za-z0-9_-]+", "-", stem).strip("-")[:60]
    if alone and plain == stem and plain != "index":
        return plain
    return f"{plain or 'submission'}-{hashlib.sha256(os.fsencode(path.name)).hexdigest()[:8]}"
