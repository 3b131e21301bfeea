"""Keep every change of a document on disk until it is closed, so that a crash loses nothing.

A journal is a file of JSON lines: the document as it was opened, then every command. It is locked while its
document is open, and the system releases the lock when the process dies, for whatever reason. A power failure
may lose the last seconds. A file that grows large is replaced by one that begins with the document as it was
saved, and as it is now: a day of typing takes no more than that.
"""

from __future__ import annotations

import fcntl
import logging
import mmap
import os
import secrets
import shutil
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Final

import msgspec

from codegen.messages import Message
from codegen.reasons import reason
from visualhfsm._base.errors import EditError
from visualhfsm.project._editing.files import FileVersion
from zenoh_ice.application.directories import state_directory
from zenoh_ice.data import typed

_logger = logging.getLogger(__name__)

_VERSION: Final = 2
_SUFFIX: Final = ".journal"
_UNREADABLE: Final = ".unreadable"
LARGEST_JOURNAL: Final = 64 << 20
"""Bytes beyond which a journal restarts."""


class Header(msgspec.Struct, frozen=True, tag="open", tag_field="entry"):
    """The document as it was opened; `content` is that of its file, or the text of a new document."""

    path: str | None
    name: str
    content: bytes
    digest: str
    version: int = _VERSION


class Done(msgspec.Struct, frozen=True, tag="do", tag_field="entry"):
    """A command as JSON, and whether it continued the step before."""

    command: msgspec.Raw
    merged: bool = False


class Undone(msgspec.Struct, frozen=True, tag="undo", tag_field="entry"):
    """One step was undone."""


class Redone(msgspec.Struct, frozen=True, tag="redo", tag_field="entry"):
    """One step was done again."""


class Saved(msgspec.Struct, frozen=True, tag="saved", tag_field="entry"):
    """The document was saved, or its file turned out to hold `content` meanwhile."""

    path: str
    digest: str
    content: bytes | None = None


Entry = Done | Undone | Redone | Saved

_decode_header: Final = typed.json_decoder(Header)
_decode_entry: Final = typed.json_decoder(Entry)


@dataclass(frozen=True, slots=True)
class Abandoned:
    """The journal of a document that was never closed; times are in s since 1970."""

    file: Path
    path: Path | None
    name: str
    changed_at: float


def journal_directory() -> Path:
    """Return the directory of the journals: `visualhfsm/journals` in the user's directory of states."""
    return state_directory() / "journals"


class Journal:
    """The journal of one open document; its file is created with the first entry."""

    def __init__(self, directory: Path, header: Header) -> None:
        self._directory = directory
        self.header = header
        """The document as it was opened."""
        self._largest = LARGEST_JOURNAL
        self._restarted = False
        self.file: Path | None = None
        """The file, None before the first entry."""
        self._descriptor = -1
        self._has_gap = False
        self._is_only_read = False

    @classmethod
    def take_over(cls, file: Path, *, reads: bool = False) -> tuple[Journal, Iterator[tuple[Entry, int]]]:
        """Return a journal to be continued, and its entries, each with its place for `cut`.

        One of which somebody only `reads` what it says stays as it is; an invalid entry raises EditError.
        Raises EditError when it cannot be read, or another process has its document open.
        """
        what = Message("Cannot recover from {file}", file=file.name)
        try:
            descriptor = os.open(file, os.O_RDWR | os.O_APPEND | os.O_CLOEXEC)
        except OSError as error:
            raise EditError(what, reason(error), "it may have been recovered already") from error
        try:
            if not _lock(descriptor):
                raise EditError(what, "its document is open in another process", "edit it there")
            if not os.fstat(descriptor).st_nlink:  # that process has just closed it
                raise EditError(what, "it was removed", "it may have been recovered already")
            with _reader(descriptor) as stream:
                first = stream.readline()
            try:
                header = _decode_header(first)
            except msgspec.MsgspecError as error:
                raise EditError(what, "it contains no document", "remove it") from error
            if header.version != _VERSION:
                raise EditError(
                    what,
                    Message("it is of version {version}", version=header.version),
                    "open it with the release that wrote it",
                )
            if not reads:
                # A line that was cut off by the crash is removed, so that the next one does not continue it.
                os.ftruncate(descriptor, _end_of_lines(descriptor))
        except BaseException:
            os.close(descriptor)
            raise
        journal = cls(file.parent, header)
        journal.file, journal._descriptor, journal._is_only_read = file, descriptor, reads
        return journal, journal._entries(len(first))

    def add(self, entry: Entry, whole: Callable[[], Entry], saved: Header | None = None) -> None:
        """Write an entry; when that fails, such as on a full disk, it is logged and editing continues.

        Entries after a missing one could not be replayed: from then on `whole`, the change to the present
        document, is written instead. A journal that has grown large restarts with `saved`, the document
        as it was saved, if that is known.
        """
        lacks = self._has_gap or (self._restarted and isinstance(entry, Undone | Redone))
        entries = [entry] if not lacks else [whole(), *([entry] if isinstance(entry, Saved) else [])]
        size = 0
        try:
            if self._descriptor < 0:
                self._begin()
            size = os.fstat(self._descriptor).st_size
            if size > self._largest and saved is not None:
                self._restart(saved, whole())
                return
            _write(self._descriptor, b"".join(msgspec.json.encode(each) + b"\n" for each in entries))
        except OSError as error:
            _logger.warning("the autosave journal cannot be written: %s", error.strerror or error)
            self._has_gap = True
            if self._descriptor >= 0:
                with suppress(OSError):  # the disk may have been removed
                    os.ftruncate(self._descriptor, size)

    def begin(self) -> None:
        """Create the file, so that the document can be recovered although it was not changed."""
        if self._descriptor < 0:
            try:
                self._begin()
            except OSError as error:
                _logger.warning("the autosave journal cannot be written: %s", error.strerror or error)

    def cut(self, place: int, why: Exception) -> None:
        """Drop the invalid entry at a place, and all that follow; a copy of the file is kept."""
        assert self.file is not None
        if self._is_only_read:
            what = Message("Cannot recover from {file}", file=self.file.name)
            raise EditError(what, "it contains an invalid entry", "recover what precedes it") from why
        copy = self.file.with_name(self.file.name + _UNREADABLE)
        _logger.warning("%s: what follows is dropped, and kept in %s: %s", self.file, copy, why)
        try:
            shutil.copyfile(self.file, copy)
            os.ftruncate(self._descriptor, place)
        except OSError as error:
            _logger.warning("%s cannot be continued: %s", self.file, error.strerror or error)

    def close(self, *, keep: bool = False) -> None:
        """End the journal and remove its file, unless it is kept to be recovered later."""
        if self._descriptor >= 0:
            if not keep and self.file is not None:
                self.file.unlink(missing_ok=True)
            os.close(self._descriptor)
        self._descriptor, self.file = -1, None

    def _restart(self, saved: Header, present: Entry) -> None:
        """Replace the file by one with two entries; raises OSError, and then leaves it as it was."""
        other = Journal(self._directory, saved)
        try:
            other._begin()
            _write(other._descriptor, msgspec.json.encode(present) + b"\n")
        except BaseException:
            other.close()
            raise
        self.close()
        self.header, self.file, self._descriptor = saved, other.file, other._descriptor
        self._restarted, self._has_gap = True, False
        self._largest = max(self._largest, 4 * os.fstat(self._descriptor).st_size)

    def _begin(self) -> None:
        self._directory.mkdir(parents=True, exist_ok=True, mode=0o700)
        file = self._directory / f"{secrets.token_hex(8)}{_SUFFIX}"
        flags = os.O_RDWR | os.O_APPEND | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC
        descriptor = os.open(file, flags, 0o600)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX)  # a search for abandoned journals holds it briefly
            _write(descriptor, msgspec.json.encode(self.header) + b"\n")
        except BaseException:
            file.unlink(missing_ok=True)
            os.close(descriptor)
            raise
        self.file, self._descriptor = file, descriptor

    def _entries(self, place: int) -> Iterator[tuple[Entry, int]]:
        with _reader(self._descriptor) as stream:
            stream.seek(place)
            for line in stream:
                try:
                    entry = _decode_entry(line)
                except msgspec.MsgspecError as error:
                    self.cut(place, error)
                    return
                yield entry, place
                place += len(line)


def find_abandoned(directory: Path) -> list[Abandoned]:
    """Return the journals that no process has open, the latest first; remove those of saved documents."""
    found: list[Abandoned] = []
    for file in directory.glob(f"*{_SUFFIX}"):
        try:
            descriptor = os.open(file, os.O_RDONLY | os.O_CLOEXEC)
        except OSError:  # another process has just recovered it
            continue
        with os.fdopen(descriptor, "rb") as stream:
            if not _lock(descriptor):
                continue
            try:
                header = _decode_header(stream.readline())
            except msgspec.MsgspecError:
                _logger.warning("%s contains no document", file)
                continue
            saved, is_changed = _last_save(header, stream)
            path = None if saved.path is None else Path(saved.path)
            if path is not None and not is_changed and FileVersion(0, -1, saved.digest).is_current(path):
                file.unlink(missing_ok=True)
                continue
            name = header.name if path is None else path.stem
            found.append(Abandoned(file, path, name, os.fstat(descriptor).st_mtime))
    return sorted(found, key=lambda each: each.changed_at, reverse=True)


def _last_save(header: Header, entries: Iterable[bytes]) -> tuple[Header | Saved, bool]:
    """Return what was saved last, and whether the document may differ from it; nothing is replayed."""
    saved: Header | Saved = header
    away: int | None = 0  # steps since then; None when undoing them does not lead back
    for line in entries:
        try:
            entry = _decode_entry(line)
        except msgspec.MsgspecError:  # the last line may have been cut off
            return saved, True
        match entry:
            case Saved():
                saved, away = entry, 0 if entry.content is None else None
            case Done(merged=merged) if away is not None:
                away = away + (not merged) if away > 0 or (away == 0 and not merged) else None
            case Undone() | Redone() if away is not None:
                away += 1 if isinstance(entry, Redone) else -1
    return saved, away != 0


def _lock(descriptor: int) -> bool:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _reader(descriptor: int) -> BinaryIO:
    """Return a reader of an open file from its beginning; closing it leaves the file open."""
    os.lseek(descriptor, 0, os.SEEK_SET)
    return os.fdopen(descriptor, "rb", closefd=False)


def _end_of_lines(descriptor: int) -> int:
    """Return where the last whole line of a file ends; the size of one without any, which holds a header."""
    with mmap.mmap(descriptor, 0, access=mmap.ACCESS_READ) as content:
        return content.rfind(b"\n") + 1 or len(content)


def _write(descriptor: int, content: bytes) -> None:
    left = memoryview(content)
    while left:
        left = left[os.write(descriptor, left) :]
