"""The files of a series as it began, so that they can be edited meanwhile, and sent elsewhere."""

from __future__ import annotations

import hashlib
import io
import zipfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import interfaces
from codegen.diagnostics import Diagnostics
from codegen.graphs import reached
from codegen.hfsm import component_path, read_document
from codegen.hfsm.formats.reader import looks_like_document
from codegen.hfsm.loading import is_generated

from ._errors import TrialsError

_SUFFIXES: Final = frozenset(
    (".csv", ".idl", ".json", ".mjcf", ".obj", ".py", ".scxml", ".stl", ".toml", ".txt", ".urdf", ".xml")
)
_MOST_BYTES: Final = 20 << 20
"""Of all files together, before they are packed."""
_MOST_FILES: Final = 2000
INTERFACES: Final = "interfaces"
"""The package of the project's own interfaces, and the folder with them."""


@dataclass(frozen=True, slots=True)
class Archive:
    """Packed files, the path of the document in them, and a digest that no others have."""

    document: str
    content: bytes
    digest: str

    @classmethod
    def of(cls, files: Iterable[tuple[str, bytes]], document: str = "") -> Archive:
        """Pack the contents of files by their paths."""
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, each in files:
                archive.writestr(zipfile.ZipInfo(name), each, zipfile.ZIP_DEFLATED)  # without its time
        content = packed.getvalue()
        return cls(document, content, hashlib.sha256(content).hexdigest())

    @property
    def without_content(self) -> Archive:
        """The same for somebody who has its content."""
        return replace(self, content=b"")


def make_archive(document: Path, content: bytes | None = None, others: Sequence[str] = ()) -> Archive:
    """Pack a document's folder, without what is hidden and documents of others, and its project's interfaces.

    Generated components are left out, too: each trial compiles its own. `content` is that of the document if
    its changes are not saved, and `others` are the names of documents beside it that run with it. Raises
    TrialsError when they are too many or too large.
    """
    folder = document.parent.resolve()
    name = folder.name or "documents"
    parts = {name: folder}
    beside = folder.parent / INTERFACES
    if beside.is_dir() and name != INTERFACES and str(beside) not in interfaces.__path__:
        parts[INTERFACES] = beside
    document = document.resolve()
    contents = {} if content is None else {document: content}
    documents = documents_of(document, *map(folder.joinpath, others))
    return Archive.of(_files(parts, documents, contents), f"{name}/{document.name}")


def unpack(content: bytes, folder: Path) -> None:
    """Write the files of an archive of ours into an empty folder."""
    with zipfile.ZipFile(io.BytesIO(content)) as packed:
        packed.extractall(folder)


def _files(
    parts: dict[str, Path], documents: frozenset[Path], contents: Mapping[Path, bytes]
) -> Iterator[tuple[str, bytes]]:
    found = [
        (f"{name}/{path.relative_to(folder).as_posix()}", path)
        for name, folder in parts.items()
        for path in sorted(folder.rglob("*"))
        if path.suffix.lower() in _SUFFIXES
        and not _left_out(path.relative_to(folder))
        and path.is_file()
        and (path in documents or not looks_like_document(path))
        and not _is_component(path)
    ]
    size = sum(path.stat().st_size for _, path in found)
    if size > _MOST_BYTES or len(found) > _MOST_FILES:
        raise TrialsError.because(
            "{count} files with {size} MB stand beside the document, and at most {limit} "
            "with {most_bytes} MB are taken along: put it into another folder",
            count=len(found),
            size=size >> 20,
            limit=_MOST_FILES,
            most_bytes=_MOST_BYTES >> 20,
        )
    for name, path in found:
        yield name, contents.get(path) or path.read_bytes()


def documents_of(*documents: Path) -> frozenset[Path]:
    """Return documents and those whose automata they import; a run reports what is wrong in them."""
    return frozenset(reached(documents, _imports))


def _imports(path: Path) -> Iterator[Path]:
    """Yield the files that a document imports automata from."""
    content = read_document(path, Diagnostics()) if path.is_file() else None
    for automaton in content.automata if content is not None else ():
        if automaton.imported:
            yield (path.parent / automaton.imported.file.text.strip()).resolve()


def _is_component(path: Path) -> bool:
    """Return whether a file is the component of a document beside it, which a run in the editor writes."""
    if path.suffix != ".py":
        return False
    return any(component_path(each, None) == path for each in path.parent.glob("*.xml")) and is_generated(
        path
    )


def _left_out(path: Path) -> bool:
    """Return whether a file is hidden, or of trials or tests, which are no part of a behavior."""
    hidden = any(part.startswith((".", "__pycache__")) for part in path.parts)
    is_test = path.name.startswith("test_") and path.suffix == ".py"
    return hidden or is_test or path.name.endswith((".trials.toml", ".outcomes.csv"))
