"""Report diagnostics by their codes, at tokens. The Slice compiler speaks to terminals alone, in English."""

from __future__ import annotations

from enum import StrEnum

from codegen.diagnostics import Diagnostics, Location, Note

from ..messages import Message
from .lexer import Token


class Code(StrEnum):
    """The kind of a diagnostic: E is an error, W a warning, N a note."""

    UNREADABLE_FILE = "E001"
    UNEXPECTED_CHARACTER = "E002"
    UNTERMINATED = "E003"
    BAD_LITERAL = "E004"
    INCLUDE_NOT_FOUND = "E005"
    INCLUDE_TOO_DEEP = "E006"
    BAD_DIRECTIVE = "E007"
    SYNTAX = "E010"
    KEYWORD_AS_NAME = "E011"
    UNDEFINED_NAME = "E012"
    REDEFINITION = "E013"
    CAPITALIZATION = "E014"
    WRONG_KIND = "E015"
    OUTSIDE_MODULE = "E016"
    OUT_BEFORE_IN = "E017"
    BAD_DICTIONARY_KEY = "E018"
    BAD_THROWS = "E019"
    BAD_INHERITANCE = "E020"
    AMBIGUOUS_OPERATION = "E021"
    BAD_CONSTANT = "E022"
    OUT_OF_RANGE = "E023"
    BAD_ENUMERATION = "E024"
    CONTAINS_ITSELF = "E025"
    RESERVED_NAME = "E026"
    CHANGED_MEANING = "E027"
    BAD_STREAM = "E029"
    NAME_CLASH_IN_OUTPUT = "E030"
    FOREIGN_FILE = "E032"
    NO_MEMBER = "E033"
    TOO_DEEP = "E034"
    BAD_TAG = "E035"
    LOCAL = "E036"
    BAD_STOP = "E037"

    UNKNOWN_METADATA = "W001"
    TOLERATED_KEYWORD = "W002"
    UNKNOWN_ENCODING = "W003"
    DEPRECATED = "W004"
    UNKNOWN_ESCAPE = "W005"
    NEVER_DEFINED = "W006"
    COMMENT_WITHOUT_END = "W007"
    NOT_UTF8_ESCAPES = "W008"
    DOUBTFUL_CAPITALIZATION = "W009"
    IGNORED_AMD = "W010"

    SKIPPED = "N001"


class SourceReport:
    """Reports to the diagnostics of a run."""

    def __init__(self, diagnostics: Diagnostics) -> None:
        self._diagnostics = diagnostics

    def error(self, code: Code, text: str, where: Token | Location, *notes: Note) -> None:
        """Report a problem that makes the sources unusable."""
        self._diagnostics.error(code, Message.verbatim(text), _place(where), notes)

    def warning(self, code: Code, text: str, where: Token | Location, *notes: Note) -> None:
        """Report a possible mistake."""
        self._diagnostics.warning(code, Message.verbatim(text), _place(where), notes)

    def note(self, code: Code, text: str, where: Token | Location) -> None:
        """Report a fact that needs no change."""
        self._diagnostics.note(code, Message.verbatim(text), _place(where))


def note_at(text: str, where: Token | Location | None = None) -> Note:
    """Return an explanation of a diagnostic, perhaps with another place."""
    return Note(Message.verbatim(text), None if where is None else _place(where))


def _place(where: Token | Location) -> Location:
    return where if isinstance(where, Location) else where.location
