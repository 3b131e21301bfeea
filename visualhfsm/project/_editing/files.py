"""Documents on disk: read with limits, written whole or not at all, and watched for other writers."""

from __future__ import annotations

import hashlib
import os
import secrets
import stat
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from codegen.hfsm.formats.xml_tree import MAX_SIZE
from codegen.messages import Message
from codegen.reasons import reason
from visualhfsm._base.errors import EditError
from zenoh_ice.application.directories import flush


@dataclass(frozen=True, slots=True)
class FileVersion:
    """A version of a file: its modification time in ns, its size in bytes, and the SHA-256 of its content."""

    changed_at: int
    size: int
    digest: str

    def is_current(self, path: Path) -> bool:
        """Return whether a file is unchanged; its content is read when only its time differs."""
        try:
            status = path.stat()
            if (status.st_mtime_ns, status.st_size) == (self.changed_at, self.size):
                return True
            return read_file(path)[1].digest == self.digest
        except (OSError, EditError):
            return False


def read_file(path: Path) -> tuple[bytes, FileVersion]:
    """Return the content of a file. Raises EditError when it cannot be read, or is too large."""
    what = Message("Cannot open {file}", file=path.name)
    try:
        if not path.is_file():
            why = Message("it is not a file") if path.exists() else Message("it does not exist")
            raise EditError(what, why, Message("looked for {path}", path=str(path)))
        with path.open("rb") as stream:
            status = os.fstat(stream.fileno())
            content = stream.read(MAX_SIZE + 1)
    except (OSError, ValueError) as error:
        raise EditError(
            what, reason(error), Message("check the permissions of {path}", path=str(path))
        ) from error
    if len(content) > MAX_SIZE:
        why = Message("it is larger than {limit} MiB", limit=MAX_SIZE >> 20)
        raise EditError(what, why, "a document is far smaller")
    return content, FileVersion(status.st_mtime_ns, len(content), hashlib.sha256(content).hexdigest())


def make_folder(folder: Path) -> None:
    """Make the folder of a file that is saved, with those above it, if it is missing. Raises EditError."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        what = Message("Cannot create the folder {parent}", parent=folder.name)
        raise EditError(what, reason(error), "choose another name") from error


def write_file(path: Path, content: bytes) -> FileVersion:
    """Write a file whole or not at all, keeping its permissions and group; a symbolic link stays a link.

    The content is on the disk before the new file replaces the old one. Raises EditError, also for a file
    that may not be written to, though its directory may.
    """
    what = Message("Cannot save {file}", file=path.name)
    hint = Message(
        "nothing was written: check the permissions of {folder} and the space on the disk",
        folder=str(path.parent),
    )
    temporary: Path | None = None
    try:
        target = Path(os.path.realpath(path))
        former = target.stat() if target.exists() else None
        if former is not None and not os.access(target, os.W_OK):
            raise EditError(what, "the file is write-protected", hint)
        temporary = target.with_name(f".{secrets.token_hex(8)}.tmp")
        # Other users may not read it before it has the permissions of the former one.
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC
        descriptor = os.open(temporary, flags, 0o666 if former is None else 0o600)
        with os.fdopen(descriptor, "wb") as stream:
            stream.write(content)
            stream.flush()
            if former is not None:
                with suppress(PermissionError):  # the user may not be in the group
                    os.fchown(descriptor, -1, former.st_gid)
                os.fchmod(descriptor, stat.S_IMODE(former.st_mode))
            os.fsync(descriptor)
            written = os.fstat(descriptor)
        temporary.replace(target)
    except (OSError, ValueError) as error:
        if temporary is not None:
            with suppress(OSError):  # it may not exist; the first failure is reported
                temporary.unlink(missing_ok=True)
        raise EditError(what, reason(error), hint) from error
    with suppress(OSError):  # the file is written; only a power failure could still restore the former one
        flush(target.parent)
    return FileVersion(written.st_mtime_ns, written.st_size, hashlib.sha256(content).hexdigest())
