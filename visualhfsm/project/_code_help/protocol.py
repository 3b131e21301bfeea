"""Questions to the process that reads code, and its answers."""

from __future__ import annotations

from typing import Literal

import msgspec

from visualhfsm._document.places import Place

Wanted = Literal["complete", "explain", "signature", "interfaces"]


class Question(msgspec.Struct, frozen=True, omit_defaults=True):
    """A question about the piece of code at a place of a document, which is given as its text.

    There the document may contain any code. `include` are directories with packages of interfaces.
    """

    wanted: Wanted
    document: str = ""
    path: str = ""
    place: Place | None = None
    code: str = ""
    line: int = 1
    column: int = 0
    include: tuple[str, ...] = ()


class Completion(msgspec.Struct, frozen=True, omit_defaults=True):
    """A completion; `type` is its kind in the terms of CodeMirror, `boost` moves it up in the list."""

    label: str
    type: str = ""
    detail: str = ""
    info: str = ""
    boost: int = 0


class Completions(msgspec.Struct, frozen=True, rename="camel"):
    """Completions; the prefix that was typed starts `typed` characters before the cursor."""

    typed: int
    options: list[Completion]


class Signature(msgspec.Struct, frozen=True, rename="camel"):
    """A call that is being typed: its parameters, and the index of the one at the cursor, -1 for none."""

    name: str
    parameters: list[str]
    active: int
    result: str
    documentation: str


class Explanation(msgspec.Struct, frozen=True, rename="camel"):
    """The explanation of a name: its parameters and result, and its documentation."""

    name: str
    detail: str
    documentation: str


class InterfaceDescription(msgspec.Struct, frozen=True):
    """An interface that a document may declare."""

    name: str
    scoped: str
    operations: list[OperationDescription]


class OperationDescription(msgspec.Struct, frozen=True):
    """An operation as a method of a proxy; its signature begins with `(self`."""

    name: str
    signature: str
    result: str
    documentation: str
    streamed: bool
