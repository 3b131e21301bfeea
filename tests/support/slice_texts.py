"""Texts that look more or less like Slice, for property tests of the compiler."""

from __future__ import annotations

from hypothesis import strategies as st

from tests.support.any_text import any_text

_WORDS = r"""
module struct class interface exception enum sequence dictionary const idempotent out throws extends optional
local int string bool byte double void Object Value true false stream m S T E I a b c foo \module
{ } { } ( ) [ ] < > , ; ; ; : :: = * # " ' \ / /* */ // /**
0 1 -5 0x1F 017 1.5 1e400 99999999999999999999 "text" "\n" "\xff" ["stream"]
""".split()  # noqa: SIM905 - a list of words is easier to read than of literals

_DIRECTIVES = [
    "#ifndef G\n#define G\n",
    "#endif\n",
    "#else\n",
    "#if defined(A) && !defined B\n",
    "#if (1 + 2\n",
    '#include "a.idl"\n',
    "#include <none.idl>\n",
    "#pragma once\n",
    "#define A A A\n",
]

_PIECES = [
    "module m {",
    "};",
    "struct S { int a; };",
    "enum E { x, y = 5 };",
    "sequence<S> Ss;",
    "dictionary<string, S> Map;",
    "exception Bad { string why; };",
    "interface I extends J { S f(int a, out E b) throws Bad; };",
    "class C extends D { C next; };",
    "const int k = 7;",
]


def slice_like_texts() -> st.SearchStrategy[str]:
    """Return a strategy of words of Slice in any order, with pieces of good Slice and any characters between."""
    words = st.sampled_from([*_WORDS, "\n"]) | st.sampled_from(_DIRECTIVES) | st.sampled_from(_PIECES)
    return st.lists(words | any_text(max_size=5), max_size=40).map(" ".join)
