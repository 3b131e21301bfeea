"""A person's leave for one run: the agent asks in a file that the page shows, which answers in another.

No tool of the agent writes such files: it writes documents alone.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Final, Literal, TypeVar

import msgspec

from zenoh_ice.data import typed

from ._limits import AgentError
from ._lock import lock

FOLDER: Final = ".visualhfsm-agent"
_T = TypeVar("_T")
_VALID: Final = 300.0
"""Seconds for which leave lasts, and a question is shown."""


def folder_in(root: Path) -> Path:
    """Return our folder in a project. Raises AgentError if it leads elsewhere."""
    folder = root / FOLDER
    if folder.is_symlink():
        raise AgentError.because("{folder} is a link: delete it", folder=FOLDER)
    return folder


class Asked(msgspec.Struct, frozen=True):
    """What an agent asks for: a document by its digest and its path, and the longest run in s."""

    digest: str
    path: str
    seconds: float
    at: float
    """In s since 1970."""


class Answered(msgspec.Struct, frozen=True):
    """What a person said of what was asked at a time."""

    digest: str
    at: float
    verdict: Literal["allowed", "refused"]


class Approvals:
    """The files of a project."""

    def __init__(self, root: Path) -> None:
        self._asked = folder_in(root) / "asked.json"
        self._answered = folder_in(root) / "answered.json"
        self._lock = folder_in(root) / "approvals.lock"

    def require(self, digest: str, path: str, seconds: float) -> None:
        """Return once for each leave of a person, to one agent of several.

        Raises AgentError while there is none, and asks for it.
        """
        with lock(self._lock):
            self._require(digest, path, seconds)

    def _require(self, digest: str, path: str, seconds: float) -> None:
        asked = self._newest()
        answered = self._answer_to(asked)
        if asked and answered and digest == asked.digest:
            self._asked.unlink(missing_ok=True)
            self._answered.unlink(missing_ok=True)
            if answered.verdict == "allowed":
                return
            raise AgentError.because("a person has refused this run")
        if asked is None or asked.digest != digest:
            _write(self._asked, Asked(digest, path, seconds, time.time()))
        raise AgentError.because(
            "a person must allow this run in the page of the editor: ask again after that"
        )

    def asked(self) -> Asked | None:
        """Return what is asked for now and nobody has answered."""
        found = self._newest()
        return None if self._answer_to(found) else found

    def answer(self, asked: Asked, verdict: Literal["allowed", "refused"]) -> None:
        """Answer what was asked."""
        _write(self._answered, Answered(asked.digest, asked.at, verdict))

    def _newest(self) -> Asked | None:
        found = _read(self._asked, Asked)
        return found if found and abs(time.time() - found.at) < _VALID else None

    def _answer_to(self, asked: Asked | None) -> Answered | None:
        found = _read(self._answered, Answered)
        same = asked and found and (found.digest, found.at) == (asked.digest, asked.at)
        return found if same else None


def _write(file: Path, content: Asked | Answered) -> None:
    part = file.with_suffix(".part")
    part.write_bytes(msgspec.json.encode(content))
    part.replace(file)


def _read(file: Path, kind: type[_T]) -> _T | None:
    try:
        return typed.from_json(file.read_bytes(), kind)
    except (OSError, msgspec.MsgspecError):
        return None
