"""Run the Slice compiler on texts in tests."""

from __future__ import annotations

import gc
import importlib
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Final

from codegen._idl import Compilation, compile_interfaces
from codegen._idl.compiler import Units
from codegen.diagnostics import Diagnostics
from codegen.files import apply, compare_with_disk

from .memory import freeze
from .places import DATA
from .slice_reference import Verdict


def sources_of(directory: Path) -> dict[str, str]:
    """Return the texts of the files in a directory by their names."""
    return {path.name: path.read_text() for path in sorted(directory.iterdir())}


AWKWARD: Final = sources_of(DATA / "slice_awkward")
"""Names that mean something else in Python, in the generated module, or in its base classes."""


def in_module(text: str) -> str:
    """Return definitions in a module."""
    return f"module m {{\n{text}\n}};\n"


def write_sources(directory: Path, sources: dict[str, str]) -> list[Path]:
    """Write files by name and return their paths."""
    paths = [directory / name for name in sources]
    for path, text in zip(paths, sources.values(), strict=True):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return paths


def compile_text(directory: Path, text: str, **others: str) -> tuple[Compilation, Diagnostics]:
    """Compile `main.idl` with a text; `others` are the texts of further files, by name without .idl."""
    sources = {f"{name}.idl": other for name, other in others.items()}
    (*_, main) = write_sources(directory, {**sources, "main.idl": text})
    diagnostics = Diagnostics()
    return compile_interfaces([main], [], None, diagnostics), diagnostics


def checked(path: Path, include_directories: Sequence[Path] = ()) -> Diagnostics:
    """Return the diagnostics of parsing and checking a file."""
    diagnostics = Diagnostics()
    units = Units(include_directories, diagnostics)
    source = units.load(path)
    if source is not None:
        units.read(source, diagnostics)
    return diagnostics


def first_error(diagnostics: Diagnostics) -> Verdict:
    """Return the file name and the line of the first error, like those of the reference compiler."""
    errors = diagnostics.errors
    return Verdict((errors[0].location.path.name, errors[0].location.line) if errors else None)


def findings(diagnostics: Diagnostics) -> list[tuple[str, int, int]]:
    """Return code, line and column of all diagnostics."""
    return [(found.code, found.location.line, found.location.column) for found in diagnostics]


@contextmanager
def imported(directory: Path, package: str, sources: dict[str, str]) -> Iterator[ModuleType]:
    """Compile files to the package `package` in a directory and import it while the context lasts."""
    paths = write_sources(directory / "idl", sources)
    diagnostics = Diagnostics()
    compilation = compile_interfaces(paths, [], directory / package, diagnostics)
    assert not diagnostics.has_errors, diagnostics.render()
    apply(compare_with_disk(compilation.files))
    sys.path.insert(0, str(directory))
    freeze()
    try:
        yield importlib.import_module(package)
    finally:
        sys.path.remove(str(directory))
        for name in [name for name in sys.modules if name.partition(".")[0] == package]:
            del sys.modules[name]
        gc.collect()  # classes without their module would still be found among those that extend another
