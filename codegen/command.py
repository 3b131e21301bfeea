"""`codegen FILES...`: generate Python from interfaces and automaton documents.

Heavy modules are imported only when the command runs, so that `--help` and completion are fast.
"""

from __future__ import annotations

import keyword
import time
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from codegen.diagnostics import Diagnostics, shown_path
from codegen.files import Changes, FilesNotWrittenError, GeneratedFile, apply, compare_with_disk, diff

from .options import DOCUMENTS, INTERFACES, ErrorFormat, report, require_directories, require_extensions, show

app = typer.Typer(rich_markup_mode=None, pretty_exceptions_enable=False)

_EPILOG = """Examples:

\b
  codegen interfaces/*.idl              packages next to the files: interfaces/jderobot, ...
  codegen robot.idl -I slice -o api     the package api/, with includes found in slice/
  codegen behaviors/follow_ball.xml     the component behaviors/follow_ball.py
  codegen --check interfaces/*.idl      exit 1 and show a diff if files are out of date
  codegen --watch interfaces/*.idl      generate again after every change
  codegen diff released interfaces      list breaking changes of interfaces: codegen diff --help

Exit codes: 0 success, 1 errors in the files or, with --check, files out of date, 2 wrong usage.
See docs/reference/codegen.md for details."""

_CLOCK_LAG = 20_000_000  # ns by which the time of a file may lag behind the clock
_CHECK_PERIOD = 0.2  # s between two checks of the files
_SETTLED = 0.05  # s to wait after a change, so that files are rarely read while they are being written


@dataclass(frozen=True, slots=True)
class _Job:
    """The files to generate, and their folder; None means next to the sources."""

    interfaces: list[Path]
    documents: list[Path]
    include: list[Path]
    interface_output: Path | None
    document_output: Path | None
    packages_above: tuple[Path, ...]
    """Parent directories of the interfaces' output that are packages too, for `--package a.b`."""


@dataclass(slots=True)
class _Result:
    """The outcome of a job; incomplete if there were errors."""

    diagnostics: Diagnostics = field(default_factory=Diagnostics)
    generated: list[GeneratedFile] = field(default_factory=list)
    leftovers: list[Path] = field(default_factory=list)


@app.command(epilog=_EPILOG)
def generate(
    files: Annotated[
        list[Path],
        typer.Argument(metavar="FILES", help="Interfaces in Slice (.idl, .ice) and automata (.xml)."),
    ],
    include: Annotated[
        list[Path] | None,
        typer.Option("-I", "--include", metavar="DIR", help="Search DIR for included files; repeatable."),
    ] = None,
    *,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="DIR", help="Write to DIR instead of next to the files."),
    ] = None,
    package: Annotated[
        str | None,
        typer.Option(
            "--package", metavar="NAME", help="Put interfaces into the package NAME; dots are allowed."
        ),
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Write nothing; exit 1 with a diff if files are out of date.")
    ] = False,
    watch: Annotated[
        bool,
        typer.Option(
            "--watch", help="Keep running, and generate again when a file changes; stop with Ctrl-C."
        ),
    ] = False,
    error_format: Annotated[
        ErrorFormat, typer.Option("--error-format", help="Format of the diagnostics on stderr.")
    ] = ErrorFormat.TEXT,
) -> None:
    """Generate Python from interfaces in Slice and from automaton documents.

    Interfaces become packages of typed structs, proxies and servants. An automaton document becomes a
    component that runs it. If there is an error, no file is written. Files that would not change are not
    touched.
    """
    require_extensions(files, INTERFACES | DOCUMENTS)
    if output is not None and output.exists() and not output.is_dir():
        raise typer.BadParameter(f"{output} is not a directory", param_hint="-o")
    if check and watch:
        raise typer.BadParameter("cannot be combined with --check", param_hint="--watch")
    interfaces = [path for path in files if path.suffix.lower() in INTERFACES]
    root, above = _package_directory(package, output, interfaces)
    job = _Job(
        interfaces,
        [path for path in files if path.suffix.lower() in DOCUMENTS],
        require_directories(include),
        root,
        output,
        above,
    )
    if watch:
        _watch(job, error_format)
    result = _run(job)
    report(result.diagnostics, error_format)
    if not _finish(result, check=check):
        raise typer.Exit(1)


def _package_directory(
    package: str | None, output: Path | None, interfaces: Sequence[Path]
) -> tuple[Path | None, tuple[Path, ...]]:
    """Return the directory for interfaces, and its parents that must be packages for a dotted name."""
    if package is None:
        return output, ()
    parts = package.split(".")
    if not all(part.isidentifier() and not keyword.iskeyword(part) for part in parts):
        raise typer.BadParameter(f"{package} is not a valid package name", param_hint="--package")
    if output is None:
        parents = {path.parent.resolve(): path.parent for path in interfaces}
        if len(parents) > 1:
            message = "the files are in several directories: choose the output directory with -o"
            raise typer.BadParameter(message, param_hint="--package")
        output = next(iter(parents.values()), Path())
    above = tuple(output.joinpath(*parts[:length]) for length in range(1, len(parts)))
    return output.joinpath(*parts), above


def _run(job: _Job) -> _Result:
    """Compile everything, without writing."""
    result = _Result()
    if job.interfaces:
        from codegen._idl import compile_interfaces

        compilation = compile_interfaces(
            job.interfaces, job.include, job.interface_output, result.diagnostics
        )
        result.generated += compilation.files
        result.leftovers += compilation.leftovers
        result.generated += (
            GeneratedFile(directory / "__init__.py", "")
            for directory in job.packages_above
            if not (directory / "__init__.py").exists()
        )
    if job.documents:
        from codegen.hfsm import compile_document

        packages = {file.path.resolve(): file.text for file in result.generated}
        for path in job.documents if not result.diagnostics.has_errors else ():
            made = compile_document(
                path,
                job.document_output,
                result.diagnostics,
                job.include,
                with_model=True,
                generated=packages,
            )
            result.generated += made or []
    return result


def _finish(result: _Result, *, check: bool) -> bool:
    """Write the changes, or only show them; return whether the files on disk are up to date now."""
    try:
        changes = compare_with_disk(result.generated, result.leftovers)
        if check:
            _show_outdated(result, changes)
            return not changes
        apply(changes)
    except FilesNotWrittenError as error:
        typer.echo(str(error), err=True)
        return False
    except OSError as error:
        if error.filename is None:  # the output of this command
            raise
        typer.echo(f"{error.filename}: {error.strerror}", err=True)
        return False
    for file in changes.write:
        typer.echo(f"wrote {shown_path(file.path)}")
    for path in changes.remove:
        typer.echo(f"removed {shown_path(path)}")
    unchanged = len(result.generated) - len(changes.write)
    if unchanged:
        typer.echo(f"{unchanged} file{'s' if unchanged > 1 else ''} up to date")
    return True


def _show_outdated(result: _Result, changes: Changes) -> None:
    if changes:
        typer.echo(diff(changes), nl=False)
        count = len(changes.write) + len(changes.remove)
        typer.echo(
            f"{count} of {len(result.generated) + len(result.leftovers)} files are out of date", err=True
        )


# --watch


def _watch(job: _Job, error_format: ErrorFormat) -> NoReturn:
    """Run a job now and after every change of a file that it depends on; only an exception ends it."""
    paths: Collection[Path] = (*job.interfaces, *job.documents)
    while True:
        before, started = _stat(paths), time.time_ns()
        paths = _write_and_list(job, error_format)
        # Files may have changed during the run, including those that only the run has found.
        for path, now in _stat(paths).items():
            changed = now is not None and now[0] > started - _CLOCK_LAG
            before.setdefault(path, None if changed else now)
        before = {path: before[path] for path in paths}
        while _stat(before) == before:
            time.sleep(_CHECK_PERIOD)
        time.sleep(_SETTLED)


def _write_and_list(job: _Job, error_format: ErrorFormat) -> list[Path]:
    """Run a job, report its result, and return the paths to watch."""
    result = _run(job)
    show(result.diagnostics, error_format)
    watched = [*job.interfaces, *job.documents, *result.diagnostics.sources]
    if job.documents:
        from codegen.hfsm import component_path, extension_path

        # An extension that is added changes the component.
        watched += [extension_path(component_path(path, job.document_output)) for path in job.documents]
    if result.diagnostics.has_errors:
        # A missing file may be added in any of the directories that are searched.
        watched += [*job.include, *{path.parent for path in watched}]
    else:
        _finish(result, check=False)
    return watched


def _stat(paths: Collection[Path]) -> dict[Path, tuple[int, int, int] | None]:
    """Return the modification time, size and inode of each file, None if it does not exist."""
    found: dict[Path, tuple[int, int, int] | None] = {}
    for path in paths:
        try:
            status = path.stat()
        except OSError:
            found[path] = None
        else:
            found[path] = (status.st_mtime_ns, status.st_size, status.st_ino)
    return found
