"""Compile interfaces written in Slice, the language of Ice, to typed Python that talks over zenoh_ice.

A file goes through `lexer` (tokens), `preprocessor` (includes, guards, conditions), `parser` (the tree of
`ast`), `checker` (names, types, rules), `fingerprint` and `writer` (Python). `compiler` leads it through;
`units` holds what each file says by itself.
Diagnostics carry a code of `codes`; the writers of the parts share `names` and `layout`.
"""

from __future__ import annotations

from .compiler import Compilation, compile_interfaces

__all__ = ["Compilation", "compile_interfaces"]
