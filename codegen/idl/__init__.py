"""Compile interfaces written in Slice, the language of Ice, to typed Python that talks over zenoh_ice.

A file goes through `lexer` (tokens), `preprocessor` (includes, guards), `parser` (the tree of `ast`),
`checker` with `resolver` and `constants` (names, types, values, rules), `fingerprint` and `writer` (Python).
`compiler` leads it through all of them.
Diagnostics carry a code of `codes`; the writers of the parts share `names` and `layout`.
"""

from __future__ import annotations

from .compiler import Compilation, compile_interfaces

__all__ = ["Compilation", "compile_interfaces"]
