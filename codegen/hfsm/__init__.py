"""Compile automaton documents (`*.xml`) into components that run on `hfsm_runtime`.

The way of a document, as `loading` goes it: `formats` makes a `document.Document` of the file, `imports`
brings in what lies in other files, `extension` finds the hand-written code beside it and `known_interfaces`
the proxies, and `generation` makes a `program.Program` of it after
`checks` has looked at its structure, and writes the component down. `code` knows the Python in a document.
`checking` checks a document and, with `model_checker`, what its automata can do, without generating
anything. `scxml` exchanges documents with other programs.
"""

from __future__ import annotations

from .extension import extension_path
from .formats.reader import parse_document, read_document
from .formats.writer import DocumentNotWritableError, write_document
from .imports import resolve
from .loading import compile_document, component_path

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
