"""Describe generated types and interfaces at run time: members, operations, docs and fingerprints.

    >>> from zenoh_ice.reflection import describe
    >>> from interfaces.nao import PoseHeadPrx
    >>> [operation.name for operation in describe(PoseHeadPrx).operations]
    ['setPose', 'setSpeed', 'stop', 'getPose', 'getLimits']

Names and types are those of Slice, from the root: `::nao::HeadPose`, `sequence` types by their name.
"""

from __future__ import annotations

from functools import lru_cache
from importlib import resources
from typing import Any, Final, Literal

import msgspec

from .exceptions import ConfigurationException
from .operation import Interface

__all__ = ["Definition", "Enumerator", "Member", "OperationDescription", "describe", "describe_package"]

_SCHEMA_FILE: Final = "schema.json"


class Member(msgspec.Struct, frozen=True):
    """A member of a struct, a class or an exception, a parameter, or a result."""

    name: str
    type: str
    doc: str = ""
    optional: bool = False
    default: bool | int | float | str | None = None
    """The default value, an enumerator by its name; None where there is none."""


class Enumerator(msgspec.Struct, frozen=True):
    """A value of an enumeration."""

    name: str
    value: int
    doc: str = ""


class OperationDescription(msgspec.Struct, frozen=True):
    """An operation of an interface."""

    name: str
    doc: str = ""
    parameters: tuple[Member, ...] = ()
    results: tuple[Member, ...] = ()
    """What it returns, by the name `returnValue`, and its out parameters."""
    exceptions: dict[str, str] = {}
    """Type ids of the exceptions that it throws, each with its doc."""
    idempotent: bool = False
    streamed: bool = False


class Definition(msgspec.Struct, frozen=True):
    """What a Slice file defines; what does not belong to its kind is empty."""

    kind: Literal[
        "interface", "struct", "class", "exception", "enumeration", "sequence", "dictionary", "constant"
    ]
    module: str
    """The Python module in the package."""
    name: str
    """The name in Python."""
    fingerprint: str
    """The beginning of the digest of its canonical form, which changes with what travels and nothing else."""
    doc: str = ""
    bases: tuple[str, ...] = ()
    members: tuple[Member, ...] = ()
    """Its own members, without those of its bases."""
    operations: tuple[OperationDescription, ...] = ()
    enumerators: tuple[Enumerator, ...] = ()
    element: str = ""
    key: str = ""
    value: str = ""
    type: str = ""
    constant: bool | int | float | str | None = None


class _Schema(msgspec.Struct):
    definitions: dict[str, Definition]


@lru_cache(maxsize=64)
def describe_package(package: str) -> dict[str, Definition]:
    """Return all definitions of a generated package, by type id: `describe_package("interfaces.nao")`.

    Raises ConfigurationException when codegen did not make the package.
    """
    try:
        data = (resources.files(package) / _SCHEMA_FILE).read_bytes()
        return msgspec.json.decode(data, type=_Schema).definitions
    except (OSError, ImportError, TypeError, msgspec.MsgspecError) as error:
        raise ConfigurationException(
            f"{package} has no readable {_SCHEMA_FILE}: generate it with codegen ({error})"
        ) from error


def describe(generated: type[Any]) -> Definition:
    """Return the description of a generated class: struct, enumeration, exception, proxy or servant.

    Subclasses of them are described as what they extend. Raises ConfigurationException for others.
    """
    for cls in generated.__mro__:
        package, _, module = cls.__module__.rpartition(".")
        if not package or package == __package__:
            continue
        interface = vars(cls).get("ice_interface")
        try:
            definitions = describe_package(package)
        except ConfigurationException:
            continue
        for type_id, definition in definitions.items():
            named = definition.module == module and definition.name == cls.__name__
            if named or (isinstance(interface, Interface) and interface.type_id == type_id):
                return definition
    raise ConfigurationException(f"{generated.__qualname__} is not, and does not extend, what codegen made")
