"""Choose unique Python names for the definitions of a Slice file."""

from __future__ import annotations

import builtins
import enum
import keyword
import re
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

from ..python_layout import LINE_LENGTH, bracketed, source_order
from . import ast

Package = tuple[str, ...]
"""The path of a package, from the directory that is generated into."""

_RUNTIME = "zenoh_ice", "generated", "ice"  # package, module, and its name in generated modules

# As in Ice's mapping to Python, a name that is reserved by Python or the base class gets a leading
# underscore. Names in Slice neither start nor end with one, so these names, and those below with a
# trailing underscore, are unique.
_BASE_CLASS_NAMES: dict[type[ast.Definition], frozenset[str]] = {
    ast.Enumerator: frozenset(name for name in {*dir(int), *dir(enum.IntEnum), "mro", "name", "value"}),
    ast.Operation: frozenset({"checkedCast", "uncheckedCast"}),
    ast.Parameter: frozenset({"self"}),
}
_EXCEPTION_NAMES = frozenset({*dir(Exception), "Members", "self"})


def python_name(definition: ast.Definition) -> str:
    """Return the name of a definition in Python."""
    name = definition.name
    if keyword.iskeyword(name) or name in _BASE_CLASS_NAMES.get(type(definition), ()):
        return f"_{name}"
    return name


def exception_member_name(member: ast.Member) -> str:
    """Return the name of a member of an exception in Python."""
    if member.name in _EXCEPTION_NAMES or member.name.startswith("ice_"):
        return f"_{member.name}"
    return python_name(member)


def module_package(module: str) -> Package:
    """Return the path of packages for a scoped module name: `a::b` is `("a", "b")`."""
    parts = module.split("::")
    return tuple(f"_{part}" if keyword.iskeyword(part) else part for part in parts)


def slice_module(package: Package) -> str:
    """Return the scoped module name for a path of packages."""
    return "::".join(part.removeprefix("_") for part in package)


def file_module(path: Path, taken: Iterable[str]) -> str:
    """Return the name of the Python module for an IDL file, in lower case and not in `taken`."""
    name = re.sub(r"\W", "_", path.stem.lower())
    if not name or name[0].isdigit() or keyword.iskeyword(name) or name == "__init__":
        name = f"_{name}"
    return f"{name}_idl" if name in set(taken) else name


class ModuleNames:
    """The names in one generated module: its imports, and their local names.

    An import gets a trailing underscore, `from typing import Final as Final_`, if the module defines the same
    name, or if a class has a member of this name, which later annotations would refer to.
    """

    def __init__(self, package: Package, definitions: Iterable[ast.Definition]) -> None:
        self._package = package
        self._imports: defaultdict[str, dict[str, str]] = defaultdict(dict)
        self._needs_builtins = False
        self._shadowed: set[str] = set()
        self._defined: set[str] = set()
        self._external: dict[str, str] = {}
        for definition in definitions:
            self._defined |= exported_names(definition)
            match definition:
                case ast.Struct() | ast.Derivable():
                    self._shadowed.update(map(python_name, definition.members))
                case ast.Enumeration():
                    self._shadowed.update(map(python_name, definition.enumerators))
                case ast.Interface():
                    self._shadowed.update(map(python_name, definition.operations))
                    self._shadowed.update(f"{each.name}Publisher" for each in definition.operations)

    @property
    def _builtins(self) -> str:
        taken = "builtins" in self._shadowed or "builtins" in self._defined
        return "builtins_" if taken else "builtins"

    def builtin(self, name: str) -> str:
        """Return a builtin as it is written in this module."""
        assert hasattr(builtins, name)
        if name in self._shadowed or name in self._defined:
            self._needs_builtins = True
            return f"{self._builtins}.{name}"
        return name

    def imported(self, module: str, name: str) -> str:
        """Import `name` from `module` and return its local name."""
        local = name
        if name in self._defined:
            local = f"{self.defined(name)}_"  # a second underscore if the definition has one
        elif name in self._shadowed:
            local = f"{name}_"
        if self._external.setdefault(local, module) != module:  # the same name in two modules
            local = f"{module.strip('.').replace('.', '_')}_{name}_"
        self._imports[module][name] = local
        return local

    def runtime(self, name: str) -> str:
        """Import the run-time library and return a name from it as it is written in this module."""
        package, module, known_as = _RUNTIME
        if known_as in self._shadowed or known_as in self._defined:
            known_as += "_"
        self._imports[package][module] = known_as
        return f"{known_as}.{name}"

    def defined(self, name: str) -> str:
        """Return a definition of this module as it is written in annotations of its classes."""
        return f"{name}_" if self.is_shadowed(name) else name

    def is_shadowed(self, name: str) -> bool:
        """Return whether a member of a class or a builtin has the name of this definition.

        A type checker uses the builtin if the definition comes later.
        """
        return name in self._shadowed or hasattr(builtins, name)

    def import_lines(self) -> list[str]:
        """Return the import statements, grouped like isort."""
        groups: list[list[str]] = [["from __future__ import annotations"], [], [], []]
        if self._needs_builtins:
            groups[1].append(
                "import builtins" if self._builtins == "builtins" else "import builtins as builtins_"
            )

        def distance(module: str) -> tuple[int, str]:
            dots = len(module) - len(module.lstrip("."))
            return -dots, module

        for module in sorted(self._imports, key=distance):
            names = self._imports[module]
            items = [
                name if names[name] == name else f"{name} as {names[name]}" for name in source_order(names)
            ]
            group = 1
            if module.startswith("."):
                group = 3
            elif module == _RUNTIME[0]:
                group = 2
            line = f"from {module} import {', '.join(items)}"
            short = len(line) <= LINE_LENGTH
            groups[group] += [line] if short else bracketed(f"from {module} import (", items, ")")
        return [line for group in groups if group for line in ("", *group)][1:]


def relative_name(here: Package, package: Package, *module: str) -> str:
    """Return the relative name of a package or one of its modules, in a file of the package `here`."""
    shared = 0
    for one, other in zip(here, package, strict=False):
        if one != other:
            break
        shared += 1
    return "." * (len(here) - shared + 1) + ".".join((*package[shared:], *module))


def exported_names(definition: ast.Definition) -> set[str]:
    """Return the public names that a definition makes in its Python module."""
    name = python_name(definition)
    return {name, f"{name}Prx"} if isinstance(definition, ast.Interface) else {name}
