"""Check policies and interfaces, and every use of `self`: attributes and calls that there are none of."""

from __future__ import annotations

import ast
import keyword
import re
import sys
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final

from ...diagnostics import Location, Note, did_you_mean
from ..analysis import COMPONENT_ALIASES, Access, Analysis, Piece
from ..code.names import identifier
from ..code.text import all_nodes, parse_python
from ..codes import Code
from ..document import Document, Interface
from ..known_interfaces import KnownInterface, KnownInterfaces
from .report import Report

__all__ = [
    "COMPONENT_ATTRIBUTES",
    "ON_ERROR",
    "ON_REFUSED",
    "STREAM",
    "check_attributes",
    "check_component",
    "check_file_name",
]

ON_ERROR: Final = ("stop", "continue")
"""What a component may do after an error in its code; the first is the default."""

ON_REFUSED: Final = ("pause", "error")
"""What a component may do when the robot refuses a command; the first is the default."""

COMPONENT_ATTRIBUTES: Final = frozenset({"automaton", "clock", "log", "mark", "send", "sleep"})
"""Attributes that every component has. A function of a document may be called like one, and wins."""

_LIBRARIES: Final = sys.stdlib_module_names | {
    *("cv2", "lz4", "mcap", "msgpack", "msgspec", "numpy", "rich", "typer", "zenoh", "zstandard"),
    *("hfsm_recording", "hfsm_runtime", "interfaces", "startup", "zenoh_ice"),
}
"""What a component may import, itself or by what it imports."""

_IDENTITY: Final = re.compile(r"[A-Za-z0-9_.\-]+(@[A-Za-z0-9_.\-]+)?")


def check_component(document: Document, known: KnownInterfaces, report: Report) -> None:
    """Check the policies for errors and refused commands, and the interfaces."""
    policies = (("onerror", document.on_error, ON_ERROR), ("onrefused", document.on_refused, ON_REFUSED))
    for element, text, values in policies:
        value = text.text.strip()
        if value not in ("", *values):
            message = f"`{element}` is {' or '.join(f'`{each}`' for each in values)}, not `{value[:40]}`"
            report.error(Code.BAD_POLICY, message, report.place(document, text))
    first: dict[str, Interface] = {}
    for interface in document.interfaces:
        _check_name(interface, first, report)
        first.setdefault(interface.name, interface)
        if not _IDENTITY.fullmatch(interface.identity):
            message = f"`{interface.identity[:60]}` cannot be the identity of a servant"
            note = Note("an identity has letters, digits and _ . -; `@realm` may follow it")
            report.error(Code.BAD_IDENTITY, message, report.place(interface), [note])
        _check_type(interface, known, report)


def check_file_name(path: Path, imported: Iterable[str], report: Report) -> None:
    """Check that the component's file hides no library; `imported` are those of the document, dotted."""
    name = identifier(path.stem, "component")
    if name in _LIBRARIES or name in {library.split(".")[0] for library in imported}:
        message = f"its component {name}.py would hide the library `{name}`: rename the document"
        note = Note(f"programs that are started in its directory import {name}.py instead, and most fail")
        report.warning(Code.HIDDEN_LIBRARY, message, Location(path), [note])


def is_attribute(name: str) -> bool:
    """Return whether Python takes a name as it is written: it reads some characters as others."""
    normal = unicodedata.normalize("NFKC", name)
    return name.isidentifier() and not keyword.iskeyword(name) and name == normal


def _check_name(interface: Interface, first: dict[str, Interface], report: Report) -> None:
    name = interface.name
    place = report.place(interface)
    if not is_attribute(name):
        message = f"`{name}` cannot be an attribute of `self`: a name has letters, digits and _"
        report.error(Code.BAD_INTERFACE_NAME, message, place)
    elif name in COMPONENT_ATTRIBUTES or name.startswith("_"):
        report.error(
            Code.BAD_INTERFACE_NAME, f"`self.{name}` belongs to every component: choose another", place
        )
    elif name in first:
        report.error(
            Code.BAD_INTERFACE_NAME,
            f"a second interface is called `{name}`",
            place,
            [report.first(first[name])],
        )


def _check_type(interface: Interface, known: KnownInterfaces, report: Report) -> None:
    found = known.find(interface.type)
    if len(found) == 1:
        return
    place = report.place(interface)
    if found:
        names = ", ".join(f"`{candidate.scoped_name}`" for candidate in found)
        report.error(Code.UNKNOWN_INTERFACE, f"`{interface.type}` may be {names}: write which", place)
        return
    if not interface.type.strip():
        report.error(
            Code.UNKNOWN_INTERFACE,
            f"the interface `{interface.name}` has no type: say which, such as `Camera`",
            place,
        )
        return
    notes = [
        *did_you_mean(interface.type, known.by_name),
        Note("run codegen on its IDL; proxies outside the package `interfaces` are found with -I"),
    ]
    report.error(
        Code.UNKNOWN_INTERFACE, f"there is no proxy for an interface `{interface.type}`", place, notes
    )


_BASE: Final = "ice.ObjectPrx"
"""The proxy class that all others extend; its own methods begin with `ice_`."""
_MAX_BASES: Final = 100


@dataclass(frozen=True, slots=True)
class Operation:
    """A method of a proxy: its parameters after `self`, how many of them have no default, and its stream."""

    name: str
    parameters: tuple[str, ...]
    required: int
    is_streamed: bool = False
    by_name: frozenset[str] = frozenset()
    """Further parameters, which are given by name."""


_BEGIN: Final = "begin"
"""What calls an operation without waiting, with the parameters of the call."""

STREAM: Final = {
    "latest": Operation("latest", (), 0),
    "wait": Operation("wait", ("after", "timeout"), 0),
    "samples": Operation("samples", ("timeout",), 0, by_name=frozenset({"rate"})),
    "subscribe": Operation("subscribe", ("callback",), 1, by_name=frozenset({"rate", "queue"})),
}
"""What a streamed operation offers beside its calls."""


def operations_of(interface: KnownInterface) -> dict[str, Operation] | None:
    """Return the operations of an interface with those that it inherits, by the names of their methods.

    None when not all of them are known: a proxy that was written by hand may do anything.
    """
    found: dict[str, Operation] = {}
    pending = [(interface.file, interface.proxy)]
    seen: set[tuple[Path, str]] = set()
    while pending:
        file, name = pending.pop()
        if (file, name) in seen or len(seen) > _MAX_BASES:
            continue
        seen.add((file, name))
        module = _module(file)
        if module is None:
            return None
        proxy = module.classes.get(name)
        if proxy is None:
            source = module.imports.get(name)
            if source is None:
                return None
            pending.append(source)
            continue
        for operation in _methods(proxy):
            found.setdefault(operation.name, operation)
        for base in proxy.bases:
            if isinstance(base, ast.Name):
                pending.append((file, base.id))
            elif ast.unparse(base) != _BASE:
                return None
    return found or None


@dataclass(frozen=True, slots=True)
class _Module:
    classes: dict[str, ast.ClassDef]
    imports: dict[str, tuple[Path, str]]


def _module(file: Path) -> _Module | None:
    try:
        return _parse(file, file.stat().st_mtime_ns)
    except (OSError, SyntaxError, ValueError):  # then nothing is known of it
        return None


@lru_cache(maxsize=64)
def _parse(file: Path, _changed: int) -> _Module:
    tree = parse_python(file.read_bytes())
    classes = {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}
    imports: dict[str, tuple[Path, str]] = {}
    for node in tree.body:
        if isinstance(node, ast.ImportFrom) and node.level:
            directory = file.parents[node.level - 1]
            source = directory.joinpath(*(node.module or "__init__").split("."))
            target = source / "__init__.py" if source.is_dir() else source.with_suffix(".py")
            imports.update({alias.asname or alias.name: (target, alias.name) for alias in node.names})
    return _Module(classes, imports)


def _methods(proxy: ast.ClassDef) -> list[Operation]:
    found = []
    for node in proxy.body:
        if not isinstance(node, ast.FunctionDef) or node.args.vararg or node.args.kwarg:
            continue
        names = [argument.arg for argument in node.args.args[1:]]
        required = len(names) - len(node.args.defaults)
        streamed = any(
            isinstance(decorator, ast.Call)
            and isinstance(decorator.func, ast.Attribute)
            and decorator.func.attr == "stream"
            for decorator in node.decorator_list
        )
        found.append(Operation(node.name, tuple(names), required, streamed))
    return found


_OF_EVERY_PROXY: Final = frozenset({"checkedCast", "uncheckedCast"})


def check_attributes(analysis: Analysis, known: KnownInterfaces, report: Report) -> None:
    """Check every use of `self`."""
    document, found = analysis.document, analysis.accesses
    assigned = {access.name for access in found if access.is_stored}
    given = assigned | analysis.defined | analysis.extension.attributes
    proxies: dict[str, KnownInterface] = {}
    for interface in document.interfaces:
        candidates = known.find(interface.type)
        if len(candidates) == 1 and interface.name not in given:
            proxies.setdefault(interface.name, candidates[0])
    for alias, name in document.proxy_aliases.items():
        if name in proxies and alias not in given:
            proxies.setdefault(alias, proxies[name])
    if not analysis.extension.is_open and not any(map(_sets_attributes_by_name, analysis.pieces)):
        names = {
            *COMPONENT_ATTRIBUTES,
            *COMPONENT_ALIASES,
            *given,
            *(interface.name for interface in document.interfaces),
            *document.proxy_aliases,
            *(["lock"] if document.is_old else []),
            *(parameter.name for parameter in document.parameters),
        }
        _check_known(found, names, known, report)
    _check_calls(found, proxies, report)


def _sets_attributes_by_name(piece: Piece) -> bool:
    """Return whether code may give the component attributes whose names do not stand in it."""
    for node in all_nodes(piece.tree):
        match node:
            case ast.Name(id="setattr" | "vars") | ast.Attribute(attr="__dict__" | "__setattr__"):
                return True
            case ast.FunctionDef(name="__getattr__" | "__getattribute__"):
                return True
    return False


def _check_known(found: Iterable[Access], names: set[str], known: KnownInterfaces, report: Report) -> None:
    told: set[str] = set()
    for access in found:
        name = access.name
        if name in names or name in told or name.startswith("__"):
            continue
        told.add(name)
        notes = list(did_you_mean(name, names))
        if len(access.path) > 1 and (interface := _guess(name, known)):
            notes.append(Note(f"a proxy of `{interface}` has to be declared among the interfaces"))
        message = f"`self.{name}` is no interface, function or parameter, and nothing assigns it"
        report.warning(Code.UNKNOWN_ATTRIBUTE, message, _place(access, 0), notes)


def _guess(name: str, known: KnownInterfaces) -> str | None:
    candidates = known.find(name) or known.find(name.removesuffix("Prx"))
    return candidates[0].scoped_name if candidates else None


def _check_calls(found: Iterable[Access], proxies: Mapping[str, KnownInterface], report: Report) -> None:
    operations: dict[str, dict[str, Operation] | None] = {}
    for access in found:
        interface = proxies.get(access.name)
        if interface is None or len(access.path) < 2 or not _is_operation(access.path[1]):
            continue
        if access.name not in operations:
            operations[access.name] = operations_of(interface)
        available = operations[access.name]
        if available is None:
            continue
        operation = available.get(access.path[1])
        if operation is None:
            message = f"`{interface.scoped_name}` has no operation `{access.path[1]}`"
            notes = did_you_mean(access.path[1], available)
            report.warning(Code.UNKNOWN_OPERATION, message, _place(access, 1), notes)
        elif len(access.path) == 2:
            _check_arguments(access, operation, report)
        else:
            _check_stream(access, operation, report)


def _is_operation(name: str) -> bool:
    return not name.startswith(("ice_", "__")) and name not in _OF_EVERY_PROXY


def _check_stream(access: Access, operation: Operation, report: Report) -> None:
    name = access.path[2]
    if name.startswith("__"):
        return
    if name == _BEGIN:
        if len(access.path) == 3:
            _check_arguments(access, operation, report)
    elif not operation.is_streamed:
        message = f"`{operation.name}` is not streamed, and has no `{name}`: it can only be called"
        report.warning(Code.UNKNOWN_OPERATION, message, _place(access, 2))
    elif name not in STREAM:
        message = f"a streamed operation has no `{name}`: it has {', '.join([_BEGIN, *STREAM])}"
        report.warning(Code.UNKNOWN_OPERATION, message, _place(access, 2), did_you_mean(name, STREAM))
    elif len(access.path) == 3:
        _check_arguments(access, STREAM[name], report)


def _check_arguments(access: Access, operation: Operation, report: Report) -> None:
    call = access.call
    if call is None or any(isinstance(argument, ast.Starred) for argument in call.args):
        return
    names = [keyword.arg for keyword in call.keywords]
    if None in names:
        return
    parameters = operation.parameters
    given = parameters[: len(call.args)]
    wrong = next((name for name in names if name not in parameters and name not in operation.by_name), None)
    missing = [name for name in parameters[: operation.required] if name not in (*given, *names)]
    if len(call.args) > len(parameters):
        message = f"`{operation.name}` takes {_count(parameters)}, and is given {len(call.args)}"
    elif wrong is not None:
        message = f"`{operation.name}` has no parameter `{wrong}`"
    elif missing:
        message = f"`{operation.name}` is not given {' and '.join(f'`{name}`' for name in missing)}"
    elif repeated := [name for name in names if name in given]:
        message = f"`{operation.name}` is given `{repeated[0]}` twice"
    else:
        return
    note = Note(f"it is called as `{operation.name}({', '.join(parameters)})`")
    report.warning(Code.BAD_CALL, message, _place(access, -1), [note])


def _count(parameters: Sequence[str]) -> str:
    return {0: "no argument", 1: "1 argument"}.get(len(parameters), f"{len(parameters)} arguments")


def _place(access: Access, index: int) -> Location:
    return access.piece.place_of_attribute(access.nodes[index])
