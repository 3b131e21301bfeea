"""`codegen breaking`: report what would break a client or a server."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from codegen.diagnostics import Diagnostics, Location, Note

from .options import (
    INTERFACES,
    ErrorFormat,
    Format,
    Include,
    InterfaceFiles,
    report,
    require_directories,
    require_extensions,
)

if TYPE_CHECKING:
    from codegen.idl import ast
    from codegen.idl.breaking import BreakingChange
    from codegen.idl.lexer import Token

__all__ = ["breaking"]

_TIME_LIMIT = 30.0  # s that git may take to answer
_LARGEST = 256 << 20  # bytes of all files of a revision


class Kind(StrEnum):
    """What a change has to break to be reported."""

    ANY = "any"
    WIRE = "wire"
    SOURCE = "source"


def breaking(
    files: InterfaceFiles,
    against: Annotated[
        str,
        typer.Option(
            "--against", metavar="REV|DIR", help="The older version: a git revision or a directory."
        ),
    ],
    include: Include = None,
    *,
    kind: Annotated[
        Kind, typer.Option("--kind", help="Report only what breaks programs as they run, or source code.")
    ] = Kind.ANY,
    ignore: Annotated[
        list[str] | None, typer.Option("--ignore", metavar="CODE", help="Leave out a rule; repeatable.")
    ] = None,
    error_format: Format = ErrorFormat.TEXT,
) -> None:
    """Report what changed that breaks clients or servers.

    A change breaks the wire when programs generated from the old files and from the new refuse each other,
    and source code when code written for the old files must change. A git revision is read without a
    checkout. The codes are explained in docs/breaking-changes.md. Exit code 1 when something breaks.
    """
    require_extensions(files, INTERFACES)
    directories = require_directories(include)
    from codegen.idl.breaking import Break, BreakingRule, breaking_changes
    from codegen.idl.loading import load_definitions

    ignored = set(ignore or ())
    unknown = ignored - {rule.code for rule in BreakingRule}
    if unknown:
        raise typer.BadParameter(f"there is no rule {', '.join(sorted(unknown))}", param_hint="--ignore")
    diagnostics = Diagnostics()
    new = load_definitions(files, directories, diagnostics)
    try:
        with _older_version(against, files, directories) as older:
            old = _definitions_of_older(older, diagnostics)
            report(diagnostics, error_format, "")
            if not older.files:
                typer.echo(f"{against} has none of the files: nothing can break")
                return
            found = Diagnostics()
            for change in breaking_changes(old, new):
                wanted = kind is Kind.ANY or Break(kind.value) in change.rule.breaks
                if wanted and change.rule.code not in ignored:
                    _report_change(change, older, found)
    except _OlderVersionError as error:
        raise typer.BadParameter(str(error), param_hint="--against") from error
    report(found, error_format, f"compared with {against}")
    typer.echo(f"nothing breaks, compared with {against}")


def _definitions_of_older(older: _OlderVersion, diagnostics: Diagnostics) -> dict[str, ast.Definition]:
    """Return the older definitions; errors among them are reported under the names that people know."""
    from codegen.idl.loading import load_definitions

    found = Diagnostics()
    definitions = load_definitions(older.files, older.include, found)
    for each in found.errors:
        place = replace(each.location, path=older.shown(each.location.path))
        diagnostics.error(each.code, each.message, place)
    return definitions


def _report_change(change: BreakingChange, older: _OlderVersion, diagnostics: Diagnostics) -> None:
    notes = [Note(f"breaks {' and '.join(change.rule.breaks)}: {change.rule.consequence}")]
    if change.before is not None:
        notes.append(Note("it was here", _place(change.before, older, diagnostics)))
    diagnostics.error(change.rule.code, change.message, _place(change.token, older, diagnostics), notes)


def _place(token: Token, older: _OlderVersion, diagnostics: Diagnostics) -> Location:
    place = replace(token.location, path=older.shown(token.source.path))
    diagnostics.add_source(place.path, token.source.text)
    return place


# The older version


class _OlderVersionError(Exception):
    """There is nothing to compare with; the message says why."""


@dataclass(frozen=True, slots=True)
class _OlderVersion:
    """Where the older version of some files can be read."""

    files: list[Path]
    """Those of them that existed, and others of their directories that exist no more."""
    include: list[Path]
    shown: Callable[[Path], Path]
    """Under what name people know one of the files, as `main:interfaces/image.idl`."""


@contextmanager
def _older_version(against: str, files: Sequence[Path], include: Sequence[Path]) -> Iterator[_OlderVersion]:
    """Provide the older version of files from a directory, or from a git revision without a checkout.

    A directory has the files of the same path below it, or else those of the same name in it.
    Raises _OlderVersionError when `against` is neither.
    """
    directory = Path(against)
    if directory.is_dir():

        def older(path: Path) -> Path:
            below = directory if path.is_absolute() else directory / path
            return below if below.is_dir() else directory

        searched = [each for path in include for each in (older(path), path)]
        yield _OlderVersion(_older_files(files, older), searched, lambda path: path)
        return
    from tempfile import TemporaryDirectory

    with TemporaryDirectory(prefix="codegen-") as temporary:
        copy = Path(temporary).resolve()
        root = _copy_of_revision(against, files, copy)

        def moved(path: Path) -> Path:
            whole = path.resolve()
            return copy / whole.relative_to(root) if whole.is_relative_to(root) else path

        def shown(path: Path) -> Path:
            inside = path.resolve()
            if not inside.is_relative_to(copy):
                return path
            return Path(f"{against}:{inside.relative_to(copy).as_posix()}")

        yield _OlderVersion(_older_files(files, moved), [moved(path) for path in include], shown)


def _older_files(files: Sequence[Path], older: Callable[[Path], Path]) -> list[Path]:
    """Return the files as they were, and files of the same directories that exist no more.

    `older` gives what a directory was.
    """
    folders: dict[Path, list[Path]] = {}
    for present in dict.fromkeys(path.parent for path in files):
        folders.setdefault(older(present), []).append(present)
    found = [older(path.parent) / path.name for path in files]
    for folder, presents in folders.items():
        names = {path.name for present in presents if present.is_dir() for path in present.iterdir()}
        if folder.is_dir():
            interfaces = (path for path in sorted(folder.iterdir()) if path.suffix.lower() in INTERFACES)
            found += (path for path in interfaces if path.name not in names)
    return [path for path in found if path.is_file()]


def _copy_of_revision(revision: str, files: Sequence[Path], directory: Path) -> Path:
    """Copy the interface files of a revision to a directory; return the root of the repository of `files`."""
    import tarfile

    start = files[0].resolve().parent
    if not start.is_dir():
        raise _OlderVersionError(f"{start} is no directory")
    root = Path(_git(start, "rev-parse", "--show-toplevel").decode().rstrip("\n")).resolve()
    outside = next((path for path in files if not path.resolve().is_relative_to(root)), None)
    if outside is not None:
        raise _OlderVersionError(f"{outside} does not lie in the git repository of {files[0]}")
    try:
        answer = _git(root, "rev-parse", "--verify", "--quiet", "--end-of-options", f"{revision}^{{commit}}")
    except _OlderVersionError as error:
        message = f"`{revision}` is neither a directory nor a revision of the repository {root}"
        raise _OlderVersionError(message) from error
    commit = answer.decode().strip()
    names = _git(root, "ls-tree", "-r", "-z", "--name-only", commit).decode(errors="replace").split("\0")
    present = [each for each in INTERFACES if any(name.lower().endswith(each) for name in names)]
    if present:
        patterns = (f":(glob,icase)**/*{extension}" for extension in present)
        archived = _git(root, "archive", "--format=tar", commit, *patterns)
        with tarfile.open(fileobj=io.BytesIO(archived)) as archive:
            archive.extractall(directory, [each for each in archive if each.isreg()], filter="data")
    return root


def _git(directory: Path, *arguments: str) -> bytes:
    """Return what git answers; raises _OlderVersionError when it refuses, is missing, or takes too long."""
    import subprocess

    command = ["git", "-C", str(directory), *arguments]
    try:
        done = subprocess.run(command, capture_output=True, timeout=_TIME_LIMIT, check=False)
    except FileNotFoundError as error:
        raise _OlderVersionError("git is not installed: compare with a directory") from error
    except subprocess.TimeoutExpired as error:
        raise _OlderVersionError(f"git took longer than {_TIME_LIMIT:.0f} s") from error
    if done.returncode:
        reason = done.stderr.decode(errors="replace").strip() or f"git {arguments[0]} failed"
        raise _OlderVersionError(reason.removeprefix("fatal: "))
    if len(done.stdout) > _LARGEST:
        raise _OlderVersionError(f"the interface files of the revision hold more than {_LARGEST >> 20} MiB")
    return done.stdout
