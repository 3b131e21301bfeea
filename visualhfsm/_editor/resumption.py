"""Readmit a page that the editor had served before a restart.

While it is connected, the page gets a key, which it never sends. After a restart of the editor with the same
root on the same port, both sides prove to each other that they have it: first the server, since in the
meantime anybody else on this machine may have listened on the port. The page then gets a new cookie.

The key of a root and port is kept in a file that only its owner can read, as the journals are. A port that
the system picked is another one after a restart: its key is not kept.
"""

from __future__ import annotations

import hashlib
import hmac
import logging
import os
import secrets
import stat
from collections import deque
from pathlib import Path
from typing import Final

_KEY_BYTES: Final = 32
_CHALLENGES: Final = 64
_LONGEST_NONCE: Final = 128  # characters of the nonce of a page

_logger = logging.getLogger(__name__)


class Resumption:
    """The server's side; `key` is what the pages get. Used on one event loop."""

    def __init__(self, key: bytes) -> None:
        self.key = key
        self._challenges: deque[str] = deque(maxlen=_CHALLENGES)

    def prove(self, nonce: str) -> dict[str, str]:
        """Return the proof for a page's nonce, and the challenge that the page has to answer."""
        challenge = secrets.token_hex(_KEY_BYTES)
        self._challenges.append(challenge)
        return {"challenge": challenge, "proof": self._signed("server", nonce[:_LONGEST_NONCE], challenge)}

    def accepts(self, challenge: str, proof: str) -> bool:
        """Whether a page has answered a challenge, which is used up by that."""
        if challenge not in self._challenges:
            return False
        self._challenges.remove(challenge)
        return hmac.compare_digest(proof.encode(), self._signed("page", challenge).encode())

    def _signed(self, *parts: str) -> str:
        return hmac.new(self.key, ":".join(parts).encode(), hashlib.sha256).hexdigest()


def kept_key(directory: Path, root: Path, port: int) -> bytes:
    """Return the key of a root and port; the first call creates it and keeps it in a directory.

    A key that cannot be kept, or that others could have read, is not used: then pages have to be opened again
    after a restart, which is logged.
    """
    name = hashlib.sha256(f"{root.resolve()}\0{port}".encode()).hexdigest()[:32]
    file = directory / f"{name}.key"
    key = secrets.token_bytes(_KEY_BYTES)
    try:
        directory.mkdir(parents=True, exist_ok=True, mode=0o700)
        try:
            descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
        except FileExistsError:
            return _read(file)
        with os.fdopen(descriptor, "wb") as stream:
            stream.write(key)
    except OSError as error:
        _logger.warning(
            "%s cannot be used (%s): open the page again after a restart of the editor",
            file,
            error.strerror or error,
        )
    return key


def _read(file: Path) -> bytes:
    """Return the key in a file. Raises OSError when it is not ours alone, or not whole."""
    with os.fdopen(os.open(file, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as stream:
        status = os.fstat(stream.fileno())
        if not stat.S_ISREG(status.st_mode) or status.st_uid != os.getuid() or status.st_mode & 0o077:
            raise PermissionError("others may have read it: delete it")
        key = stream.read(_KEY_BYTES + 1)
    if len(key) != _KEY_BYTES:
        raise OSError("it holds no key: delete it")
    return key
