"""Check what a component declares: the name of its file, its policies and its interfaces."""

from __future__ import annotations

import keyword
import re
import sys
import unicodedata
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from ...diagnostics import Location, Note, did_you_mean
from ..code.names import identifier
from ..codes import Code
from ..document import Document, Interface
from ..known_interfaces import KnownInterfaces
from .report import Report

__all__ = ["COMPONENT_ATTRIBUTES", "ON_ERROR", "ON_REFUSED", "check_component", "check_file_name"]

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
