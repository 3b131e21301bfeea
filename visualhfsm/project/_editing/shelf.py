"""The shelf: documents in a folder, each of which can be drawn into another document as a ready state.

There are two: ours, which comes along, and the folder `shelf` of a project. A file is read again when it has
changed, so that one that is added appears at once. One that cannot be used is listed with the reason.
"""

from __future__ import annotations

import re
import threading
from dataclasses import replace
from pathlib import Path
from typing import Final, NamedTuple

import msgspec

from codegen.diagnostics import Diagnostics
from codegen.files import read_regular
from codegen.hfsm import parse_document, resolve, write_document
from codegen.hfsm.document import Document, Parameter
from codegen.hfsm.document import Shelf as ShelfEntry
from codegen.messages import NO_MESSAGE, Message
from visualhfsm._base.errors import EditError, MissingError, VisualHfsmError
from zenoh_ice.data.text import printable

from .imports import with_functions

FOLDER: Final = "shelf"
"""The folder of a project that is its shelf."""

_OWN_CATEGORY: Final = "This project"
_SUFFIX: Final = ".xml"
_MOST_FILES: Final = 200
"""Most documents of a shelf that are listed."""
_LARGEST_FILE: Final = 1 << 20
"""Bytes."""
_LONGEST_TITLE: Final = 60
_LONGEST_TEXT: Final = 2000
_POSTURE: Final = re.compile(r"""\.goToPosture\(\s*["'](\w{1,64})["']""")
_SENTENCE: Final = re.compile(r"(?<=[.!?]) ")
_PACKAGE: Final = Path(__file__).parents[2]


class ReadyValue(msgspec.Struct, frozen=True):
    """What can be set of a ready state, or taken from it: an input or an output of its automaton."""

    name: str
    type: str
    default: str
    description: str


class Need(msgspec.Struct, frozen=True):
    """A servant that a ready state calls: its identity, and its interface."""

    identity: str
    type: str


class ReadyState(msgspec.Struct, frozen=True, kw_only=True):
    """A document of a shelf, as people see it there.

    `id` distinguishes it from others, `path` is its file as people name it. `summary` is the first sentence
    of its description, which `text` has whole. `postures` are those that its code names. One that `ends` has
    a final state: transitions out of it may wait for that. `trouble` says why its file cannot be used; then
    the rest is blank.
    """

    id: str
    path: str
    title: str
    category: str
    own: bool
    summary: str = ""
    text: str = ""
    icon: str = ""
    words: str = ""
    inputs: tuple[ReadyValue, ...] = ()
    outputs: tuple[ReadyValue, ...] = ()
    needs: tuple[Need, ...] = ()
    postures: tuple[str, ...] = ()
    ends: bool = False
    trouble: Message = NO_MESSAGE


class _File(NamedTuple):
    """A file as it was read: its time of change and size then, what is shown of it, and its content."""

    version: tuple[int, int]
    shown: ReadyState
    content: str


class _Folder(NamedTuple):
    """A folder that is a shelf. Nothing outside of `root` is read."""

    directory: Path
    root: Path
    own: bool


class Shelves:
    """Our shelf, and that of a project with the folder `root`. Any thread may call any method."""

    def __init__(self, root: Path) -> None:
        ours, root = our_shelf().resolve(), root.resolve()
        self._folders = [_Folder(ours, ours, own=False)]
        if root / FOLDER != ours:
            self._folders.append(_Folder(root / FOLDER, root, own=True))
        self._lock = threading.Lock()
        self._files: dict[str, _File] = {}

    def states(self) -> list[ReadyState]:
        """Return what is on the shelves now: ours, then the project's, by category and title."""
        shown = [each.shown for each in self._inspect().values()]
        return sorted(shown, key=lambda each: (each.own, each.category.casefold(), each.title.casefold()))

    def content(self, id: str) -> tuple[str, str]:
        """Return the title and the text of a document, with all that it imports.

        Raises EditError when its file cannot be used, and MissingError when it is not there.
        """
        found = self._inspect().get(id)
        if found is None:
            raise MissingError.because("{id} is not on the shelf", id=printable(id)[:100])
        if found.shown.trouble:
            what = Message("Cannot draw {title}", title=found.shown.title)
            raise EditError(what, found.shown.trouble, Message("fix {file}", file=found.shown.path))
        return found.shown.title, found.content

    def _inspect(self) -> dict[str, _File]:
        """Return the files as they are now; those that are new or have changed are read."""
        with self._lock:
            files: dict[str, _File] = {}
            for folder in self._folders:
                for path in _documents(folder):
                    name = path.relative_to(folder.directory).as_posix()
                    key = f"{'own' if folder.own else 'ours'}/{name}"
                    version, known = _version(path), self._files.get(key)
                    is_known = known is not None and known.version == version
                    files[key] = known if known and is_known else _read(folder, path, key, version)
            self._files = files
            return files


def our_shelf() -> Path:
    """Return the folder of the shelf that comes along: in the wheel, or in a checkout."""
    installed = _PACKAGE / "_shipped" / FOLDER
    return installed if installed.is_dir() else _PACKAGE.parent / FOLDER


def _documents(folder: _Folder) -> list[Path]:
    """Return the files of a shelf, and those in the folders below it."""
    inside = _entries(folder.directory) if _is_inside(folder.directory, folder) else []
    folders = [each for each in inside if each.is_dir() and not each.is_symlink()]
    found = [*inside, *(path for each in folders for path in _entries(each))]
    return [path for path in found if path.suffix.lower() == _SUFFIX][:_MOST_FILES]


def _entries(directory: Path) -> list[Path]:
    try:
        return sorted(each for each in directory.iterdir() if not each.name.startswith("."))
    except OSError:
        return []


def _is_inside(path: Path, folder: _Folder) -> bool:
    try:
        return path.resolve().is_relative_to(folder.root)
    except (OSError, RuntimeError):  # a loop of links
        return False


def _version(path: Path) -> tuple[int, int]:
    try:
        status = path.stat()
    except OSError:
        return 0, 0
    return status.st_mtime_ns, status.st_size


def _read(folder: _Folder, path: Path, id: str, version: tuple[int, int]) -> _File:
    """Return a file of a shelf; `trouble` of it says why it cannot be used."""
    where = path.parent.name if path.parent != folder.directory else _OWN_CATEGORY
    named = ReadyState(
        id=id,
        path=printable(path.relative_to(folder.directory.parent).as_posix()),
        title=_line(path.stem.replace("_", " ")),
        category=_line(where.replace("_", " ")),
        own=folder.own,
    )
    try:
        document = _document(folder, path)
    except VisualHfsmError as error:
        return _File(version, msgspec.structs.replace(named, trouble=error.message), "")
    content = write_document(document)
    postures = tuple(dict.fromkeys(_POSTURE.findall(content)))
    shown = msgspec.structs.replace(_described(named, document), postures=postures)
    return _File(version, shown, content)


def _document(folder: _Folder, path: Path) -> Document:
    """Return the document in a file, with all that it imports. Raises VisualHfsmError."""
    if not _is_inside(path, folder):
        raise VisualHfsmError(Message("it is a link that leads out of the project"))
    with VisualHfsmError.in_place_of(OSError, "it cannot be read: {reason}"):
        content = read_regular(path.resolve(), _LARGEST_FILE + 1)
    if len(content) > _LARGEST_FILE:
        raise VisualHfsmError(Message("it is larger than {limit} MiB", limit=_LARGEST_FILE >> 20))
    diagnostics = Diagnostics()
    document = parse_document(content, path, diagnostics)
    if document is not None and not diagnostics.has_errors:
        document = resolve(document, path, diagnostics)
    if document is None or diagnostics.has_errors:
        found = diagnostics.errors[0]
        if found.location.line:
            raise VisualHfsmError(
                Message("line {line}: {problem}", line=found.location.line, problem=found.message)
            )
        raise VisualHfsmError(found.message)
    root = document.root
    if root is None or not root.states:
        raise VisualHfsmError(Message("it has no root automaton with states"))
    whole = with_functions(root, document.functions)
    return replace(document, automata=(whole, *(each for each in document.automata if each is not root)))


def _described(named: ReadyState, document: Document) -> ReadyState:
    """Return what is shown of a document; the names of file and folder count where it has no others."""
    root = document.root
    assert root is not None
    shelf = document.shelf or ShelfEntry()
    text = _line(document.description.text, _LONGEST_TEXT)
    return msgspec.structs.replace(
        named,
        title=_line(shelf.title.text) or named.title,
        category=_line(shelf.category.text) or named.category,
        summary=_SENTENCE.split(text, maxsplit=1)[0],
        text=text,
        icon=_line(shelf.icon.text),
        words=_line(shelf.words.text, _LONGEST_TEXT),
        inputs=tuple(map(_value, root.inputs)),
        outputs=tuple(map(_value, root.outputs)),
        needs=tuple(Need(each.identity.strip(), each.type.strip()) for each in document.interfaces),
        ends=any(each.final for each in root.states),
    )


def _value(declared: Parameter) -> ReadyValue:
    type_name, default = _line(declared.type.text), declared.default.text.strip()
    return ReadyValue(declared.name, type_name, default, _line(declared.description.text, _LONGEST_TEXT))


def _line(text: str, longest: int = _LONGEST_TITLE) -> str:
    return printable(" ".join(text.split()))[:longest]
