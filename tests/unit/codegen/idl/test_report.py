"""Diagnostics of the Slice compiler: texts as they are, at the places of tokens."""

from __future__ import annotations

from pathlib import Path

from codegen._idl.lexer import Source
from codegen._idl.report import Code, SourceReport, note_at
from codegen.diagnostics import Diagnostics, Location


def test_a_text_with_braces_is_reported_as_it_is_at_its_token() -> None:
    token = Source(Path("a.idl"), "struct\n  S {}").tokens[1]
    diagnostics = Diagnostics()
    SourceReport(diagnostics).warning(
        Code.DEPRECATED, "`{S}`", token, note_at("{here}", token), note_at("why")
    )
    (found,) = diagnostics
    assert (found.message, found.location) == ("`{S}`", Location(Path("a.idl"), 2, 3, 1))
    assert [(note.message, note.location) for note in found.notes] == [
        ("{here}", found.location),
        ("why", None),
    ]
