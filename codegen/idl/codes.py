"""The codes of everything that the Slice compiler reports."""

from __future__ import annotations

from enum import StrEnum


class Code(StrEnum):
    """What a diagnostic is about: E is an error, W a warning."""

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
    NEVER_DEFINED = "E028"
    BAD_STREAM = "E029"
    NAME_CLASH_IN_OUTPUT = "E030"
    NOT_SUPPORTED = "E031"

    UNKNOWN_METADATA = "W001"
    TOLERATED_KEYWORD = "W002"
    UNKNOWN_ENCODING = "W003"
    DEFAULT_NOT_SENT = "W004"
