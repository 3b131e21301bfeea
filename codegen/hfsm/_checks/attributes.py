"""Check every use of `self`: unknown attributes, wrong calls of its proxies, and old names."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Mapping
from typing import Final

from ...diagnostics import Location, Note, did_you_mean
from ...messages import Message
from ..analysis import Access, Analysis, Piece
from ..calls import check_call
from ..code.names import COMPONENT_ALIASES, COMPONENT_ATTRIBUTES
from ..code.text import all_nodes
from ..codes import Code
from ..known_interfaces import DescriptionError, KnownInterface, KnownInterfaces, Operation
from ..report import Report

_BEGIN: Final = "begin"
"""Calls an operation without waiting, with the same parameters."""

STREAM: Final = {
    "latest": Operation("latest", (), 0),
    "wait": Operation("wait", ("after", "timeout"), 0),
    "samples": Operation("samples", ("timeout",), 0, by_name=frozenset({"rate"})),
    "subscribe": Operation("subscribe", ("callback",), 1, by_name=frozenset({"rate", "queue"})),
}
"""The attributes of a streamed operation in addition to its calls."""


_OF_EVERY_PROXY: Final = frozenset({"checkedCast", "uncheckedCast"})


def check_attributes(analysis: Analysis, known: KnownInterfaces, report: Report) -> None:
    """Check every use of `self`."""
    document, found = analysis.document, analysis.accesses
    assigned = {access.name for access in found if access.is_stored}
    extension = analysis.extension
    given = assigned | analysis.defined | (extension.attributes if extension is not None else set())
    proxies: dict[str, KnownInterface] = {}
    for interface in document.interfaces:
        candidates = known.find(interface.type)
        if len(candidates) == 1 and interface.name not in given:
            proxies.setdefault(interface.name, candidates[0])
    for alias, name in document.proxy_aliases.items():
        if name in proxies and alias not in given:
            proxies.setdefault(alias, proxies[name])
    if not (extension is not None and extension.is_open) and not any(
        map(_sets_attributes_by_name, analysis.pieces)
    ):
        names = {
            *COMPONENT_ATTRIBUTES,
            *COMPONENT_ALIASES,
            *given,
            *(interface.name for interface in document.all_interfaces),
            *(["ros"] if document.ros else []),
            *document.proxy_aliases,
            *document.ros_aliases,
            *analysis.old_names.reserved,
            *(parameter.name for parameter in document.parameters),
        }
        _check_known(found, names, known, report)
    _check_calls(analysis, proxies, known, report)


def _sets_attributes_by_name(piece: Piece) -> bool:
    """Return whether code may define attributes whose names it does not contain."""
    for node in all_nodes(piece.tree):
        match node:
            case ast.Name(id="setattr" | "vars") | ast.Attribute(attr="__dict__" | "__setattr__"):
                return True
            case ast.FunctionDef(name="__getattr__" | "__getattribute__"):
                return True
    return False


def _check_known(found: Iterable[Access], names: set[str], known: KnownInterfaces, report: Report) -> None:
    for access in found:
        name = access.name
        if name in names or name.startswith("__"):
            continue
        notes: list[Note] = []
        if len(access.path) > 1 and (interface := _guess(name, known)):
            advice = Message(
                "a proxy of `{interface}` has to be declared as an interface", interface=interface
            )
            notes.append(Note(advice))
        notes += did_you_mean(name, names, "")
        message = Message(
            "`self.{name}` is not an interface, function or parameter, and is never assigned", name=name
        )
        report.warning(Code.UNKNOWN_ATTRIBUTE, message, access.place(0), notes)


def _guess(name: str, known: KnownInterfaces) -> str | None:
    candidates = known.find(name) or known.find(name.removesuffix("Prx"))
    return candidates[0].scoped_name if candidates else None


def _check_calls(
    analysis: Analysis, proxies: Mapping[str, KnownInterface], known: KnownInterfaces, report: Report
) -> None:
    operations: dict[str, dict[str, Operation] | None] = {}
    for access in analysis.accesses:
        interface = proxies.get(access.name)
        if interface is None or len(access.path) < 2 or not _is_operation(access.path[1]):
            continue
        if access.name not in operations:
            try:
                operations[access.name] = known.operations(interface)
            except DescriptionError:  # which the model checker reports
                operations[access.name] = None
        available = operations[access.name]
        if available is None:
            continue
        operation = available.get(access.path[1])
        if access.path[1] in analysis.old_names.clients.get(interface.scoped_name, ()):
            _note_client_method(access, report)
        elif operation is None:
            message = Message(
                "`{interface}` has no operation `{name}`",
                interface=interface.scoped_name,
                name=access.path[1],
            )
            notes = did_you_mean(access.path[1], available, "")
            report.warning(Code.UNKNOWN_OPERATION, message, access.place(1), notes)
        elif len(access.path) == 2:
            check_call(access, operation, report)
        else:
            _check_stream(access, operation, report)


def _note_client_method(access: Access, report: Report) -> None:
    method = access.path[1]
    message = Message(
        "`{method}` is a method of JdeRobot's library for clients, and no operation of the interface",
        method=method,
    )
    report.note(Code.OLD_NAME, message, access.place(1))


def _is_operation(name: str) -> bool:
    return not name.startswith(("ice_", "__")) and name not in _OF_EVERY_PROXY


def _check_stream(access: Access, operation: Operation, report: Report) -> None:
    name = access.path[2]
    if name.startswith("__"):
        return
    if name == _BEGIN:
        if len(access.path) == 3:
            check_call(access, operation, report)
    elif not operation.is_streamed:
        message = Message(
            "`{operation}` is not streamed and has no `{name}`: it can only be called",
            operation=operation.name,
            name=name,
        )
        report.warning(Code.UNKNOWN_OPERATION, message, access.place(2))
    elif name not in STREAM:
        message = Message(
            "a streamed operation has no `{name}`: it has {offered}",
            name=name,
            offered=", ".join([_BEGIN, *STREAM]),
        )
        report.warning(Code.UNKNOWN_OPERATION, message, access.place(2), did_you_mean(name, STREAM, ""))
    elif len(access.path) == 3:
        check_call(access, STREAM[name], report)


# Names of the original generators


def check_old_names(analysis: Analysis, report: Report) -> None:
    """Report each such name once, at its first use: people who did not expect it may have mistyped."""
    if analysis.document.is_old:
        return
    old = analysis.old_names
    for name, module in old.modules.items():
        if place := _first_read(analysis, name):
            message = Message(
                "`{name}` is imported, as the editor of 2017 did: add the library `{module}`",
                name=name,
                module=module,
            )
            report.note(Code.OLD_NAME, message, place)
    meanings = {alias: Message.verbatim(f"`self.{name}`") for alias, name in old.aliases.items()}
    meanings |= {name: given.meaning for name, given in old.attributes.items()}
    for name, meaning in meanings.items():
        place = next((each.place(0) for each in analysis.accesses if each.name == name), None)
        if place is not None:
            message = Message(
                "`self.{name}` is {meaning}, as in the components of 2017", name=name, meaning=meaning
            )
            report.note(Code.OLD_NAME, message, place)


def _first_read(analysis: Analysis, name: str) -> Location | None:
    """Return the place of the first use of a name of the file."""
    for piece in analysis.pieces:
        for node in all_nodes(piece.tree) if name in piece.free else ():
            if isinstance(node, ast.Name) and node.id == name:
                return piece.place(node)
    return None
