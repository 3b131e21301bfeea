"""The folder of a project: what is in it, and what checks and reads the code of its documents."""

from __future__ import annotations

import stat
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

from codegen.hfsm.formats.others import imported_suffixes
from visualhfsm._base.errors import MissingError
from visualhfsm._processes.bodies import FOLDER
from visualhfsm.project._check_process import CheckProcess
from visualhfsm.project._code_help.service import CodeHelp
from visualhfsm.project._editing.shelf import ReadyState, Shelves

from ._root import (
    BODY_SUFFIX,
    DOCUMENT_SUFFIX,
    MODEL_SUFFIXES,
    RECORDING_SUFFIX,
    Root,
    looks_like_model,
)

if TYPE_CHECKING:
    from ._verdict import Judge

_MOST_ENTRIES: Final = 2000  # of a directory
_MOST_DIRECTORIES: Final = 200  # below it, whose entries are listed with its own


@dataclass(frozen=True, slots=True)
class Entry:
    """A directory, or a document, recording or robot in it; size in bytes, `changed_at` in s since 1970."""

    path: Path
    kind: Literal["directory", "document", "recording", "model"]
    size: int
    changed_at: float


class ProjectFolder:
    """The part of `Project` that knows no open document, which all of them share."""

    def __init__(
        self,
        root: Root,
        include: Iterable[str | Path],
        checks: CheckProcess | None,
        code_help: CodeHelp | None,
    ) -> None:
        self.root: Final = root
        self.include: Final[Sequence[Path]] = tuple(Path(each).resolve() for each in include)
        folder = root.directory
        self.checks: Final = checks or CheckProcess(folder=folder)
        self.code_help: Final = code_help or CodeHelp(include=self.include, folder=folder)
        self._shelves = Shelves(folder)

    def end_processes(self) -> None:
        """End the processes that check and read code; questions that wait for them fail."""
        self.checks.close()
        self.code_help.close()
        if "judge" in vars(self):
            self.judge.close()

    @cached_property
    def judge(self) -> Judge:
        """What verdicts are made by, with its processes."""
        from ._verdict import Judge  # only who judges waits for trials

        return Judge(self.include)

    # -- files ---------------------------------------------------------------------------------------------

    def entries(self, directory: str | Path = "", *, depth: int = 0) -> list[Entry]:
        """Return the directories, documents, recordings and models in a directory, without hidden ones.

        With a `depth` those files follow that are in directories so far below it, the nearest first. Links
        to directories, and those of packages, are left out there.
        """
        place = self.root.directory_of(str(directory))
        with MissingError.in_place_of(OSError, "{place} cannot be listed: {reason}", place=place.name):
            shown = level = self._entries_in(place)
        left = _MOST_DIRECTORIES
        for _ in range(depth):
            below = [each.path for each in level if each.kind == "directory" and _leads_on(each.path)][:left]
            left -= len(below)
            level = []
            for folder in below:
                if len(level) < _MOST_ENTRIES:
                    with suppress(OSError):  # closed, or deleted just now
                        level += self._entries_in(folder)
            shown = [*shown, *(each for each in level if each.kind != "directory")]
        return shown[:_MOST_ENTRIES]

    def _entries_in(self, directory: Path) -> list[Entry]:
        found = [each for path in directory.iterdir() if (each := self._entry(path)) is not None]
        return sorted(found, key=lambda each: (each.kind != "directory", each.path.name))

    def _entry(self, path: Path) -> Entry | None:
        if path.name.startswith(".") or not self.root.contains(path):
            return None
        try:
            status = path.stat()
        except OSError:  # a broken link, or a file that was deleted just now
            return None
        if stat.S_ISDIR(status.st_mode):
            return Entry(path, "directory", status.st_size, status.st_mtime)
        suffix = path.suffix.lower()
        kind = "document" if suffix in imported_suffixes() else _KINDS.get(suffix)
        if not stat.S_ISREG(status.st_mode) or kind is None:
            return None
        if suffix == BODY_SUFFIX and path.parent != self.root.directory / FOLDER:
            return None
        if suffix == DOCUMENT_SUFFIX and looks_like_model(path):
            kind = "model"
        return Entry(path, kind, status.st_size, status.st_mtime)

    def file(self, path: str | Path) -> Path:
        """Return the path of a document below the root."""
        return self.root.document(str(path))

    # -- the shelf -----------------------------------------------------------------------------------------

    def shelf(self) -> list[ReadyState]:
        """Return the ready states that can be drawn: ours, then those of the folder `shelf`."""
        return self._shelves.states()

    def ready_state(self, id: str) -> tuple[str, str]:
        """Return the title and the text of the document of a ready state."""
        return self._shelves.content(id)


def _leads_on(directory: Path) -> bool:
    """Return whether the files of a directory may be listed with those of one above it."""
    is_of_packages = directory.name in {"node_modules", "__pycache__"} or (directory / "pyvenv.cfg").exists()
    return not is_of_packages and not directory.is_symlink()


_KINDS: Final[dict[str, Literal["document", "recording", "model"]]] = {
    DOCUMENT_SUFFIX: "document",
    RECORDING_SUFFIX: "recording",
    BODY_SUFFIX: "model",
    **dict.fromkeys(MODEL_SUFFIXES, "model"),
}
