"""Find the proxies that a document may use, in packages that codegen generated, and their operations.

They are in the namespace package `interfaces`: ours, those of the document's project, and others that are
installed; and in packages beside the document or in directories that are named.
"""

from __future__ import annotations

import importlib.util
import json
import keyword
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from ..diagnostics import Location
from ..files import is_regular, read_regular
from ..messages import Message, MessageError
from ..reasons import reason
from .kinds import Kind, find_kind

_PACKAGE: Final = "interfaces"
_OURS: Final = Path(__file__).resolve().parents[2]
"""The directory of the package `interfaces` that is installed beside this one."""
_SCHEMA: Final = "schema.json"
_PROXY: Final = re.compile(r"^class (\w+)Prx\(", re.MULTILINE)
_MAX_DEPTH: Final = 4
_CLASSES: Final = frozenset({"enumeration", "exception", "struct"})
"""The kinds of types that are classes in Python, which code calls or names."""


class DescriptionError(MessageError):
    """The `schema.json` of a package is unusable; `place` is that of the error."""

    def __init__(self, message: Message, place: Location) -> None:
        super().__init__(message)
        self.place = place


@dataclass(frozen=True, slots=True)
class Operation:
    """A method of a proxy: its parameters after `self`, and the number of those without a default.

    `is_idempotent` is as in the IDL; one that `is_streamed` can be subscribed to.
    """

    name: str
    parameters: tuple[str, ...]
    required: int
    is_streamed: bool = False
    is_idempotent: bool = False
    by_name: frozenset[str] = frozenset()
    """Further parameters, keyword only."""
    types: tuple[str, ...] = ()
    """Those of the parameters in IDL, as far as they are known."""


@dataclass(frozen=True, slots=True)
class KnownInterface:
    """An IDL interface: its scoped name (`nao::PoseHead`) and the Python package of its proxy.

    `file` is the module of the proxy. `directory` is the one in which Python has to look for the package;
    None if that is installed.
    """

    scoped_name: str
    package: str
    file: Path = field(compare=False)
    directory: Path | None = field(default=None, compare=False)

    @property
    def proxy(self) -> str:
        """The name of the proxy class."""
        return self.scoped_name.rsplit("::", 1)[-1] + "Prx"


@dataclass(frozen=True, slots=True)
class KnownInterfaces:
    """The known interfaces by their plain name; `generated` are files that are about to be written.

    `kind` knows the other endpoints that a document may declare.
    """

    by_name: Mapping[str, tuple[KnownInterface, ...]]
    generated: Mapping[Path, str] = field(default_factory=dict)
    kind: Kind = field(default_factory=find_kind)

    def find(self, name: str) -> tuple[KnownInterface, ...]:
        """Return the interfaces that a plain or a scoped name may mean (`Camera`, `nao::PoseHead`).

        If none has the name, case is ignored: old documents write `Pose3d`.
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

    def packages_of(self, name: str) -> set[str]:
        """Return the Python packages with a class of this name: a proxy, or a described type of the IDL."""
        several = [each for found in self.by_name.values() for each in found]
        packages = {each.package for each in several if each.proxy == name}
        described = {
            (each.file.with_name(_SCHEMA), each.scoped_name.rpartition("::")[0], each.package)
            for each in several
        }
        for schema, scope, package in described:
            with suppress(OSError, ValueError, LookupError, TypeError, AttributeError):  # not ours: no advice
                if self._definitions(schema)[f"::{scope}::{name}"]["kind"] in _CLASSES:
                    packages.add(package)
        return packages

    @property
    def directories(self) -> tuple[Path, ...]:
        """The directories in which Python has to look for packages that are not installed."""
        found = (each.directory for several in self.by_name.values() for each in several)
        return tuple(sorted({directory for directory in found if directory}))

    def operations(self, interface: KnownInterface) -> dict[str, Operation] | None:
        """Return the operations of an interface and of its bases, by the names of their methods.

        None if not all of them are described: a hand-written proxy may have any operation. Raises
        DescriptionError.
        """
        found: dict[str, Operation] = {}
        pending = [interface]
        for each in pending:  # grows
            schema = each.file.with_name(_SCHEMA)
            try:
                definition = self._definitions(schema).get(f"::{each.scoped_name}", {})
                operations = [_operation(described) for described in definition.get("operations", ())]
                bases = [self.find(base) for base in definition.get("bases", ())]
            except FileNotFoundError:
                return None
            except OSError as error:
                raise DescriptionError(
                    Message("cannot be read: {reason}", reason=reason(error)), Location(schema)
                ) from error
            except json.JSONDecodeError as error:
                place = Location(schema, error.lineno, error.colno)
                raise DescriptionError(Message("is not JSON: {reason}", reason=error.msg), place) from error
            except (ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
                raise DescriptionError(Message("was not generated by codegen"), Location(schema)) from error
            if not definition or any(len(base) != 1 for base in bases):
                return None
            found = {**{operation.name: operation for operation in operations}, **found}
            pending += [base for (base,) in bases if base not in pending]
        return found

    def _definitions(self, schema: Path) -> dict[str, Any]:
        text = self.generated.get(schema)
        return _read_definitions(schema, schema.stat().st_mtime_ns) if text is None else _parse(text)


@lru_cache(maxsize=64)
def _read_definitions(schema: Path, _changed_at: int) -> dict[str, Any]:
    return _parse(read_regular(schema))


def _parse(schema: str | bytes) -> dict[str, Any]:
    definitions: dict[str, Any] = json.loads(schema)["definitions"]
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
        types=tuple(str(each.get("type")) for each in parameters),
    )


def _python_name(name: str) -> str:
    return f"_{name}" if keyword.iskeyword(name) else name


def interface_directories(document: Path, include: Sequence[Path] = ()) -> list[Path]:
    """Return the directories of the packages of a document's proxies, besides the installed ones.

    They are the document's directory, the one above if that has a folder `interfaces`, and `include`.
    """
    beside = document.parent.resolve()
    project = [beside.parent] if (beside.parent / _PACKAGE).is_dir() else []
    return [beside, *project, *(directory.resolve() for directory in include)]


def find_interfaces(
    document: Path | None = None, include: Sequence[Path] = (), generated: Mapping[Path, str] | None = None
) -> KnownInterfaces:
    """Return the interfaces that a document finds, by their plain name; without one, the installed ones.

    Of two with one scoped name, the first is known: ours, then those of the project, of the directories to
    `include`, and of other packages that are installed. `generated` are the texts of files, by their resolved
    path, that are about to be written.
    """
    finder = _Finder(generated or {})
    found: dict[str, dict[str, KnownInterface]] = {}
    for known in finder.all_interfaces(document, include):
        found.setdefault(known.scoped_name.rsplit("::", 1)[-1], {}).setdefault(known.scoped_name, known)
    by_name = {name: tuple(by_scope.values()) for name, by_scope in found.items()}
    places = interface_directories(document, include) if document else include
    kind = find_kind([each for place in places for each in (place, place / _PACKAGE)])
    return KnownInterfaces(by_name, finder.generated, kind)


class _Finder:
    def __init__(self, generated: Mapping[Path, str]) -> None:
        self.generated = generated

    def all_interfaces(self, document: Path | None, include: Sequence[Path]) -> Iterator[KnownInterface]:
        yield from self._in_namespace(_OURS / _PACKAGE, None)
        for directory in interface_directories(document, include) if document else ():
            if directory != _OURS:
                yield from self._in_namespace(directory / _PACKAGE, directory)
        places = [(each.resolve(), False) for each in include]
        # Any package beside a document may belong to another program.
        for directory, generated_only in [(document.parent.resolve(), True), *places] if document else places:
            for package in self._packages(directory):
                schema = package / _SCHEMA
                if not generated_only or schema in self.generated or is_regular(schema):
                    yield from self._in_package(package, (package.name,), (package.name,), directory)
        spec = importlib.util.find_spec(_PACKAGE)
        for location in (spec.submodule_search_locations or ()) if spec else ():
            if Path(location) != _OURS / _PACKAGE:
                yield from self._in_namespace(Path(location), None)

    def _in_namespace(self, namespace: Path, directory: Path | None) -> Iterator[KnownInterface]:
        for package in self._packages(namespace):
            yield from self._in_package(package, (_PACKAGE, package.name), (package.name,), directory)

    def _in_package(
        self, folder: Path, package: tuple[str, ...], scope: tuple[str, ...], directory: Path | None
    ) -> Iterator[KnownInterface]:
        for module, names in self._modules(folder):
            for name in names:
                yield KnownInterface("::".join((*scope, name)), ".".join(package), module, directory)
        if len(scope) < _MAX_DEPTH:
            for inner in self._packages(folder):
                yield from self._in_package(inner, (*package, inner.name), (*scope, inner.name), directory)

    def _modules(self, folder: Path) -> list[tuple[Path, Sequence[str]]]:
        """Return the modules of a package, each with the interfaces whose proxies it defines."""
        found: dict[str, tuple[Path, Sequence[str]]] = {
            path.name: (path, _PROXY.findall(text))
            for path, text in self.generated.items()
            if path.parent == folder
        }
        for entry in _entries(folder):
            if entry.name.endswith(".py") and entry.name not in found:
                found[entry.name] = _proxies(entry)
        return [found[name] for name in sorted(found)]

    def _packages(self, directory: Path) -> list[Path]:
        found = {path.parent for path in self.generated if path.parent.parent == directory}
        names = (each.name for each in _entries(directory) if each.name.isidentifier())
        found |= {directory / name for name in names if is_regular(directory / name / "__init__.py")}
        return sorted(package for package in found if package.name.isidentifier())


def _entries(directory: Path) -> list[os.DirEntry[str]]:
    """Return the entries of a directory, none if it cannot be read."""
    try:
        with os.scandir(directory) as entries:
            return list(entries)
    except OSError:
        return []


def _proxies(module: os.DirEntry[str]) -> tuple[Path, tuple[str, ...]]:
    """Return the interfaces whose proxies a module defines, none if it cannot be read."""
    try:
        status = module.stat()
        return _read_proxies(module.path, status.st_mtime_ns, status.st_size)
    except OSError:
        return Path(module.path), ()


@lru_cache(maxsize=256)
def _read_proxies(module: str, _changed_at: int, _size: int) -> tuple[Path, tuple[str, ...]]:
    """Return the interfaces whose proxies a module defines; cached until the module changes."""
    path = Path(module)
    return path, tuple(_PROXY.findall(read_regular(path).decode(errors="replace")))
