"""Parse untrusted XML into a tree whose elements and texts have a line and a column."""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final
from xml.sax import SAXParseException
from xml.sax.handler import ContentHandler, LexicalHandler, property_lexical_handler
from xml.sax.xmlreader import AttributesImpl, InputSource, Locator

from defusedxml.common import DefusedXmlException
from defusedxml.expatreader import DefusedExpatParser

from ...diagnostics import Diagnostics, Location
from ..codes import Code
from ..document import Comment, Text

__all__ = ["MAX_SIZE", "XmlElement", "new_leaf", "parse_xml", "read_bytes"]

MAX_SIZE: Final = 16 << 20
"""The largest document in bytes."""

_MAX_DEPTH: Final = 64
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
        with path.open("rb") as file:
            return file.read(MAX_SIZE + 1)
    except OSError as error:
        diagnostics.error(Code.UNREADABLE_FILE, f"cannot be read: {error.strerror or error}", Location(path))
        return None


def parse_xml(content: bytes, path: Path, diagnostics: Diagnostics) -> XmlElement | None:
    """Return the root element, or None after reporting an error; comments outside it are put before it."""
    if len(content) > MAX_SIZE:
        message = f"the file is larger than {MAX_SIZE >> 20} MiB"
        diagnostics.error(Code.FILE_TOO_LARGE, message, Location(path))
        return None
    diagnostics.add_source(path, content.decode("utf-8", errors="replace"))
    parser = _PositionedParser()
    builder = _TreeBuilder(parser, path, diagnostics)
    parser.setContentHandler(builder)
    parser.setProperty(property_lexical_handler, builder)
    source = InputSource()
    source.setByteStream(io.BytesIO(content))
    try:
        parser.parse(source)
    except (SAXParseException, LookupError, ValueError) as error:  # LookupError: an unknown encoding
        code, message = Code.MALFORMED_XML, f"unreadable XML: {error}"
        if isinstance(error, SAXParseException):
            message = f"malformed XML: {builder.problem(error.getMessage())}"
        elif isinstance(error, DefusedXmlException):
            code = Code.DOCUMENT_TYPE
            reason = "document types and entities are not allowed in a document"
            message = f"{type(error).__name__}: {reason}"
        diagnostics.error(code, message, builder.place())
        return None
    assert builder.root is not None, "expat refuses a document without a root element"
    return builder.root


class _PositionedParser(DefusedExpatParser):
    """A parser that does not buffer character data, so that the position of the first character is known."""

    def __init__(self) -> None:
        super().__init__(forbid_dtd=True, forbid_entities=True, forbid_external=True)

    def reset(self) -> None:
        super().reset()
        self._parser.buffer_text = False  # type: ignore[attr-defined]  # absent from the stub


class _TreeBuilder(ContentHandler, LexicalHandler):
    def __init__(self, locator: Locator, path: Path, diagnostics: Diagnostics) -> None:
        super().__init__()
        self.root: XmlElement | None = None
        self._around: list[Comment] = []
        self._locator = locator
        self._path = path
        self._diagnostics = diagnostics
        self._open: list[XmlElement] = []
        self._texts: list[list[str]] = []
        self._elements = 0

    def place(self) -> Location:
        """Return the current place of the parser."""
        line, column = self._position()
        return Location(self._path, max(1, line), column)

    def _position(self) -> tuple[int, int]:
        return int(self._locator.getLineNumber() or 0), int(self._locator.getColumnNumber() or 0) + 1

    def problem(self, message: str) -> str:
        """Return the message of expat, or a clearer one if it is `no element found`."""
        if message != "no element found":
            return message
        if not self._open:
            return "the file has no element"
        element = self._open[-1]
        return f"the element `{element.tag}` of line {element.line} is not closed"

    def startElement(self, name: str, attrs: AttributesImpl) -> None:
        line, column = self._position()
        element = XmlElement(name, dict(attrs.items()), line, column, text_line=line, text_column=column)
        self._elements += 1
        if self._elements > _MAX_ELEMENTS:
            raise ValueError(f"more than {_MAX_ELEMENTS} elements")
        if len(self._open) >= _MAX_DEPTH:
            raise ValueError(f"elements nested deeper than {_MAX_DEPTH}")
        if self._open:
            around = self._open[-1]
            around.children.append(element)
            element.comments, around.trailing = around.trailing, []
        else:
            self.root = element
            element.comments = self._around
        self._open.append(element)
        self._texts.append([])

    def endElement(self, name: str) -> None:  # noqa: ARG002 - the signature of SAX
        self._open.pop().text = "".join(self._texts.pop())

    def characters(self, content: str) -> None:
        if not self._texts[-1]:
            element = self._open[-1]
            element.text_line, element.text_column = self._position()
        self._texts[-1].append(content)

    def comment(self, content: str) -> None:
        (self._open[-1].trailing if self._open else self._around).append(Comment(content))

    def processingInstruction(self, target: str, data: str) -> None:  # noqa: ARG002 - the signature of SAX
        message = "a processing instruction is lost on saving"
        self._diagnostics.warning(Code.LOST_ON_SAVING, message, self.place())
