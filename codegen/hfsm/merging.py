"""Bring together what documents declare for a whole component: libraries, interfaces, parameters, events."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from ..diagnostics import Diagnostics, Location, Note
from .code.python import analyze_library
from .code.text import CodeError
from .code.trees import parse_python
from .document import Document, Event, Interface, Library, Parameter

__all__ = ["merge"]

_N = TypeVar("_N", Interface, Parameter, Event)


def merge(document: Document, other: Document, path: Path, diagnostics: Diagnostics) -> Document:
    """Return a document with what another one declares; what both declare is there once.

    What they declare differently under one name is reported. `path` is where the document lies.
    """
    merger = _Merger(path, diagnostics)
    return replace(
        document,
        libraries=merger.libraries(document.libraries, other.libraries),
        interfaces=merger.named("interface", document.interfaces, other.interfaces, _servant),
        parameters=merger.named("parameter", document.parameters, other.parameters, _value),
        events=merger.named("event", document.events, other.events, lambda _: ()),
    )


def _servant(interface: Interface) -> object:
    return interface.identity.strip(), interface.type.strip()


def _value(parameter: Parameter) -> object:
    return parameter.type.text.strip(), parameter.default.text.strip()


class _Merger:
    def __init__(self, path: Path, diagnostics: Diagnostics) -> None:
        self._path = path
        self._diagnostics = diagnostics

    def named(
        self, kind: str, own: tuple[_N, ...], others: tuple[_N, ...], meaning: Callable[[_N], object]
    ) -> tuple[_N, ...]:
        """Return both lists with each name once; `meaning` is what must be the same of one name."""
        known = {item.name: item for item in own}
        new: list[_N] = []
        for item in others:
            if item.name not in known:
                new.append(item)
            elif meaning(item) != meaning(known[item.name]):
                message = f"the {kind} `{item.name}` is another one than that of the same name"
                self._conflict(message, self._place(item), self._place(known[item.name]))
        return own + tuple(new)

    def libraries(self, own: tuple[Library, ...], others: tuple[Library, ...]) -> tuple[Library, ...]:
        """Return both lists; a name that they bind to different things is reported."""
        written = {library.name.text.strip() for library in own}
        known: dict[str, tuple[tuple[str, ...], Library]] = {}
        for library in own:
            known.update({name: (target, library) for name, target in _bindings(library)})
        new: list[Library] = []
        for library in others:
            if library.name.text.strip() in written:
                continue
            new.append(library)
            for name, target in _bindings(library):
                if name in known and known[name][0] != target:
                    message = f"the library `{library.name.text.strip()}` and another one are both `{name}`"
                    self._conflict(message, self._place(library), self._place(known[name][1]))
        return (*own, *new)

    def _conflict(self, message: str, place: Location, other: Location) -> None:
        self._diagnostics.error("E553", message, place, [Note("the other one is here", other)])

    def _place(self, item: Interface | Parameter | Event | Library) -> Location:
        return Location(item.path or self._path, item.line, max(1, item.column))


def _bindings(library: Library) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield the names that a library binds with what each stands for; nothing for what is not imported."""
    if not library.is_module:
        return
    try:
        statement, _ = analyze_library(library.name)
    except CodeError:
        return  # told when the code is analyzed
    for node in parse_python(statement).body:
        if isinstance(node, ast.Import):
            for alias in node.names:
                module = alias.name if alias.asname else alias.name.split(".")[0]
                yield alias.asname or module, (module,)
        elif isinstance(node, ast.ImportFrom):
            yield from ((alias.asname or alias.name, (node.module or "", alias.name)) for alias in node.names)
