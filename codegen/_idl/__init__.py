"""Compile interfaces written in Slice, the language of Ice, to typed Python that talks over zenoh_ice.

The stages, each a module: `lexer` (tokens), `preprocessor` (includes, guards), `parser` (the tree of `ast`),
`checker` with `resolver` and `constants` (names, types, values, rules), `packages` and `dependencies` (which
Python module a definition goes to), `python_writer` with `names`, and `schema` (fingerprints,
`schema.json`). `compiler` runs them; `report` has the codes of all diagnostics; `changes` compares versions.
"""

from __future__ import annotations

from .compiler import Compilation, compile_interfaces, read_definitions

__all__ = ["Compilation", "compile_interfaces", "read_definitions"]
