"""The folder of a project, outside of which it reaches no file."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final

from codegen.files import is_regular, read_regular
from codegen.hfsm.formats.others import imported_suffixes
from codegen.hfsm.formats.reader import looks_like_document
from visualhfsm._base.errors import ForbiddenPathError, MissingError

DOCUMENT_SUFFIX: Final = ".xml"
RECORDING_SUFFIX: Final = ".mcap"
BODY_SUFFIX: Final = ".toml"
MODEL_SUFFIXES: Final = (".urdf", ".xacro")
"""The suffixes of models of robots, besides MJCF, whose suffix is that of documents."""
_ROOT_OF_MODEL: Final = re.compile(rb"<(mujoco|robot)\b")
_HEAD: Final = 4096
"""Bytes in which the root of a model is looked for."""

_LONGEST_PATH: Final = 4096  # characters, as Linux has it
_LONGEST_NAME: Final = 255  # bytes of a file or folder


class Root:
    """The directory to which opening, saving and listing are confined.

    Symbolic links are resolved before a path is checked. `granted` are files that the operator named at the
    terminal; they may be elsewhere.
    """

    def __init__(self, directory: Path, granted: Iterable[Path] = ()) -> None:
        # It may not exist, or be a loop of links.
        with MissingError.in_place_of(
            (OSError, RuntimeError), "there is no folder {directory}", directory=str(directory)
        ):
            self.directory = directory.resolve(strict=True)
        if not self.directory.is_dir():
            raise MissingError.because("{directory} is not a folder", directory=str(directory))
        self._granted = frozenset(path.resolve() for path in granted)

    def resolve(self, text: str) -> Path:
        """Return the path for a text from a user, absolute and without symbolic links.

        Raises ForbiddenPathError.
        """
        names = text.encode(errors="replace").split(b"/")
        if not text or len(text) > _LONGEST_PATH or "\0" in text or len(max(names, key=len)) > _LONGEST_NAME:
            raise ForbiddenPathError.because("the path is empty, too long, or contains a zero byte")
        # It may be a loop of links, or contain half a character.
        with ForbiddenPathError.in_place_of(
            (OSError, RuntimeError, UnicodeError), "invalid path {text!a}", text=text[:100]
        ):
            path = (self.directory / text).resolve()
            with suppress(FileNotFoundError, NotADirectoryError):
                path.stat()
        if not self.contains(path):
            raise ForbiddenPathError.because(
                "{text} is outside {directory}; to reach it, open a folder that contains it: "
                "`Project(DIR)`, or `visualhfsm edit --root DIR`",
                text=text,
                directory=str(self.directory),
            )
        return path

    def contains(self, path: Path) -> bool:
        """Whether users may reach a path, with symbolic links followed."""
        path = path.resolve()
        return path.is_relative_to(self.directory) or path in self._granted

    def document(self, text: str) -> Path:
        """Return the path of a document, which ends in `.xml`; raises ForbiddenPathError."""
        return self._file(text, DOCUMENT_SUFFIX)

    def source(self, text: str) -> Path:
        """Return the path of a file to open, of any format; raises ForbiddenPathError."""
        return self._file(text, DOCUMENT_SUFFIX, *imported_suffixes())

    def recording(self, text: str) -> Path:
        """Return the path of a recording, which ends in `.mcap`; raises ForbiddenPathError."""
        return self._file(text, RECORDING_SUFFIX)

    def model(self, text: str) -> Path:
        """Return the path of a model of a robot, or of the file of a body; raises ForbiddenPathError."""
        return self._file(text, *MODEL_SUFFIXES, DOCUMENT_SUFFIX, BODY_SUFFIX)

    def _file(self, text: str, *suffixes: str) -> Path:
        path = self.resolve(text)
        if path.suffix.lower() not in suffixes:
            raise ForbiddenPathError.because(
                "{text}: the name of the file must end in {suffixes}",
                text=text,
                suffixes=" or ".join(suffixes),
            )
        if path.exists() and not path.is_file():  # reading a pipe might wait forever
            raise ForbiddenPathError.because("{text} is not a file", text=text)
        return path

    def directory_of(self, text: str) -> Path:
        """Return the path of a directory, the root for an empty text; raises ForbiddenPathError."""
        path = self.resolve(text) if text else self.directory
        if not path.is_relative_to(self.directory) or not path.is_dir():
            raise ForbiddenPathError.because(
                "{text} is not a directory below {directory}", text=text, directory=str(self.directory)
            )
        return path

    def name(self, path: Path) -> str:
        """Return the name of a path for users: relative to the root where possible."""
        return str(path.relative_to(self.directory) if path.is_relative_to(self.directory) else path)


def looks_like_model(file: Path) -> bool:
    """Return whether an XML file seems to be the model of a robot."""
    try:
        return _ROOT_OF_MODEL.search(read_regular(file, _HEAD)) is not None
    except OSError:
        return False


def find_documents(directory: Path) -> Iterator[Path]:
    """Yield the documents in a directory and all below it, by name."""
    for file in sorted(directory.rglob(f"*{DOCUMENT_SUFFIX}")):
        if is_regular(file) and looks_like_document(file):
            yield file
