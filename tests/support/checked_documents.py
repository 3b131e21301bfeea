"""Small documents for the tests of checks, and what is found in them."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Final

from tests.support.documents import document, problems, state, sub

__all__ = ["IN_ANNOTATION", "A", "B", "errors", "head", "one", "with_code"]

A: Final = state(1, "a", initial=True)
B: Final = state(2, "b")

IN_ANNOTATION: Final = (
    "'named expression' can not be used"
    if sys.version_info < (3, 12)
    else "named expression cannot be used within an annotation"
)
"""What Python says of a name that is assigned in an annotation."""


def head(name: str = "head", identity: str = "Head", type: str = "PoseHead") -> str:
    """Return the declaration of an interface."""
    return (
        f"<iceinterface><nameinterface>{name}</nameinterface><nameproxy>{identity}</nameproxy>"
        f"<interface>{type}</interface></iceinterface>\n"
    )


def with_code(code: str, functions: str = "", variables: str = "") -> str:
    """Return a document of one state with this code."""
    return document(sub(1, 0, state(1, "a", code, initial=True), functions=functions, variables=variables))


def errors(path: Path, text: str) -> list[str]:
    """Return what is wrong with a document, without what is only doubtful."""
    return [problem for problem in problems(path, text) if problem.split(": ")[1].startswith("E")]


def one(found: list[str]) -> str:
    """Return the only problem that was found."""
    assert len(found) == 1, found
    return found[0]
