"""Find and read the files of a run."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Sequence
from pathlib import Path

from codegen.diagnostics import Diagnostics, Location

from .codes import Code
from .lexer import Source

EXTENSIONS = (".idl", ".ice")
_LARGEST_FILE = 16 * 2**20


class SourceFiles:
    """Read each file once in a run."""

    def __init__(self, diagnostics: Diagnostics) -> None:
        self._diagnostics = diagnostics
        self._sources: dict[Path, Source | None] = {}
        self._identities: dict[Path, Path] = {}

    def load(self, path: Path, included_at: Location | None = None) -> Source | None:
        """Return the source at `path`, or None after reporting why it cannot be read."""
        identity = self._identities.get(path)
        if identity is None:
            identity = self._identities[path] = path.resolve()
        if identity not in self._sources:
            self._sources[identity] = self._read(path, included_at or Location(path))
        return self._sources[identity]

    def _read(self, path: Path, asked_at: Location) -> Source | None:
        try:
            status = path.stat()
            if not stat.S_ISREG(status.st_mode):
                raise OSError(errno.EINVAL, "not a regular file")
            if status.st_size > _LARGEST_FILE:
                raise OSError(errno.EFBIG, f"{status.st_size} bytes are more than {_LARGEST_FILE}")
            content = path.read_bytes()
        except OSError as error:
            reason = error.strerror or str(error)
            self._diagnostics.error(Code.UNREADABLE_FILE, f"{path} cannot be read: {reason}", asked_at)
            return None
        try:
            text = content.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            line = content.count(b"\n", 0, error.start) + 1
            column = error.start - content.rfind(b"\n", 0, error.start)
            message = "the file is not UTF-8 and is read as Latin-1"
            self._diagnostics.warning(Code.UNKNOWN_ENCODING, message, Location(path, line, column))
            text = content.decode("latin-1")
        text = text.replace("\r\n", "\n")
        if text and not text.endswith("\n"):
            text += "\n"
        self._diagnostics.add_source(path, text)
        return Source(path, text)


class IncludePath:
    """The directories that included files are searched in."""

    def __init__(self, directories: Sequence[Path]) -> None:
        self._directories = tuple(directories)
        self._found: dict[tuple[str, Path, bool], Path | None] = {}

    def find(self, name: str, own: Path, *, own_directory_first: bool) -> Path | None:
        """Return the file that a file in the directory `own` includes by a name.

        A name with the one extension also finds a file with the other.
        """
        key = (name, own, own_directory_first)
        if key not in self._found:
            self._found[key] = self._search(name, own, own_directory_first)
        return self._found[key]

    def described(self, own: Path) -> str:
        """Return the directories that are searched, as messages name them."""
        return ", ".join(str(directory) for directory in (own, *self._directories))

    def _search(self, name: str, own: Path, own_directory_first: bool) -> Path | None:
        if "\0" in name:
            return None
        directories = list(self._directories)
        directories.insert(0 if own_directory_first else len(directories), own)
        stem, extension = os.path.splitext(name)  # noqa: PTH122 - `name` may hold what Path would normalize
        others = [stem + other for other in EXTENSIONS if other != extension and extension in EXTENSIONS]
        for candidate in (name, *others):
            for directory in directories:
                path = Path(os.path.normpath(directory / candidate))
                if path.is_file():
                    return path
        return None
