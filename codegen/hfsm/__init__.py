"""Compile automaton documents (`*.xml`) into components that run on `hfsm_runtime`.

The way of a document, as `loading` goes it: `formats` makes a `document.Document` of the file, `imports`
brings in what lies in other files, `extension` finds the hand-written code beside it and `known_interfaces`
the proxies. `analysis` parses its code once; `checks` and `generator` read that: the one reports all that is
wrong or doubtful, the other writes the component down, and `model_checker` finds what the automata can do.
`code` knows the Python in a document. `scxml` exchanges documents with other programs.
"""

from __future__ import annotations

from .extension import component_path, extension_path
from .formats.reader import parse_document, read_document
from .formats.writer import DocumentNotWritableError, write_document
from .imports import resolve
from .loading import compile_document

__all__ = [
    "DocumentNotWritableError",
    "compile_document",
    "component_path",
    "extension_path",
    "parse_document",
    "read_document",
    "resolve",
    "write_document",
]
