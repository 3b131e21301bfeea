"""Keep what was made of models and meshes, in the user's cache: their robot starts quickly the next time.

A file's name is a hash of what it was made of, and by what; its beginning is a hash of what follows. One that
is damaged is made again, and what is in one is checked like what a user writes.
"""

from __future__ import annotations

import hashlib
import os
import stat
import tempfile
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import Final, TypeVar

Kept = TypeVar("Kept")

MOST_KEPT: Final = 500 << 20
"""Most bytes of all files; those that were used longest ago go first."""
_LARGEST: Final = 64 << 20
"""Most bytes of a file: those of a mesh of 200,000 triangles are a sixth."""
_DIGEST: Final = hashlib.sha256().digest_size


def kept(of: Iterable[bytes], make: Callable[[], bytes], read: Callable[[bytes], Kept]) -> Kept:
    """Return what `read` finds in the result of `make`, or of an earlier one for the same bytes.

    `read` raises ValueError for what `make` does not return. What `make` raises is raised; a cache that
    cannot be used is left alone.
    """
    name = hashlib.sha256(b"".join(hashlib.sha256(each).digest() for each in of)).hexdigest()
    try:
        path = _folder() / name
    except (OSError, RuntimeError):  # nowhere to keep it, or nobody's home
        return read(make())
    with suppress(OSError, ValueError):
        found = read(_content(path))
        with suppress(OSError):  # of a cache that can only be read
            os.utime(path)
        return found
    content = make()
    with suppress(OSError):
        _write(path, content)
        _remove_oldest(path.parent)
    return read(content)


def _folder() -> Path:
    """Return the folder, which nobody else may write to. Raises OSError, or RuntimeError without a home."""
    cache = os.environ.get("XDG_CACHE_HOME", "")  # a relative path is to be ignored
    folder = (Path(cache) if cache.startswith("/") else Path.home() / ".cache") / "visualhfsm" / "models"
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    about = folder.lstat()
    if not stat.S_ISDIR(about.st_mode) or about.st_uid != os.geteuid() or about.st_mode & 0o022:
        raise PermissionError(f"{folder} is not ours alone")
    return folder


def _content(path: Path) -> bytes:
    """Return what was written to a file. Raises OSError, and ValueError if it is not as it was written."""
    about = path.lstat()
    if not stat.S_ISREG(about.st_mode) or about.st_size > _LARGEST:
        raise ValueError(f"{path} is no file of ours")
    written = path.read_bytes()
    content = written[_DIGEST:]
    if hashlib.sha256(content).digest() != written[:_DIGEST]:
        raise ValueError(f"{path} is damaged")
    return content


def _write(path: Path, content: bytes) -> None:
    """Write a file in one step, readable by this user alone. Raises OSError."""
    with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as file:
        try:
            file.write(hashlib.sha256(content).digest() + content)
            file.flush()
            Path(file.name).replace(path)
        except OSError:
            Path(file.name).unlink()
            raise


def _remove_oldest(folder: Path) -> None:
    """Leave at most so many bytes as may be kept. Raises OSError."""
    used = 0
    files = [(path.lstat(), path) for path in folder.iterdir() if not path.is_dir()]
    for about, path in sorted(files, key=lambda file: file[0].st_mtime, reverse=True):
        used += about.st_size
        if used > MOST_KEPT:
            path.unlink(missing_ok=True)  # another server may have removed it
