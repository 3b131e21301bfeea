"""Find the proxies that a document may name, in the packages that codegen generated, and their operations."""

from __future__ import annotations

import importlib.util
import json
import keyword
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from ..diagnostics import Location

__all__ = ["DescriptionError", "KnownInterface", "KnownInterfaces", "Operation", "find_interfaces"]

_PACKAGE: Final = "interfaces"
_PROXY: Final = re.compile(r"^class (\w+)Prx\(", re.MULTILINE)
_MAX_DEPTH: Final = 4


class DescriptionError(Exception):
    """The `schema.json` of a package cannot be used; `place` says where it is wrong."""

    def __init__(self, message: str, place: Location) -> None:
        super().__init__(message)
        self.place = place


@dataclass(frozen=True, slots=True)
class Operation:
    """A method of a proxy: its parameters after `self`, and how many of them have no default.

    It `is_idempotent` where the IDL says so, and `is_streamed` where one can subscribe to it.
    """

    name: str
    parameters: tuple[str, ...]
    required: int
    is_streamed: bool = False
    is_idempotent: bool = False
    by_name: frozenset[str] = frozenset()
    """Further parameters, which are given by name."""


@dataclass(frozen=True, slots=True)
class KnownInterface:
    """An IDL interface: its scoped name (`nao::PoseHead`) and the Python package that has its proxy.

    `file` is the module in which the proxy stands.
    """

    scoped_name: str
    package: str
    file: Path = field(compare=False)

    @property
    def proxy(self) -> str:
        """The name of the proxy class."""
        return self.scoped_name.rsplit("::", 1)[-1] + "Prx"


@dataclass(frozen=True, slots=True)
class KnownInterfaces:
    """Interfaces by their plain name."""

    by_name: Mapping[str, tuple[KnownInterface, ...]]

    def find(self, name: str) -> tuple[KnownInterface, ...]:
        """Return the interfaces that a plain or a scoped name (`Camera`, `nao::PoseHead`) may mean.

        Where none has the name, upper and lower case do not count: documents of old say `Pose3d`.
        """
        scoped = name.strip().replace(".", "::").removeprefix("::")
        plain = scoped.rsplit("::", 1)[-1]
        found = self.by_name.get(plain, ())
        if not found:
            found = tuple(
                known
                for other, several in self.by_name.items()
                if other.casefold() == plain.casefold()
                for known in several
            )
        return tuple(
            known
            for known in found
            if "::" not in scoped or known.scoped_name.casefold() == scoped.casefold()
        )

    def operations(self, interface: KnownInterface) -> dict[str, Operation] | None:
        """Return the operations of an interface and of those that it extends, by the names of their methods.

        None where not all of them are described: a proxy that was written by hand may do anything. Raises
        DescriptionError.
        """
        found: dict[str, Operation] = {}
        pending = [interface]
        for each in pending:  # grows
            schema = each.file.with_name("schema.json")
            try:
                definition = _definitions(schema, schema.stat().st_mtime_ns).get(f"::{each.scoped_name}", {})
                operations = [_operation(described) for described in definition.get("operations", ())]
                bases = [self.find(base) for base in definition.get("bases", ())]
            except FileNotFoundError:
                return None
            except OSError as error:
                raise DescriptionError(
                    f"cannot be read: {error.strerror or error}", Location(schema)
                ) from error
            except json.JSONDecodeError as error:
                place = Location(schema, error.lineno, error.colno)
                raise DescriptionError(f"is no JSON: {error.msg}", place) from error
            except (ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
                raise DescriptionError("is none that codegen writes", Location(schema)) from error
            if not definition or any(len(base) != 1 for base in bases):
                return None
            found = {**{operation.name: operation for operation in operations}, **found}
            pending += [base for (base,) in bases if base not in pending]
        return found


@lru_cache(maxsize=64)
def _definitions(schema: Path, _changed_at: int) -> dict[str, Any]:
    definitions: dict[str, Any] = json.loads(schema.read_bytes())["definitions"]
    return definitions


def _operation(described: Mapping[str, Any]) -> Operation:
    parameters = described.get("parameters", ())
    required = [place for place, each in enumerate(parameters, 1) if not each.get("optional")]
    return Operation(
        name=_python_name(described["name"]),
        parameters=tuple(_python_name(each["name"]) for each in parameters),
        required=max(required, default=0),
        is_streamed=described.get("streamed") is True,
        is_idempotent=described.get("idempotent") is True,
    )


def _python_name(name: str) -> str:
    return f"_{name}" if keyword.iskeyword(name) else name


def find_interfaces(directories: Iterable[Path] = ()) -> KnownInterfaces:
    """Return the interfaces of the package `interfaces` and of the packages in further directories."""
    found: dict[str, dict[str, KnownInterface]] = {}
    for known in _all_interfaces(directories):
        found.setdefault(known.scoped_name.rsplit("::", 1)[-1], {}).setdefault(known.scoped_name, known)
    return KnownInterfaces({name: tuple(by_scope.values()) for name, by_scope in found.items()})


def _all_interfaces(directories: Iterable[Path]) -> Iterator[KnownInterface]:
    spec = importlib.util.find_spec(_PACKAGE)
    for location in (spec.submodule_search_locations or ()) if spec else ():
        for package in _packages(Path(location)):
            yield from _in_package(package, (_PACKAGE, package.name), (package.name,))
    for directory in directories:
        for package in _packages(directory):
            yield from _in_package(package, (package.name,), (package.name,))


def _in_package(
    directory: Path, package: tuple[str, ...], scope: tuple[str, ...]
) -> Iterator[KnownInterface]:
    for module in sorted(directory.glob("*.py")):
        status = module.stat()
        for name in _proxies(module, status.st_mtime_ns, status.st_size):
            yield KnownInterface("::".join((*scope, name)), ".".join(package), module)
    if len(scope) < _MAX_DEPTH:
        for inner in _packages(directory):
            yield from _in_package(inner, (*package, inner.name), (*scope, inner.name))


@lru_cache(maxsize=256)
def _proxies(module: Path, _changed_at: int, _size: int) -> tuple[str, ...]:
    """Return the interfaces whose proxies stand in a module; it is read again when it has changed."""
    return tuple(_PROXY.findall(module.read_text(encoding="utf-8", errors="replace")))


def _packages(directory: Path) -> list[Path]:
    found = (path.parent for path in directory.glob("*/__init__.py"))
    return sorted(package for package in found if package.name.isidentifier())
