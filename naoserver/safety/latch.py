"""The file in which a robot server keeps its emergency stop and lease, for the next server of the robot.

A stop lasts until a person resets it (ISO 13850:2015, 4.1.4), whatever process ends in between. A server that
was killed, or whose machine lost its power, could not say how it left the robot: the next one starts stopped.
A simulated robot of another body is another robot: the stop of the one before waits for that one. The stop of
a real robot holds for any.
"""

from __future__ import annotations

import fcntl
import hashlib
import logging
import os
import time
from contextlib import nullcontext
from pathlib import Path
from typing import Final, Self

import msgspec

from naoserver.errors import RobotError
from zenoh_ice.application.directories import flush
from zenoh_ice.application.kept_stop import UNREADABLE, Kept, KeptLease, kept_directory, read_kept
from zenoh_ice.settings import Settings

_logger = logging.getLogger(__name__)

_UNCLEAN: Final = "its server ended without warning"
_MACHINE: Final = Path("/etc/machine-id")  # machine-id(5): it stays the same when the machine is renamed
_PATIENCE: Final = 3.0
"""Seconds to wait for the end of the former server."""
_LOOK_PERIOD: Final = 0.05  # s


class Latch:
    """Keep an emergency stop and a lease in a file, in a `with` block for as long as the server runs.

    `body` is that of a simulated robot; empty for a real one. The block raises RobotError at its beginning
    where nothing can be kept, or where another server keeps it.
    """

    def __init__(self, path: Path, patience: float = _PATIENCE, *, body: str = "") -> None:
        self.path: Final = path
        self._patience: Final = patience
        self._body: Final = body
        self._lock: int | None = None
        self.found: Kept = Kept()
        """What the former server left, as this one has to begin."""
        self._newest = Kept()

    def __enter__(self) -> Self:
        try:
            folder = self.path.parent
            folder.mkdir(parents=True, exist_ok=True)
            if folder.stat().st_uid == os.geteuid():
                folder.chmod(0o700)  # its files say who holds a robot
            self._lock = self._locked()
            self.found = self._newest = self._read()
            self._write(running=True)
            # From now on a loss of power, too, leaves a file that stops the next server: this one or a newer.
            for path in (self.path, folder):
                flush(path)
        except OSError as error:
            self.release()
            raise RobotError(
                f"the emergency stop cannot be kept in {self.path}: {error.strerror}; "
                "set XDG_STATE_HOME to a folder that can be written"
            ) from error
        return self

    def __exit__(self, *_: object) -> None:
        try:
            if not (self._newest.stop or self._newest.lease or self._newest.aside):
                self.path.unlink(missing_ok=True)
            else:
                self._write(running=False)
        except OSError:  # then the next server starts stopped
            _logger.exception("the emergency stop could not be kept in %s", self.path)
        finally:
            self.release()

    def release(self) -> None:
        """Let another server have the file, as the system does at the end of a process."""
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def keep(self, stop: str, lease: KeptLease | None) -> None:
        """Keep a stop and a lease in place of those before. Raises OSError."""
        body = self._newest.body if stop and self._newest.stop else self._body  # the same stop goes on
        self._newest = msgspec.structs.replace(self._newest, stop=stop, lease=lease, body=body)
        self._write(running=True)

    def _locked(self) -> int:
        """Wait until no other server has the file, and return the descriptor that keeps it so.

        It lies beside the file, as each change makes another one. Raises OSError, RobotError at the limit.
        """
        flags = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK
        lock = os.open(self.path.with_suffix(".lock"), flags, 0o600)
        deadline = time.monotonic() + self._patience
        try:
            while True:
                try:
                    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                except BlockingIOError:
                    if time.monotonic() >= deadline:
                        raise RobotError(
                            f"another server of the same robot runs, and has {self.path}:"
                            " end that one, or give this one another --realm"
                        ) from None
                    time.sleep(_LOOK_PERIOD)
                else:
                    return lock
        except BaseException:
            os.close(lock)
            raise

    def _read(self) -> Kept:
        try:
            kept = read_kept(self.path)
        except FileNotFoundError:
            return Kept()
        except (OSError, msgspec.MsgspecError) as error:
            _logger.warning("%s: %s", self.path, error)
            return Kept(stop=UNREADABLE)
        stop = kept.stop
        if kept.running and _UNCLEAN not in stop:
            stop = f"{stop} (then {_UNCLEAN})" if stop else _UNCLEAN
        return self._as_of_body(msgspec.structs.replace(kept, stop=stop))

    def _as_of_body(self, kept: Kept) -> Kept:
        """Return what is kept for the robot of this server, of what the former server has left."""
        aside = dict(kept.aside)
        if self._body and kept.body not in ("", self._body):
            aside |= {kept.body: kept.stop} if kept.stop else {}
            kept = Kept()
        own = aside.pop(self._body, "")
        body = kept.body if self._body and kept.stop else self._body
        return Kept(stop=kept.stop or own, lease=kept.lease, body=body, aside=aside)

    def _write(self, *, running: bool) -> None:
        content = msgspec.json.encode(msgspec.structs.replace(self._newest, running=running))
        beside = self.path.with_suffix(".new")
        beside.unlink(missing_ok=True)  # whatever it is: to open a pipe, say, would last for ever
        descriptor = os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
        beside.replace(self.path)


def latch_of(settings: Settings, machine: Path = _MACHINE, *, body: str = "") -> Latch | nullcontext[None]:
    """Return the latch of the robot that a server with these settings serves, if simulated with its `body`.

    It is a file in the user's directory of states, named after the realm, the endpoints and the machine: a
    server that is started again in the same way finds it. There is none for a server that nobody finds again,
    because it listens on nothing but a port that the system picks. Raises RobotError when the user has no
    directory.
    """
    endpoints = [each for each in settings.listen if not each.endswith(":0")] or list(settings.connect)
    if not endpoints:
        return nullcontext()
    try:
        folder = kept_directory()
    except OSError as error:
        raise RobotError(f"the emergency stop cannot be kept: {error}") from error
    # Machines may share the directory; those without an identity, such as containers, share the file, too.
    try:
        identity = machine.read_text("ascii").strip()
    except (OSError, ValueError):
        identity = ""
    place = " ".join((identity, *sorted(endpoints)))
    digest = hashlib.sha256(place.encode()).hexdigest()[:12]
    return Latch(folder / f"{settings.realm}-{digest}.json", body=body)
