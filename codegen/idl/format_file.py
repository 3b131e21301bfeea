"""Format one file on disk, provided that it can be read."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from codegen.diagnostics import Diagnostics, Location, Severity

from .codes import Code
from .formatter import format_source
from .lexer import Kind, Source
from .parser import parse
from .preprocessor import Preprocessor, SourceFiles

__all__ = ["format_file"]


def format_file(path: Path, include_directories: Sequence[Path], diagnostics: Diagnostics) -> str | None:
    """Return the text of a file in canonical layout, or None after reporting what is wrong with its syntax.

    Files that it includes matter only for the macros that they define; what is wrong there, or that they are
    missing, is not reported. Raises FormattingError.
    """
    found = Diagnostics()
    files = SourceFiles(found)
    source = files.load(path)
    if source is not None:
        parse(Preprocessor(files, include_directories).unit(source, found), found)
        diagnostics.add_source(path, source.text)
    own = [
        each
        for each in found
        if each.location.path == path
        and each.severity is Severity.ERROR
        and each.code != Code.INCLUDE_NOT_FOUND
    ]
    for each in own:
        diagnostics.error(each.code, each.message, each.location, each.notes)
    if source is None or own or _holds_what_is_no_word(source, diagnostics):
        return None
    return format_source(source)


def _holds_what_is_no_word(source: Source, diagnostics: Diagnostics) -> bool:
    """Report text in a branch that no condition chooses, which may be anything."""
    for piece in source.pieces:
        if piece.kind is Kind.INVALID or piece.kind is Kind.UNTERMINATED:
            line, column = source.position(piece.offset)
            place = Location(source.path, line, column)
            if piece.text.startswith("/*"):
                diagnostics.error(Code.UNTERMINATED, "this comment has no end", place)
            else:
                message = "a file with such text in an unused branch of #if cannot be laid out"
                diagnostics.error(Code.UNEXPECTED_CHARACTER, message, place)
            return True
    return False
