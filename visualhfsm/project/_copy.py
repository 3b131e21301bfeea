"""A copy of a document with what its run and its tests use: files that change meanwhile change no verdict."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final, Self

from visualhfsm._processes import document_tests as of_tests
from visualhfsm.trials import make_archive, unpack


class Copy:
    """A private copy, made at once, which is deleted at the end of a `with` block.

    `document` is the file there, `home` the original, `top` the folder of the project, and `archive` what
    runs use. Other files of the project are links there, for its tests.
    """

    def __init__(self, file: Path, root: Path) -> None:
        """Raise VisualHfsmError if there are too many files beside the document."""
        self.home: Final = file
        file = file.resolve()
        self.archive: Final = make_archive(file)
        self._folder = TemporaryDirectory(prefix="visualhfsm-verdict-", ignore_cleanup_errors=True)
        here, self._original = Path(self._folder.name).resolve(), of_tests.top_of(file, root)
        above = file.parent.parent  # of which the archive has a folder `interfaces`
        outer = self._original if above.is_relative_to(self._original) else above
        self.top: Final = here / self._original.relative_to(outer)
        self.document: Final = here / above.relative_to(outer) / self.archive.document
        try:
            unpack(self.archive.content, here / above.relative_to(outer))
            for each in _files_of_tests(file, self._original):
                target = self.top / each.relative_to(self._original)
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(each, target)
        except BaseException:
            self._folder.cleanup()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._folder.cleanup()

    def tests(self) -> list[str]:
        """Return the names of the tests, from the top; if there are some, all that they may use is there."""
        names = of_tests.find_tests(of_tests.test_files(self.document, self.top), self.document, self.top)
        if names:
            _link_others(self._original, self.top)
        return names

    def plain(self, text: str) -> str:
        """Return a text with paths from the top, as they are in the project."""
        return text.replace(f"{self.top}/", "")


def _files_of_tests(document: Path, top: Path) -> Iterator[Path]:
    """Yield the tests of a document, the modules beside them, and what configures them, up to the top."""
    places = {file.parent for file in of_tests.test_files(document, top)}
    above = {each for folder in places for each in folder.parents if each.is_relative_to(top)}
    configurations = (
        folder / name for folder in places | above for name in ("conftest.py", *of_tests.CONFIGURATIONS)
    )
    modules = (file for folder in places for file in folder.glob("*.py"))
    yield from (file for file in (*configurations, *modules) if file.is_file())


def _link_others(original: Path, copy: Path) -> None:
    """Make links to what a copy of a folder lacks."""
    for each in original.iterdir():
        there = copy / each.name
        if there.is_dir() and not there.is_symlink():
            _link_others(each, there)
        elif not there.exists() and each.name != "__pycache__":
            there.symlink_to(each)
