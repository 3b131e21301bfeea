"""Find the older version of files: in a directory, or in a revision of their git repository."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory

__all__ = ["OlderVersion", "OlderVersionError", "older_version"]

_EXTENSIONS = (".idl", ".ice")
_TIME_LIMIT = 30.0  # s that git may take to answer
_LARGEST = 256 << 20  # bytes of all files of a revision


class OlderVersionError(Exception):
    """There is nothing to compare with; the message says why."""


@dataclass(frozen=True, slots=True)
class OlderVersion:
    """Where the older version of some files can be read."""

    files: list[Path]
    """Those of them that existed, and others of their directories that exist no more."""
    include: list[Path]
    shown: Callable[[Path], Path]
    """Under what name people know one of the files, as `main:interfaces/image.idl`."""


@contextmanager
def older_version(against: str, files: Sequence[Path], include: Sequence[Path]) -> Iterator[OlderVersion]:
    """Provide the older version of files from a directory, or from a git revision without a checkout.

    A directory has the files of the same path below it, or else those of the same name in it.
    Raises OlderVersionError when `against` is neither.
    """
    directory = Path(against)
    if directory.is_dir():

        def older(path: Path) -> Path:
            below = directory if path.is_absolute() else directory / path
            return below if below.is_dir() else directory

        searched = [each for path in include for each in (older(path), path)]
        yield OlderVersion(_older_files(files, older), searched, lambda path: path)
        return
    with TemporaryDirectory(prefix="codegen-") as temporary:
        copy = Path(temporary).resolve()
        root = _copy_of_revision(against, files, copy)

        def moved(path: Path) -> Path:
            whole = path.resolve()
            return copy / whole.relative_to(root) if whole.is_relative_to(root) else path

        def shown(path: Path) -> Path:
            inside = path.resolve()
            if not inside.is_relative_to(copy):
                return path
            return Path(f"{against}:{inside.relative_to(copy).as_posix()}")

        yield OlderVersion(_older_files(files, moved), [moved(path) for path in include], shown)


def _older_files(files: Sequence[Path], older: Callable[[Path], Path]) -> list[Path]:
    """Return the files as they were, and files of the same directories that exist no more.

    `older` gives what a directory was.
    """
    folders: dict[Path, list[Path]] = {}
    for present in dict.fromkeys(path.parent for path in files):
        folders.setdefault(older(present), []).append(present)
    found = [older(path.parent) / path.name for path in files]
    for folder, presents in folders.items():
        names = {path.name for present in presents if present.is_dir() for path in present.iterdir()}
        if folder.is_dir():
            interfaces = (path for path in sorted(folder.iterdir()) if path.suffix.lower() in _EXTENSIONS)
            found += (path for path in interfaces if path.name not in names)
    return [path for path in found if path.is_file()]


def _copy_of_revision(revision: str, files: Sequence[Path], directory: Path) -> Path:
    """Copy the interface files of a revision to a directory; return the root of the repository of `files`."""
    start = files[0].resolve().parent
    if not start.is_dir():
        raise OlderVersionError(f"{start} is no directory")
    root = Path(_git(start, "rev-parse", "--show-toplevel").decode().rstrip("\n")).resolve()
    outside = next((path for path in files if not path.resolve().is_relative_to(root)), None)
    if outside is not None:
        raise OlderVersionError(f"{outside} does not lie in the git repository of {files[0]}")
    try:
        commit = _git(root, "rev-parse", "--verify", "--quiet", "--end-of-options", f"{revision}^{{commit}}")
    except OlderVersionError as error:
        message = f"`{revision}` is neither a directory nor a revision of the repository {root}"
        raise OlderVersionError(message) from error
    objects = _interface_files(root, commit.decode().strip())
    for path, content in _contents(root, objects).items():
        target = directory / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)
    return root


def _interface_files(root: Path, commit: str) -> dict[str, str]:
    """Return the names of a revision's interface files, by the names of their contents."""
    listing = _git(root, "ls-tree", "-r", "-z", "--full-tree", commit)
    found: dict[str, str] = {}
    for entry in listing.split(b"\0"):
        facts, _, name = entry.partition(b"\t")
        path = PurePosixPath(os.fsdecode(name))
        regular = facts.startswith(b"100")
        if (
            regular
            and path.suffix.lower() in _EXTENSIONS
            and ".." not in path.parts
            and not path.is_absolute()
        ):
            found[str(path)] = facts.split()[2].decode()
    return found


def _contents(root: Path, objects: dict[str, str]) -> dict[str, bytes]:
    """Return the contents of files, read in one go."""
    if not objects:
        return {}
    answer = _git(
        root, "cat-file", "--batch", input="".join(f"{each}\n" for each in objects.values()).encode()
    )
    contents: dict[str, bytes] = {}
    position = 0
    for path in objects:
        end = answer.index(b"\n", position)
        size = int(answer[position:end].split()[2])
        contents[path] = answer[end + 1 : end + 1 + size]
        position = end + 1 + size + 1
    return contents


def _git(directory: Path, *arguments: str, input: bytes = b"") -> bytes:
    """Return what git answers; raises OlderVersionError when it refuses, is missing, or takes too long."""
    command = ["git", "-C", str(directory), *arguments]
    try:
        done = subprocess.run(command, input=input, capture_output=True, timeout=_TIME_LIMIT, check=False)
    except FileNotFoundError as error:
        raise OlderVersionError("git is not installed: compare with a directory") from error
    except subprocess.TimeoutExpired as error:
        raise OlderVersionError(f"git took longer than {_TIME_LIMIT:.0f} s") from error
    if done.returncode:
        reason = done.stderr.decode(errors="replace").strip() or f"git {arguments[0]} failed"
        raise OlderVersionError(reason.removeprefix("fatal: "))
    if len(done.stdout) > _LARGEST:
        raise OlderVersionError(f"the interface files of the revision hold more than {_LARGEST >> 20} MiB")
    return done.stdout
