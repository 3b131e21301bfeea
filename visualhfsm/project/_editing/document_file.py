"""The file of an open document: what it held last, and what other programs did to it since."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from codegen.hfsm.document import NATIVE, Document
from codegen.messages import Message
from visualhfsm._base.errors import ChangedOutsideError, EditError, OldFormatError
from visualhfsm._document.serialization import parse_file, written

from .files import FileVersion, read_file, write_file
from .journal import Header, Saved

FileState = Literal["same", "changed", "deleted"]
"""The change by another program of a document's file since that was read or saved."""


class DocumentFile:
    """The file of an open document, as it was read or saved last. A new document has none yet.

    Its `header` has the document as it was then, with which a journal begins; it is None if that is nowhere.
    """

    def __init__(self, header: Header, document: Document, version: FileVersion | None = None) -> None:
        self.header: Header | None = header
        self.path = None if header.path is None else Path(header.path)
        self.title = header.name
        self.saved = None if self.path is None else document
        """The document as it was read or saved last, None if it never was."""
        self.state: FileState = "same"
        """What another program did, as far as somebody has looked."""
        self._format = NATIVE if self.path is None else document.format
        self._version = version
        self._original: tuple[Document, bytes] | None = None
        self._keep_original(document, header.content)

    def is_changed_outside(self) -> bool:
        """Return whether another program has changed or removed the file since it was read or saved."""
        return self.path is not None and self._version is not None and not self._version.is_current(self.path)

    def require_ours(self) -> None:
        """Raise OldFormatError or ChangedOutsideError if saving replaces what was not written here."""
        assert self.path is not None
        what = Message("Cannot save {target}", target=self.path.name)
        if self._format != NATIVE:
            raise OldFormatError(
                what,
                Message(
                    "it is in the format of {dialect}, and would be replaced by the current format",
                    dialect=self._format,
                ),
                "save it as another file, or replace it",
            )
        if self.is_changed_outside():
            if self.path.exists():
                why = Message("another program has changed it")
                raise ChangedOutsideError(what, why, "merge both, take theirs, or keep yours")
            why = Message("another program has deleted it")
            raise ChangedOutsideError(what, why, "write it again, or save it elsewhere")

    def content(self, document: Document) -> bytes:
        """Return what the file is to hold: of an unchanged document what was read, byte for byte."""
        if self._original is not None and self._original[0] == document:
            return self._original[1]
        return written(document).encode()

    def save(self, target: Path, document: Document, content: bytes) -> Saved:
        """Write the content of a document to a file, which is its file from then on. Raises EditError."""
        return self._remember(target, document, content, write_file(target, content))

    def take(self, held: Document, content: bytes, version: FileVersion, document: Document) -> Saved:
        """Count what the file holds now as saved; a `document` that is the same has no changes then."""
        assert self.path is not None
        saved = self._remember(self.path, document if document == held else held, content, version)
        self._format = held.format
        self._keep_original(held, content)
        return Saved(saved.path, saved.digest, content)

    def take_if_same(self, document: Document) -> None:
        """Count what the file holds as saved if that is the document, though nobody has said so."""
        if self.path is None or (document is self.saved and not self.is_changed_outside()):
            return
        try:
            content, version = read_file(self.path)
            held = parse_file(content, self.path)
        except EditError:  # it is reported when it is saved
            return
        if held == document:
            self.take(held, content, version, document)

    def lose(self) -> None:
        """Accept that the file was deleted: the document is saved nowhere."""
        self._version, self.saved, self.header, self.state = None, None, None, "same"

    def replay(self, entry: Saved, document: Document) -> None:
        """Repeat what a journal says was saved. Raises EditError."""
        self.path, self.title = Path(entry.path), Path(entry.path).stem
        version = FileVersion(0, -1, entry.digest)
        if entry.content is None:
            self._remember(self.path, document, self.content(document), version)
        else:
            self.take(parse_file(entry.content, self.path), entry.content, version, document)

    def _remember(self, path: Path, document: Document, content: bytes, version: FileVersion) -> Saved:
        self.path, self.title, self.saved, self.state = path, path.stem, document, "same"
        self._version, self._format = version, NATIVE
        self.header = Header(str(path), self.title, content, version.digest)
        return Saved(str(path), version.digest)

    def _keep_original(self, document: Document, content: bytes) -> None:
        self._original = (document, content) if document.format == NATIVE else None
