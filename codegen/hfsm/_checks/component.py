"""Check the declarations of a component: its file, policies, libraries, interfaces, functions, parameters.

Interfaces, functions and parameters all become attributes of `self`, and need different names.
"""

from __future__ import annotations

import keyword
import re
import sys
from collections.abc import Collection
from pathlib import Path
from typing import Final

from zenoh_ice.application import hidden_interfaces

from ...diagnostics import Location, Misspelt, Note, did_you_mean
from ...files import is_regular
from ...messages import NO_MESSAGE, Message, any_of
from .._extension import component_path
from ..analysis import Analysis, Piece, imported_names
from ..code._values import EXAMPLES, PARAMETER_TYPES, ValueTextError, parse_value
from ..code.names import COMPONENT_ATTRIBUTES, identifier, is_name
from ..code.text import definitions, library_today, place_of_bound
from ..codes import Code
from ..document import Document, Interface, Parameter, RosInterface
from ..formats.reader import looks_like_document
from ..known_interfaces import KnownInterfaces
from ..report import Report

ON_ERROR: Final = ("stop", "continue")
"""Policies after an error in the code; the first is the default."""

ON_REFUSED: Final = ("pause", "error")
"""Policies when the robot refuses a command; the first is the default."""

STANDARD_OPTIONS: Final = frozenset(
    {
        *("realm", "connect", "listen", "mode", "authority", "certificate", "key"),
        *("clock", "timeout", "config", "show_config", "log_level", "log_file", "log_format"),
        *("on_error", "on_refused", "seconds", "server_wait", "begin_at", "breakpoint", "stay_halted"),
        *("record", "record_images", "help"),
        *("ros", "ros_domain", "ros_connect", "ros_namespace", "remap"),
    }
)
"""Options that every component has, which cannot be names of parameters."""

_LIBRARIES: Final = sys.stdlib_module_names | {
    *("cv2", "lz4", "mcap", "msgpack", "msgspec", "numpy", "rich", "typer", "zenoh", "zstandard"),
    *("hfsm_runtime", "interfaces", "naoserver", "rosbags", "visualhfsm_ros2", "zenoh_ice", "zenoh_ros2"),
}
"""Packages that a component may import, directly or not."""

_HIDEABLE: Final = COMPONENT_ATTRIBUTES - {"automaton"}
"""Attributes of every component that old documents call their own functions."""

_IDENTITY: Final = re.compile(r"[A-Za-z0-9_.\-]+(@[A-Za-z0-9_.\-]+)?")


def check_component(document: Document, known: KnownInterfaces, report: Report) -> None:
    """Check the policies for errors and refused commands, and the interfaces."""
    policies = (("onerror", document.on_error, ON_ERROR), ("onrefused", document.on_refused, ON_REFUSED))
    for element, text, values in policies:
        value = text.text.strip()
        if value not in ("", *values):
            message = Message(
                "`{element}` must be {values}, not `{value}`",
                element=element,
                values=any_of([f"`{each}`" for each in values]),
                value=value[:40],
            )
            report.error(Code.BAD_POLICY, message, report.place(document, text))
    first: dict[str, Interface | RosInterface] = {}
    for each in document.all_interfaces:
        _check_name(each, first, report)
        first.setdefault(each.name, each)
    for interface in document.interfaces:
        if not _IDENTITY.fullmatch(interface.identity):
            message = Message(
                "`{identity}` is not a valid identity of a servant", identity=interface.identity[:60]
            )
            note = Note(Message("use only letters, digits and _ . -; `@realm` may follow"))
            report.error(Code.BAD_IDENTITY, message, interface, [note])
        _check_type(interface, known, report)


def check_file_name(analysis: Analysis, report: Report) -> None:
    """Check that the component's file does not shadow a library."""
    name = identifier(analysis.path.stem, "component")
    imported = analysis.libraries.values()
    if name in _LIBRARIES or name in {library.split(".")[0] for library in imported}:
        message = Message(
            "its component {name}.py would shadow the library `{name}`: rename the document", name=name
        )
        note = Note(
            Message("programs that are started in its directory would import {name}.py instead", name=name)
        )
        report.error(Code.HIDDEN_LIBRARY, message, Location(analysis.path), [note])


def check_neighbors(path: Path, report: Report) -> None:
    """Check that no other document beside this one has a component in the same file."""
    target = component_path(path, None)
    try:
        others = sorted(each for each in path.parent.iterdir() if each.suffix.lower() == ".xml")
    except OSError:
        return
    for other in others:
        is_same = other.name != path.name and component_path(other, None) == target
        if is_same and is_regular(other) and looks_like_document(other):
            message = Message(
                "{other} has the same component, {target}: rename one of them",
                other=other.name,
                target=target.name,
            )
            report.error(Code.SAME_COMPONENT, message, Location(path))


def check_hidden_interfaces(analysis: Analysis, report: Report) -> None:
    """Check that no module hides the package `interfaces` from the component, which looks beside it first."""
    target = component_path(analysis.path, analysis.output)
    if hidden := hidden_interfaces([str(target.parent.resolve())]):
        report.error(Code.HIDDEN_INTERFACES, Message.verbatim(hidden), Location(analysis.path))


def check_libraries(analysis: Analysis, reserved: Collection[str], report: Report) -> None:
    """Check that no library has a name that is `reserved` for the component."""
    for each in analysis.imports:
        for name in sorted(imported_names(each.node).keys() & reserved):
            message = Message("`{name}` is a reserved name: choose another", name=name)
            place = Location(each.library.path or analysis.path, each.library.name.line)
            report.error(Code.RESERVED_NAME, message, place)
        old = each.library.name.text.strip()
        if (today := library_today(old)) != old:
            message = Message("`{old}` is `{today}` now", old=old, today=today)
            notes = [
                Note(Message("`visualhfsm convert` writes it so"), misspelt=Misspelt(old, today, "name"))
            ]
            report.warning(Code.OLD_LIBRARY, message, each.library, notes)


def check_functions(analysis: Analysis, report: Report) -> dict[str, Location]:
    """Check that the names of functions are unique; return the place of each function."""
    first: dict[str, Location] = {}
    for piece in analysis.all_functions:
        _check_bound(piece, report)
        for node in definitions(piece.tree):
            name, place = node.name, Location(piece.path, piece.code.line + node.lineno - 1)
            if name in first:
                note = Note(Message("the first is here"), first[name])
                message = Message("a second function has the name `{name}`", name=name)
                report.error(Code.FUNCTION_NAME_TAKEN, message, place, [note])
            first.setdefault(name, place)
    for interface in analysis.document.all_interfaces:
        if interface.name in first:
            note = Note(Message("the function is here"), first[interface.name])
            message = Message("`{interface}` is both an interface and a function", interface=interface.name)
            report.error(Code.FUNCTION_NAME_TAKEN, message, interface, [note])
    for access in analysis.accesses:
        if access.is_stored and access.name in _HIDEABLE:
            _warn_of_hidden(access.name, access.place(0), report)
    return first


def _check_bound(piece: Piece, report: Report) -> None:
    """Check what functions, and other statements among them, call attributes of the component."""
    for name in sorted(piece.bound):
        taken = name == "automaton" or name.startswith("_hfsm")
        if not taken and name not in _HIDEABLE:
            continue
        line, column = piece.code.place(*place_of_bound(name, piece.tree, piece.code))
        place = Location(piece.path, line, column, len(name))
        if taken:
            message = Message("`self.{name}` belongs to every component: choose another name", name=name)
            report.error(Code.FUNCTION_NAME_TAKEN, message, place)
        else:
            _warn_of_hidden(name, place, report)


def _warn_of_hidden(name: str, place: Location, report: Report) -> None:
    message = Message("this takes the place of the `self.{name}` of every component: rename it", name=name)
    report.warning(Code.HIDDEN_ATTRIBUTE, message, place)


def check_parameters(document: Document, functions: dict[str, Location], report: Report) -> None:
    """Check names, types and defaults of parameters; `functions` are those of the document."""
    interfaces = {interface.name: interface for interface in document.all_interfaces}
    first: dict[str, Parameter] = {}
    for parameter in document.parameters:
        name = parameter.name
        notes: list[Note] = []
        problem = NO_MESSAGE
        if not name.isidentifier() or not name.isascii() or keyword.iskeyword(name):
            problem = Message(
                "`{name}` cannot be a parameter: use only ASCII letters, digits and _", name=name[:60]
            )
        elif name in COMPONENT_ATTRIBUTES or name.startswith("_"):
            problem = Message("`self.{name}` belongs to every component: choose another name", name=name)
        elif name in STANDARD_OPTIONS:
            problem = Message(
                "`--{name}` is an option of every component: choose another name", name=name.replace("_", "-")
            )
        elif name in first:
            problem = Message("a second parameter has the name `{name}`", name=name)
            notes = [report.first(first[name])]
        elif name.startswith("no_") and _is_flag(first.get(name[3:])):
            problem = Message(
                "`--no-{name}` turns the parameter `{name}` off: choose another name", name=name[3:]
            )
            notes = [Note(Message("that parameter is here"), report.place(first[name[3:]]))]
        elif name in interfaces:
            problem = Message("`{name}` is both a parameter and an interface", name=name)
            notes = [Note(Message("the interface is here"), report.place(interfaces[name]))]
        elif name in functions:
            problem = Message("`{name}` is both a parameter and a function", name=name)
            notes = [Note(Message("the function is here"), functions[name])]
        if problem:
            report.error(Code.BAD_PARAMETER, problem, parameter, notes)
        first.setdefault(name, parameter)
        _check_default(parameter, report)


def _check_default(parameter: Parameter, report: Report) -> None:
    type_name = parameter.type.text.strip()
    wrong = parameter.type
    if type_name not in PARAMETER_TYPES:
        known = ", ".join(PARAMETER_TYPES)
        problem = Message("its type must be one of {known}", known=known)
        if type_name:
            problem = Message(
                "its type must be one of {known}, not `{type}`", known=known, type=type_name[:40]
            )
    else:
        wrong = parameter.default
        try:
            if not wrong.is_blank:
                parse_value(type_name, wrong)
                return
            example = EXAMPLES[type_name]
            problem = Message("it has no default: write one, such as `{example}`", example=example)
        except ValueTextError as error:
            problem = error.message
    where = parameter if wrong.is_blank else wrong
    place = Location(report.place(parameter).path, where.line, max(1, where.column))
    message = Message("the parameter `{name}`: {problem}", name=parameter.name, problem=problem)
    report.error(Code.BAD_PARAMETER, message, place)


def _is_flag(parameter: Parameter | None) -> bool:
    return parameter is not None and parameter.type.text.strip() == "bool"


def _check_name(
    interface: Interface | RosInterface, first: dict[str, Interface | RosInterface], report: Report
) -> None:
    name = interface.name
    place = report.place(interface)
    if not is_name(name):
        message = Message(
            "`{name}` cannot be an attribute of `self`: use only letters, digits and _", name=name
        )
        report.error(Code.BAD_INTERFACE_NAME, message, place)
    elif name in COMPONENT_ATTRIBUTES or name.startswith("_"):
        message = Message("`self.{name}` belongs to every component: choose another", name=name)
        report.error(Code.BAD_INTERFACE_NAME, message, place)
    elif name in first:
        message = Message("a second interface has the name `{name}`", name=name)
        report.error(Code.BAD_INTERFACE_NAME, message, place, [report.first(first[name])])


def _check_type(interface: Interface, known: KnownInterfaces, report: Report) -> None:
    found = known.find(interface.type)
    if len(found) == 1:
        return
    place = report.place(interface)
    if found:
        names = any_of([f"`{candidate.scoped_name}`" for candidate in found])
        message = Message("`{type}` is ambiguous: write {names}", type=interface.type, names=names)
        report.error(Code.UNKNOWN_INTERFACE, message, place)
        return
    if not interface.type.strip():
        message = Message(
            "the interface `{name}` has no type: write one, such as `Camera`", name=interface.name
        )
        report.error(Code.UNKNOWN_INTERFACE, message, place)
        return
    notes = [
        *did_you_mean(interface.type, known.by_name, "type"),
        Note(Message("run codegen on its IDL; proxies outside the package `interfaces` are found with -I")),
    ]
    message = Message("there is no proxy for an interface `{type}`", type=interface.type)
    report.error(Code.UNKNOWN_INTERFACE, message, place, notes)
