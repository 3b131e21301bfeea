"""Parse untrusted XML into a tree whose elements and texts have a line and a column."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final
from xml.parsers import expat  # xml.sax would load urllib.request, which takes as long as all the rest

from ..._text_layout import Mark, Place, TextLayout
from ...diagnostics import Diagnostics, Location
from ...files import read_regular
from ...messages import Message, MessageError
from ...reasons import known_text, reason
from ..codes import Code
from ..document import Comment, Text

MAX_SIZE: Final = 16 << 20
"""The largest document in bytes."""

_MAX_DEPTH: Final = 64
_CONFLICT: Final = re.compile(rb"^<{7}(?= |\r?$)", re.MULTILINE)
"""The first line of a conflict, as git and other programs mark it."""
_MAX_ELEMENTS: Final = 500_000


@dataclass(slots=True, eq=False)
class XmlElement:
    """An element; `text` is the character data directly inside it.

    `comments` are before it, `trailing` ones after its last child. `name` is the tag in the file, for
    messages.
    """

    tag: str
    attributes: dict[str, str]
    line: int
    column: int
    text: str = ""
    text_line: int = 0
    text_column: int = 0
    children: list[XmlElement] = field(default_factory=list)
    comments: list[Comment] = field(default_factory=list)
    trailing: list[Comment] = field(default_factory=list)
    name: str = ""

    def __post_init__(self) -> None:
        self.name = self.name or self.tag

    @property
    def content(self) -> Text:
        """The text with its position."""
        return Text(self.text, self.text_line, self.text_column)

    def elements(self, *tags: str) -> Iterator[XmlElement]:
        """Return the child elements, all of them or those with the given tags."""
        return (child for child in self.children if not tags or child.tag in tags)

    def first(self, tag: str) -> XmlElement | None:
        """Return the first child element with a tag, or None."""
        return next(self.elements(tag), None)


def new_leaf(tag: str, text: str, place: XmlElement) -> XmlElement:
    """Return an element with a text, at the position of the text of another element."""
    return XmlElement(tag, {}, place.line, place.column, text, place.text_line, place.text_column)


def read_bytes(path: Path, diagnostics: Diagnostics) -> bytes | None:
    """Return the content of a file, or None after reporting an error.

    Of a file that is too large, only as much is read as `parse_xml` needs to report it.
    """
    try:
        return read_regular(path, MAX_SIZE + 1)
    except OSError as error:
        message = Message("cannot be read: {reason}", reason=reason(error))
        diagnostics.error(Code.UNREADABLE_FILE, message, Location(path))
        return None


def parse_xml(content: bytes, path: Path, diagnostics: Diagnostics, above: int = 0) -> XmlElement | None:
    """Return the root element, or None after reporting an error; comments outside it are put before it.

    The content begins below as many lines as are `above` it.
    """
    if len(content) > MAX_SIZE:
        message = Message("the file is larger than {limit} MiB", limit=MAX_SIZE >> 20)
        diagnostics.error(Code.FILE_TOO_LARGE, message, Location(path))
        return None
    diagnostics.add_source(path, content.decode("utf-8", errors="replace"))
    builder = _TreeBuilder(path, diagnostics, above)
    try:
        builder.parse(content)
    # LookupError: an unknown encoding
    except (expat.ExpatError, LookupError, ValueError, _TooLargeError) as error:
        code, message = Code.MALFORMED_XML, Message("unreadable XML: {reason}", reason=reason(error))
        if isinstance(error, expat.ExpatError):
            problem = builder.problem(expat.ErrorString(error.code))
            message = Message("malformed XML: {problem}", problem=problem)
        elif isinstance(error, _DocumentTypeFound):
            code = Code.DOCUMENT_TYPE
            message = Message("document types and entities are not allowed in a document")
        place = builder.place()
        if marker := _CONFLICT.search(content):
            message = Message(
                "`{marker}` begins a conflict of a merge: keep one of the two versions",
                marker=marker[0].decode(),
            )
            place = Location(path, content.count(b"\n", 0, marker.start()) + 1, 1, len(marker[0]))
        diagnostics.error(code, message, place)
        return None
    assert builder.root is not None, "expat refuses a document without a root element"
    diagnostics.add_layout(path, TextLayout(builder.decoded))
    return builder.root


def read_root(head: bytes) -> XmlElement | None:
    """Return the root element without its content, by the first bytes of a file; None if that is unclear."""
    builder = _TreeBuilder(Path(), Diagnostics())
    with suppress(expat.ExpatError, LookupError, ValueError, _TooLargeError):  # who reads it all says why
        builder.parse(head, is_whole=False)
    return None if builder.root is None else replace(builder.root, children=[])


class _DocumentTypeFound(ValueError):
    """Ends the parsing before the first entity."""


class _TooLargeError(MessageError):
    """The document has more than the reader takes."""


class _TreeBuilder:
    """Builds a tree from the events of the parser.

    The parser does not buffer texts, so that the place of their first character is known. It refuses a
    document type, without which there are no entities.
    """

    def __init__(self, path: Path, diagnostics: Diagnostics, above: int = 0) -> None:
        self.root: XmlElement | None = None
        self.decoded: list[list[Mark]] = []
        """The marks of texts in which something is decoded."""
        self._around: list[Comment] = []
        self._parser = parser = expat.ParserCreate()
        parser.StartDoctypeDeclHandler = self._document_type
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self._characters
        parser.CommentHandler = self._comment
        parser.ProcessingInstructionHandler = self._instruction
        self._path = path
        self._above = above
        self._diagnostics = diagnostics
        self._open: list[XmlElement] = []
        self._texts: list[list[str]] = []
        self._marks: list[list[Mark]] = []
        """The marks of the texts of open elements."""
        self._elements = 0

    def parse(self, content: bytes, *, is_whole: bool = True) -> None:
        """Parse a document. Raises ExpatError, ValueError and _TooLargeError, LookupError for an encoding."""
        self._parser.Parse(content, is_whole)

    def place(self) -> Location:
        """Return the current place of the parser."""
        line, column = self._position()
        return Location(self._path, max(1, line), column)

    def _position(self) -> tuple[int, int]:
        return self._above + self._parser.CurrentLineNumber, self._parser.CurrentColumnNumber + 1

    def problem(self, message: str) -> Message:
        """Return the message of expat, or a clearer one if it is `no element found`."""
        if message != "no element found":
            return known_text(message)
        if not self._open:
            return Message("the file has no element")
        element = self._open[-1]
        return Message("the element `{tag}` of line {line} is not closed", tag=element.tag, line=element.line)

    def _document_type(self, *_declaration: object) -> None:
        raise _DocumentTypeFound

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        line, column = self._position()
        element = XmlElement(name, attributes, line, column, text_line=line, text_column=column)
        self._elements += 1
        if self._elements > _MAX_ELEMENTS:
            raise _TooLargeError.because("more than {limit} elements", limit=_MAX_ELEMENTS)
        if len(self._open) >= _MAX_DEPTH:
            raise _TooLargeError.because("elements nested deeper than {limit}", limit=_MAX_DEPTH)
        if self._open:
            around = self._open[-1]
            around.children.append(element)
            element.comments, around.trailing = around.trailing, []
        else:
            self.root = element
            element.comments = self._around
        self._open.append(element)
        self._texts.append([])
        self._marks.append([])

    def _end(self, _name: str) -> None:
        element, marks = self._open.pop(), self._marks.pop()
        pieces = self._texts.pop()
        element.text = "".join(pieces)
        if element.children or not pieces:
            return
        marks.append(Mark(_after(marks[-1].in_text, pieces[-1]), Place(*self._position())))
        if any(mark.in_text != mark.in_file for mark in marks):
            self.decoded.append(marks)

    def _characters(self, content: str) -> None:
        pieces = self._texts[-1]
        marks = self._marks[-1]
        here = Place(*self._position())
        if not pieces:
            element = self._open[-1]
            element.text_line, element.text_column = here
        marks.append(Mark(_after(marks[-1].in_text, pieces[-1]) if pieces else here, here))
        pieces.append(content)

    def _comment(self, content: str) -> None:
        (self._open[-1].trailing if self._open else self._around).append(Comment(content))

    def _instruction(self, _target: str, _data: str) -> None:
        message = Message("a processing instruction is lost on saving")
        self._diagnostics.warning(Code.LOST_ON_SAVING, message, self.place())


def _after(place: Place, text: str) -> Place:
    """Return the place behind a text that begins at a place."""
    newlines = text.count("\n")
    if not newlines:
        return Place(place.line, place.column + len(text))
    return Place(place.line + newlines, len(text) - text.rindex("\n"))
