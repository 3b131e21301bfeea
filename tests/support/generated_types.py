"""The definitions of a generated package, found by importing all of it."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator
from types import ModuleType

import msgspec

from zenoh_ice import ObjectPrx, UserException
from zenoh_ice.data.interface import Interface


def modules_of(package: ModuleType) -> Iterator[ModuleType]:
    """Import and yield every module in a package."""
    for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        yield importlib.import_module(module.name)


def interfaces_of(package: ModuleType) -> list[Interface]:
    """Return every interface that a package defines."""
    return [
        value.ice_interface
        for module in modules_of(package)
        for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, ObjectPrx) and value.__module__ == module.__name__
    ]


def structs_of(package: ModuleType) -> list[type[msgspec.Struct]]:
    """Return every struct, every exception's members, and the arguments and results of every operation."""
    found: dict[str, type[msgspec.Struct]] = {}
    for module in modules_of(package):
        for value in vars(module).values():
            if not isinstance(value, type) or value.__module__ != module.__name__:
                continue
            if issubclass(value, ObjectPrx):
                for operation in value.ice_interface.operations:
                    for struct in (operation.arguments.struct, operation.result.struct):
                        found[f"{struct.__module__}.{struct.__qualname__}"] = struct
            kind = value.Members if issubclass(value, UserException) else value
            if issubclass(kind, msgspec.Struct):
                found[f"{kind.__module__}.{value.__qualname__}"] = kind
    return [found[name] for name in sorted(found)]
