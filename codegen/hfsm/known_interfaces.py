"""Find the proxies that a document may name: those in the packages that codegen generated from IDL."""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Final

__all__ = ["KnownInterface", "KnownInterfaces", "find_interfaces"]

_PACKAGE: Final = "interfaces"
_PROXY: Final = re.compile(r"^class (\w+)Prx\(", re.MULTILINE)
_MAX_DEPTH: Final = 4


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
