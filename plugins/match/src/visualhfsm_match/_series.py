"""Matches in processes of this computer or of a cluster, each as if it were alone."""

from __future__ import annotations

import re
import zlib
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import msgspec

from codegen.files import read_regular
from visualhfsm.plugins import EndedError, NoAnswerError, TaskProcesses
from visualhfsm.trials import Archive, documents_of
from visualhfsm_match._errors import MatchError
from visualhfsm_match._match import Cost, Plan, Result

PREFIX: Final = "visualhfsm-match-"
_TEAM: Final = re.compile(r"\W+")
_LONGEST_NAME: Final = 24
_LARGEST: Final = 2 << 20
"""Bytes of a document."""
_SPARE: Final = 180.0
"""s by which the process of a match may be later than its patience."""
_ATTEMPTS: Final = 3
"""The most attempts at a match for which the computer has no time, or no process."""


@dataclass(frozen=True, slots=True)
class Match:
    """A match to play, with the files of its documents. Implements `Work`."""

    plan: Plan
    number: int
    archive: Archive
    page: bool = False
    """Whether there is to be a page."""
    film: str = ""
    """The file to which its film is written as it grows, if there is one."""
    unsafe: bool = False
    """Whether the code of documents runs without walls."""

    @property
    def patience(self) -> float:
        """How long it may take by the wall, in s."""
        return self.plan.patience + _SPARE

    def with_archive(self, archive: Archive) -> Match:
        """Return the same match with another archive."""
        return replace(self, archive=archive)

    def run(self) -> MatchAnswer:
        """Play it in a process of the thread that calls this."""
        return _of_this_process.run(self)


class Played(msgspec.Struct, frozen=True):
    """What a match came to, with its page."""

    result: Result
    packed: bytes = b""
    cost: Cost = Cost()

    @property
    def page(self) -> str:
        """The page as HTML; empty if there is none."""
        return zlib.decompress(self.packed).decode()


class MatchAnswer(msgspec.Struct, frozen=True):
    """A match that was played, or why nobody can judge it."""

    played: Played | None = None
    refused: str = ""

    def require(self) -> Played:
        """Return the match. Raises MatchError if nobody can judge it."""
        if self.played is None:
            raise MatchError.because("the match cannot be judged: {reason}", reason=self.refused)
        return self.played


class Matches(TaskProcesses[MatchAnswer]):
    """Processes that play matches, one for each thread."""

    def __init__(self) -> None:
        super().__init__(f"{__package__}._process", MatchAnswer, PREFIX)

    def run(self, match: Match) -> MatchAnswer:
        """Play a match in the process of this thread. Raises MatchError when they have been ended."""
        answer = MatchAnswer()
        for _ in range(_ATTEMPTS):
            try:
                answer = self.ask(match, match.patience)
            except EndedError as error:
                raise MatchError.of("the matches have been ended") from error
            except NoAnswerError as error:
                answer = MatchAnswer(refused=str(error))
            if answer.played is not None:
                break
        return answer


_of_this_process = Matches()


def pack(documents: Sequence[Path]) -> tuple[Archive, list[str]]:
    """Pack documents, each with those of its folder that it imports; return their paths in the archive.

    What cannot be read is left out, so that its team loses.
    """
    files = {
        f"{number}/{name}": content
        for number, path in enumerate(documents)
        for name, content in _files(path.parent.resolve() / path.name).items()
    }
    return Archive.of(files.items()), [f"{number}/{path.name}" for number, path in enumerate(documents)]


def team_names(documents: Sequence[Path]) -> list[str]:
    """Return a name for the team of each document: that of its file, with a number where several have it."""
    names: list[str] = []
    for path in documents:
        stem = _TEAM.sub("_", path.stem)[:_LONGEST_NAME] or "team"
        number = sum(name == stem or name.rpartition("_")[0] == stem for name in names)
        names.append(f"{stem}_{number + 1}" if number else stem)
    return names


def _files(document: Path) -> dict[str, bytes]:
    """Return the contents of a document, and of those beside it that it imports."""
    found: frozenset[Path] = frozenset()
    if _content(document) is not None:
        with suppress(ValueError, RecursionError):  # who reads it later says what is wrong
            found = documents_of(document)
    beside = {each for each in found if each.parent == document.parent} | {document}
    contents = {each.name: _content(each) for each in sorted(beside)}
    return {name: content for name, content in contents.items() if content is not None}


def _content(path: Path) -> bytes | None:
    """Return the content of a file that a stranger handed in; None for a link, a pipe, or one too large."""
    try:
        content = read_regular(path, _LARGEST + 1, links=False)
    except OSError:
        return None
    return content if len(content) <= _LARGEST else None
