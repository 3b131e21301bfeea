"""Sort out the modules of earlier runs: what belongs to a package still, and what nothing accounts for."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from .names import file_module
from .packages import ModuleSummary, read_summary
from .schema import SCHEMA_FILE

_ENDING = re.compile(r"(_idl)?(_\d+)?$")


@dataclass(slots=True)
class EarlierModules:
    """What earlier runs made in the packages that a run makes anew, and in others beside them."""

    kept: dict[tuple[str, ...], list[ModuleSummary]] = field(default_factory=dict)
    """By package: modules that stay part of it."""
    leftovers: list[Path] = field(default_factory=list)


def earlier_modules(
    directory: Path,
    packages: Collection[tuple[str, ...]],
    generated: Collection[Path],
    sources: Collection[Path],
    *,
    knows_all_sources: bool,
) -> EarlierModules:
    """Sort out what lies in the `packages` of a directory, apart from the files that are `generated` anew.

    With `knows_all_sources` the IDL files lie in the directory, too, and what was made from one that is gone
    is a leftover. A module that another one imports which stays is none: an included file can lie anywhere.
    """

    def is_leftover(summary: ModuleSummary) -> bool:
        return _was_made_from(summary, sources) or (knows_all_sources and is_orphan(summary))

    def is_orphan(summary: ModuleSummary) -> bool:
        return not (directory / summary.source).is_file()

    found = {package: dict(_modules(directory, package, generated)) for package in packages}
    unclaimed = {
        path for modules in found.values() for path, summary in modules.items() if is_leftover(summary)
    }
    orphans: dict[Path, set[Path]] = {}
    if knows_all_sources:
        for init in sorted(directory.glob("*/__init__.py")):
            beside = (init.parent.name,)
            if beside not in found and read_summary(init, beside) is not None:
                modules = dict(_modules(directory, beside))
                if modules and all(map(is_orphan, modules.values())):
                    orphans[init] = set(modules)
    candidates = unclaimed.union(*orphans.values())
    needed = _needed(directory, candidates, generated) if candidates else set()
    unclaimed -= needed
    earlier = EarlierModules()
    for package, modules in found.items():
        earlier.leftovers += [path for path in modules if path in unclaimed]
        earlier.kept[package] = [summary for path, summary in modules.items() if path not in unclaimed]
    for init, paths in orphans.items():
        if not paths & needed:
            earlier.leftovers += [
                init,
                init.with_name("py.typed"),
                init.with_name(SCHEMA_FILE),
                *sorted(paths),
            ]
    return earlier


def _modules(
    directory: Path, package: tuple[str, ...], but: Collection[Path] = ()
) -> Iterator[tuple[Path, ModuleSummary]]:
    """Yield the generated modules of a package, leaving out some paths."""
    for path in sorted(directory.joinpath(*package).glob("*.py")):
        skipped = path.name == "__init__.py" or path in but
        summary = None if skipped else read_summary(path, package)
        if summary is not None:
            yield path, summary


def _was_made_from(summary: ModuleSummary, sources: Iterable[Path]) -> bool:
    """Return whether a module was made from one of the files, and not from one of that name elsewhere."""
    bare = _ENDING.sub("", summary.name)
    return any(
        not {summary.name, bare}.isdisjoint(
            {file_module(path, ()), file_module(path.with_stem(f"{path.parent.name}_{path.stem}"), ())}
        )
        for path in sources
        if path.name == summary.source
    )


def _needed(directory: Path, candidates: Collection[Path], generated: Collection[Path]) -> set[Path]:
    """Return the candidates that a module which stays imports, at once or by way of others."""
    imports: Mapping[Path, list[Path]] = {
        path: [directory.joinpath(*name[:-1], f"{name[-1]}.py") for name in summary.imports if name]
        for path, summary in _all_modules(directory)
    }
    needed: set[Path] = set()
    waiting = [path for path in imports if path not in candidates and path not in generated]
    while waiting:
        more = {path for path in imports.get(waiting.pop(), ()) if path in candidates} - needed
        needed |= more
        waiting += more
    return needed


def _all_modules(directory: Path) -> Iterator[tuple[Path, ModuleSummary]]:
    """Yield the modules of all generated packages in a directory."""
    for init in sorted(directory.glob("*/__init__.py")):
        if read_summary(init, (init.parent.name,)) is not None:
            for inner in sorted(init.parent.rglob("__init__.py")):
                yield from _modules(directory, inner.parent.relative_to(directory).parts)
