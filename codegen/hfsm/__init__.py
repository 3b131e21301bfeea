"""Compile automaton documents (`*.xml`) into components that run on `hfsm_runtime`.

The stages, in the order in which `loading` runs them: `formats` reads the file into a `document.Document`,
`imports` inserts automata from other files, `extension` finds the hand-written code of the component, and
`known_interfaces` the proxies. `analysis` parses the code once. `checks` reports errors and possible
mistakes, `generator` writes the component, and `model_checker` explores what the automata can do. `code` has
the tools for the Python in a document.
"""

from __future__ import annotations

from ._extension import component_path as component_path
from ._extension import extension_path as extension_path
from ._imports import resolve as resolve
from .formats.reader import parse_document as parse_document
from .formats.reader import read_document as read_document
from .formats.writer import DocumentNotWritableError as DocumentNotWritableError
from .formats.writer import write_document as write_document
from .known_interfaces import interface_directories as interface_directories
from .loading import compile_document as compile_document
