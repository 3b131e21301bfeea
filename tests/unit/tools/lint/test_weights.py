"""Lines of code are counted, and compared with their limits."""

from __future__ import annotations

import pytest

from tools.lint.weights import compared, lines_of_code, lines_of_script

MODULE = '''"""What it does."""

import os
from pathlib import (
    Path,
)

# A comment.
LIMIT = 3  # beside code


def go(path: Path) -> None:
    """Go.

    In two sentences.
    """
    text = """one

    two"""
    print(text, path, os)
'''
SCRIPT = """/**
 * What it does.
 */
import {a} from "./a.js";
import {
  b,
} from "./b.js";

// A comment.
export const c = a + b; // beside code

/** What d is. @type {number} */
export const d = 1;
"""


def test_blank_lines_comments_docstrings_and_imports_are_no_code() -> None:
    assert lines_of_code(MODULE) == 6
    assert lines_of_script(SCRIPT) == 2


@pytest.mark.parametrize(
    ("limit", "count", "says"),
    [
        (1000, 1000, []),
        (1000, 1001, ["take something away"]),
        (1000, 900, ["lower the limit"]),
        (1000, 945, []),
        (0, 1, ["take something away"]),
        (100, 0, ["lower the limit"]),
    ],
)
def test_a_count_is_at_its_limit_or_a_little_below(limit: int, count: int, says: list[str]) -> None:
    found = list(compared("python", {"room": limit} if limit else {}, {"room": count} if count else {}))
    assert [text in mistake for text, mistake in zip(says, found, strict=True)] == [True] * len(says)
