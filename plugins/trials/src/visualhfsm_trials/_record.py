"""The file that keeps what trials came to.

It is written while trials run, so that whatever ends them costs nothing. Its first line says what the trials
are of, each other line is an outcome, in the order in which they ended, or says how many were asked for from
there on. A line that was cut off by a crash is removed when the file is opened again.
"""

from __future__ import annotations

import fcntl
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, Final, Self, TypeVar

import msgspec

from codegen.messages import Message
from codegen.reasons import reason
from visualhfsm.trials import Outcome, TrialsError
from zenoh_ice.data import typed

SUFFIX: Final = ".outcomes.jsonl"
_LONGEST_HEADER: Final = 10_000  # bytes
_Line = TypeVar("_Line", "Outcome", "Look")
_LOOK: Final = b'{"runs":'
"""The first bytes of a line that has a `Look`."""


class Header(msgspec.Struct, frozen=True):
    """What outcomes are of; those of equal headers belong together."""

    document: str
    """Name of the document."""
    digest: str
    """Of the plan, with its seed but not the number of its runs, and of the files beside the document."""
    versions: dict[str, str]
    """Of what computes the outcomes."""
    first: int = 0
    """The number of the first trial: trials once counted from 0."""


class Look(msgspec.Struct, frozen=True):
    """That somebody asked for the first so many trials, and looks at what they say."""

    runs: int


class Record:
    """An open file of outcomes, for one process at a time."""

    def __init__(self, path: Path, header: Header, *, again: bool = False) -> None:
        """Open a file to go on with it, or `again` from the start.

        Raises TrialsError if it has outcomes of something else, or cannot be written.
        """
        self.path: Final = path
        self.done: Final[set[int]] = set()
        """The numbers of the trials whose outcomes are there."""
        with TrialsError.in_place_of(
            OSError, "{path}: outcomes cannot be kept there: {reason}", path=str(path)
        ):
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("a+b", buffering=0)
        try:
            self._begin(header, again=again)
        except BaseException:
            self._file.close()
            raise

    def _begin(self, header: Header, *, again: bool) -> None:
        with TrialsError.in_place_of(
            OSError, "{path}: another process writes outcomes to it now", path=str(self.path)
        ):
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        found = None if again else read_header(self.path)
        if found is not None and found != header:
            if next(read_outcomes(self.path), None) is not None:
                raise TrialsError.because(
                    "{path} has outcomes of another plan, document or version: --again replaces them, "
                    "and --out writes elsewhere",
                    path=str(self.path),
                )
            found = None  # no trial has ended: there is nothing to lose
        if found is None:
            self._file.truncate(0)
            self._write(header, "what they are of")
            return
        self.done.update(outcome.number for outcome in read_outcomes(self.path))
        self._file.truncate(self.path.read_bytes().rfind(b"\n") + 1)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def look(self, runs: int) -> None:
        """Note that somebody asks for the first so many trials. Raises TrialsError."""
        if runs not in read_looks(self.path):
            self._write(Look(runs), "how many trials are asked for")

    def add(self, outcome: Outcome) -> None:
        """Keep an outcome. Raises TrialsError when it cannot be written; earlier ones stay."""
        self._write(outcome, f"outcome {outcome.number}")
        self.done.add(outcome.number)

    def _write(self, what: Header | Look | Outcome, name: str) -> None:
        line = msgspec.json.encode(what) + b"\n"
        try:
            if self._file.write(line) == len(line):
                return
            why = Message("the disk is full")
        except OSError as error:
            why = reason(error)
        raise TrialsError.because(
            "{path}: {name} cannot be kept: {why}; the same command goes on with what is there",
            path=str(self.path),
            name=name,
            why=why,
        )


def read_header(path: Path) -> Header | None:
    """Return what the outcomes of a file are of, None for an empty file. Raises TrialsError."""
    with _reading(path) as file:
        line = file.readline(_LONGEST_HEADER)
    if not line.endswith(b"\n"):
        return None
    with TrialsError.in_place_of(
        msgspec.MsgspecError, "{path} is no file of outcomes: {reason}", path=str(path)
    ):
        return typed.from_json(line, Header)


def read_outcomes(path: Path) -> Iterator[Outcome]:
    """Yield the outcomes of a file, as they ended. Raises TrialsError."""
    with _reading(path) as file:
        file.readline()
        for number, line in enumerate(file, 2):
            if not line.endswith(b"\n"):
                return  # a crash cut it off
            if not line.startswith(_LOOK):
                yield _decoded(line, Outcome, path, number)


def read_looks(path: Path) -> tuple[int, ...]:
    """Return how many trials of a file were asked for, one time after the other. Raises TrialsError.

    If there are several, somebody looked at what fewer or more had come to before. One that no trial followed
    showed nothing, and does not count.
    """
    looks: list[int] = []
    seen = True
    with _reading(path) as file:
        file.readline()
        for number, line in enumerate(file, 2):
            if not line.startswith(_LOOK):
                seen = True
            elif line.endswith(b"\n"):
                if not seen:
                    looks.pop()
                seen = False
                looks.append(_decoded(line, Look, path, number).runs)
    return tuple(dict.fromkeys(looks))


def _decoded(line: bytes, kind: type[_Line], path: Path, number: int) -> _Line:
    """Return what a line of a file has. Raises TrialsError."""
    with TrialsError.in_place_of(
        msgspec.MsgspecError,
        "{path}:{number}: no outcome of a trial: {reason}",
        path=str(path),
        number=number,
    ):
        return typed.from_json(line, kind)


def _reading(path: Path) -> BinaryIO:
    with TrialsError.in_place_of(OSError, "{path}: cannot be read: {reason}", path=str(path)):
        return path.open("rb")
