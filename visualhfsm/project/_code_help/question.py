"""Questions to the process that reads code."""

from __future__ import annotations

from typing import Literal

import msgspec

from visualhfsm._document.places import Place

Wanted = Literal["complete", "explain", "signature", "lint", "interfaces"]


class Question(msgspec.Struct, frozen=True, omit_defaults=True):
    """A question about the piece of code at a place of a document, which is given as its text.

    The document of `lint` contains the code; for the other questions it may contain any code at that place.
    `include` are directories with packages of interfaces.
    """

    wanted: Wanted
    document: str = ""
    path: str = ""
    place: Place | None = None
    code: str = ""
    line: int = 1
    column: int = 0
    include: tuple[str, ...] = ()
