"""Compile automaton documents (`*.xml`) into components that run on `hfsm_runtime`.

The stages, in the order in which `loading` runs them: `formats` reads the file into a `document.Document`,
`imports` inserts automata from other files, `extension` finds the hand-written code of the component, and
`known_interfaces` the proxies. `analysis` parses the code once. `checks` reports errors and possible
mistakes, `generator` writes the component, and `model_checker` explores what the automata can do. `code` has
the tools for the Python in a document.
"""

from __future__ import annotations

from ._extension import component_path, extension_path
from ._imports import resolve
from .formats.reader import parse_document, read_document
from .formats.writer import DocumentNotWritableError, write_document
from .known_interfaces import interface_directories
from .loading import compile_document

__all__ = [
    "DocumentNotWritableError",
    "compile_document",
    "component_path",
    "extension_path",
    "interface_directories",
    "parse_document",
    "read_document",
    "resolve",
    "write_document",
]
