"""Read files, and write all files of one run or none of them, or show how the files on disk differ."""

from __future__ import annotations

import difflib
import errno
import os
import stat
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class GeneratedFile:
    """The wanted content of a file: UTF-8, lines end with a newline."""

    path: Path
    text: str


@dataclass(frozen=True, slots=True)
class Changes:
    """The differences from the disk: new or changed files to write, and leftovers to remove."""

    write: tuple[GeneratedFile, ...]
    remove: tuple[Path, ...]

    def __bool__(self) -> bool:
        """Return whether anything differs."""
        return bool(self.write or self.remove)


class FilesNotWrittenError(Exception):
    """A file could not be written or removed; the disk is as it was before."""


def read_regular(path: Path, limit: int = -1, *, links: bool = True) -> bytes:
    """Return the content of a file, at most `limit` bytes; without `links`, the file itself is none.

    Raises OSError, also for what is no regular file: a pipe would wait for its writer.
    """
    how = os.O_NONBLOCK | (0 if links else os.O_NOFOLLOW)
    with open(path, "rb", opener=lambda name, flags: os.open(name, flags | how)) as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise OSError(errno.EINVAL, "not a regular file", str(path))
        return file.read(limit)


def is_regular(path: Path) -> bool:
    """Return whether a path is that of a regular file; one that cannot be reached is none."""
    try:
        return path.is_file()
    except OSError:
        return False


def compare_with_disk(files: Iterable[GeneratedFile], leftovers: Iterable[Path] = ()) -> Changes:
    """Return the changes that the disk needs, in the order of paths.

    Raises FilesNotWrittenError if two files have the same path and different texts.
    """
    wanted: dict[Path, GeneratedFile] = {}
    for file in files:
        if wanted.setdefault(Path(os.path.realpath(file.path)), file).text != file.text:
            raise FilesNotWrittenError(f"{file.path} would be generated from two sources")
    write = [file for file in wanted.values() if _read(file.path) != file.text.encode()]
    return Changes(
        write=tuple(sorted(write, key=lambda file: file.path)),
        remove=tuple(sorted(path for path in leftovers if path.exists())),
    )


def diff(changes: Changes) -> str:
    """Return the changes as a unified diff from the files on disk to the generated ones."""
    wanted = [(file.path, file.text) for file in changes.write] + [(path, None) for path in changes.remove]
    parts: list[str] = []
    for path, text in sorted(wanted, key=lambda item: item[0]):
        old = _read(path)
        names = ("/dev/null" if old is None else str(path), "/dev/null" if text is None else str(path))
        lines = list(
            difflib.unified_diff(
                (old or b"").decode(errors="replace").splitlines(keepends=True),
                (text or "").splitlines(keepends=True),
                *names,
            )
        )
        # An empty file that is added or removed has no line to show.
        parts += lines or [f"--- {names[0]}\n", f"+++ {names[1]}\n"]
    return "".join(
        part if part.endswith("\n") else f"{part}\n\\ No newline at end of file\n" for part in parts
    )


def apply(changes: Changes) -> None:
    """Apply the changes; after a failure the disk is as it was before.

    Every file is first written to a temporary file in its directory, so that a full disk or a missing
    permission is noticed before anything has changed. Then it is renamed. Raises FilesNotWrittenError.
    """
    staged: list[tuple[Path, Path]] = []
    undo: list[tuple[Path, bytes | None]] = []
    created: list[Path] = []
    path = Path()
    try:
        for file in changes.write:
            path = file.path
            created += _make_directories(path.parent)
            staged.append((_stage(path, file.text.encode()), path.resolve()))
        for temporary, path in staged:
            undo.append((path, _read(path)))
            temporary.replace(path)
        for path in changes.remove:
            undo.append((path, _read(path)))
            path.unlink()
    except BaseException as error:
        _roll_back(undo, [temporary for temporary, _ in staged], created)
        if isinstance(error, OSError):
            reason = error.strerror or str(error)
            raise FilesNotWrittenError(f"{path}: cannot be written: {reason}; nothing was changed") from error
        raise
    for path in changes.remove:
        with suppress(OSError):  # a directory is removed with its last leftover
            path.parent.rmdir()


def _read(path: Path) -> bytes | None:
    try:
        return read_regular(path)
    except FileNotFoundError:
        return None


def _make_directories(directory: Path) -> list[Path]:
    missing = [parent for parent in (directory, *directory.parents) if not parent.exists()]
    directory.mkdir(parents=True, exist_ok=True)
    return missing


def _stage(path: Path, content: bytes) -> Path:
    """Write `content` to a new file next to `path`, with the permissions that `path` has or will have."""
    target = path.resolve()
    temporary = target.with_name(f".{target.name}.{os.getpid()}.tmp")
    with temporary.open("xb") as stream:
        try:
            stream.write(content)
            if target.exists():
                temporary.chmod(target.stat().st_mode & 0o7777)
        except BaseException:
            temporary.unlink()
            raise
    return temporary


def _roll_back(undo: list[tuple[Path, bytes | None]], staged: list[Path], created: list[Path]) -> None:
    for path, old in reversed(undo):
        with suppress(OSError):  # a failure to restore must not hide the first failure
            if old is None:
                path.unlink(missing_ok=True)
            elif _read(path) != old:
                path.write_bytes(old)
    for temporary in staged:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
    for directory in sorted(created, reverse=True):
        with suppress(OSError):
            directory.rmdir()
