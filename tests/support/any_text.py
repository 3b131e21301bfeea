"""Any text, for property tests."""

from __future__ import annotations

from hypothesis import strategies as st

__all__ = ["any_text", "matching"]

_CHARACTERS = st.characters(exclude_categories=["Cs"])


def any_text(max_size: int | None = None) -> st.SearchStrategy[str]:
    """Return a strategy of the texts that UTF-8 encodes.

    `st.text` has the same, but tries all characters with UTF-8, for 3 s in a fresh clone.
    """
    return st.text(_CHARACTERS, max_size=max_size)


def matching(pattern: str) -> st.SearchStrategy[str]:
    """Return a strategy of such texts that match a pattern as a whole, without trying all characters, too."""
    return st.from_regex(pattern, fullmatch=True, alphabet=_CHARACTERS)
