"""What the page gets for what it asked."""

from __future__ import annotations

from typing import Any, Literal

import msgspec

__all__ = ["Answer", "ErrorAnswer", "ErrorKind"]

ErrorKind = Literal[
    "malformed",  # no request of this protocol
    "refused",  # a document cannot be changed, opened or saved like this
    "forbidden",  # a path that the page may not reach
    "missing",  # no such file, tab or component
    "unsaved",  # closing would lose changes: ask, then close with discard
    "exists",  # a file is there already: ask, then save with overwrite
    "outside",  # the file was changed by another program: ask, then resolve
    "unavailable",  # a part of the program that is not installed
    "busy",  # too much at a time
    "timeout",  # it took too long
    "internal",  # a fault of the program; its log says more
]


class Answer(msgspec.Struct, kw_only=True):
    """What an operation gives."""

    re: int
    ok: Any = None


class ErrorAnswer(msgspec.Struct, kw_only=True):
    """Why an operation was not done; `re` is missing when the request's own id could not be read."""

    re: int | None
    error: str
    kind: ErrorKind
