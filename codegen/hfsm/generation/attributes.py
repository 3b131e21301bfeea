"""Keep the attributes of a component apart: functions, parameters and interfaces all belong to `self`."""

from __future__ import annotations

import keyword
from typing import Final

from ...diagnostics import Diagnostics, Location, Note
from ..checks import COMPONENT_ATTRIBUTES
from ..codes import Code
from ..document import Document, Interface, Parameter

__all__ = ["STANDARD_OPTIONS", "Attributes"]

STANDARD_OPTIONS: Final = frozenset(
    {
        *("realm", "connect", "listen", "mode", "authority", "certificate", "key"),
        *("clock", "timeout", "config", "show_config", "log_level"),
        *("on_error", "on_refused", "seconds", "begin_at", "breakpoint", "stay_halted"),
        *("record", "record_images", "help"),
    }
)
"""Options that the command line of every component has, which no parameter can be called."""


class Attributes:
    """The attributes of one component as they are found; what is called like another is reported."""

    def __init__(self, diagnostics: Diagnostics) -> None:
        self._diagnostics = diagnostics
        self._functions: dict[str, Location] = {}

    def add_functions(self, places: dict[str, Location]) -> None:
        """Add functions by their names with their places."""
        for name, place in places.items():
            if name == "automaton" or name.startswith("_hfsm"):
                message = f"`self.{name}` belongs to every component: rename the function"
                self._diagnostics.error(Code.FUNCTION_NAME_TAKEN, message, place)
            elif name in self._functions:
                first = Note("the first is here", self._functions[name])
                self._diagnostics.error(
                    Code.FUNCTION_NAME_TAKEN, f"a second function is called `{name}`", place, [first]
                )
            self._functions.setdefault(name, place)

    def check_interfaces(self, document: Document, place: Location) -> None:
        """Report interfaces that are called like a function; `place` is that of the document."""
        for interface in document.interfaces:
            if interface.name in self._functions:
                note = Note("the function is here", self._functions[interface.name])
                message = f"`{interface.name}` is both an interface and a function"
                self._diagnostics.error(
                    Code.FUNCTION_NAME_TAKEN, message, _place_of(interface, place), [note]
                )

    def check_parameters(self, document: Document, place: Location) -> None:
        """Report parameters whose name is none, or taken; `place` is that of the document."""
        interfaces = {interface.name: interface for interface in document.interfaces}
        first: dict[str, Parameter] = {}
        for parameter in document.parameters:
            name = parameter.name
            notes: list[Note] = []
            if not name.isidentifier() or not name.isascii() or keyword.iskeyword(name):
                problem = f"`{name[:60]}` cannot be a parameter: a name has ASCII letters, digits and _"
            elif name in COMPONENT_ATTRIBUTES or name.startswith("_"):
                problem = f"`self.{name}` belongs to every component: choose another name"
            elif name in STANDARD_OPTIONS:
                problem = f"`--{name.replace('_', '-')}` is an option of every component: choose another name"
            elif name in first:
                problem = f"a second parameter is called `{name}`"
                notes = [Note("the first is here", _place_of(first[name], place))]
            elif name.startswith("no_") and _is_flag(first.get(name[3:])):
                problem = f"`--no-{name[3:]}` turns the parameter `{name[3:]}` off: choose another name"
                notes = [Note("that parameter is here", _place_of(first[name[3:]], place))]
            elif name in interfaces:
                problem = f"`{name}` is both a parameter and an interface"
                notes = [Note("the interface is here", _place_of(interfaces[name], place))]
            elif name in self._functions:
                problem = f"`{name}` is both a parameter and a function"
                notes = [Note("the function is here", self._functions[name])]
            else:
                problem = ""
            if problem:
                self._diagnostics.error(Code.BAD_PARAMETER, problem, _place_of(parameter, place), notes)
            first.setdefault(name, parameter)


def _is_flag(parameter: Parameter | None) -> bool:
    return parameter is not None and parameter.type.text.strip() == "bool"


def _place_of(item: Parameter | Interface, document: Location) -> Location:
    return Location(item.path or document.path, item.line, max(1, item.column))
