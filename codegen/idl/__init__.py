"""Compile interfaces written in Slice, the language of Ice, to typed Python that talks over zenoh_ice.

A file goes through `lexer` (tokens), `preprocessor` (includes, guards, conditions), `parser` (the tree of
`ast`), `checker` (names, types, rules) and `writer` (Python). `compiler.compile_interfaces` leads it through.
"""

from __future__ import annotations

from .compiler import Compilation, compile_interfaces

__all__ = ["Compilation", "compile_interfaces"]
