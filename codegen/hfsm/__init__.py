"""Compile automaton documents (`*.xml`) into components that run on `hfsm_runtime`.

The stages, in the order in which `loading` runs them: `formats` reads the file into a `document.Document`,
`imports` inserts automata from other files, `extension` finds the hand-written code of the component, and
`known_interfaces` the proxies; `kinds` asks plug-ins about endpoints of other kinds. `analysis` parses all
code once; `effects` finds from it what code calls and sends, and whether a guard gives the same answer again,
without running it. `checks` reports errors and possible mistakes, `generator` writes the component, with
`automaton_writer`, and `model_checker` explores what the automata can do, whatever their guards say: that
something can never happen is always proved there, never guessed. `code` has the tools for the Python in a
document.

A document is XML as VisualHFSM wrote it from 2013 to 2017, so that the original editor opens a document that
uses none of our additions; additions are elements that it ignores. Code is kept byte for byte.
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
