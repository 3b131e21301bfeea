"""`visualhfsm convert IN OUT`: convert documents of any age to the current format."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Final

import typer

from codegen.diagnostics import Diagnostics
from codegen.files import FilesNotWrittenError, GeneratedFile, apply, compare_with_disk
from codegen.options import ErrorFormat, report
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._base.options import ErrorsAs, examples

EPILOG: Final = examples(
    "convert old.xml new.xml",
    "convert --fix-python2 --force follow_ball.xml follow_ball.xml",
    "convert follow_ball.xml follow_ball.scxml",
    "convert --error-format json old.xml - > new.xml",
)

_STANDARD_OUTPUT: Final = "-"


def convert(
    source: Annotated[Path, typer.Argument(metavar="IN", help="A document in any format: .xml, .scxml.")],
    target: Annotated[
        str, typer.Argument(metavar="OUT", help="The file to write: .xml, .scxml, or - for stdout.")
    ],
    *,
    fix_python2: Annotated[
        bool, typer.Option("--fix-python2", help="Convert Python 2 to Python 3 where nothing else is wrong.")
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="Overwrite OUT, which may be IN itself.")] = False,
    error_format: ErrorsAs = ErrorFormat.TEXT,
) -> None:
    """Convert a document of any age to the current format, or to SCXML.

    The input may be a document of VisualHFSM of 2013 in Spanish or of 2013 to 2017, one of VisualStates since
    2017, or SCXML of any program. Unknown elements are kept and reported. Python 2 is reported, and converted
    on request. C++ is kept, but cannot run. After an error OUT is not written, and the exit code is 1; so it
    is when OUT is written without something of IN, which W501 and W561 name. Other remarks leave it at 0.
    """
    # Imported here: other commands need not wait for the readers of documents.
    from codegen.hfsm.codes import LOST
    from codegen.hfsm.formats.others import imported_suffixes, writable_formats
    from visualhfsm._document.conversion import convert_document

    path = Path(target)
    to_file = target != _STANDARD_OUTPUT
    others = writable_formats()
    _check_suffix(source, imported_suffixes(), "IN")
    if to_file:
        _check_suffix(path, others, "OUT")
        if path.exists() and not force:
            raise typer.BadParameter(f"{path} exists: --force overwrites it", param_hint="OUT")
    to = others.get(path.suffix.lower())
    diagnostics = Diagnostics()
    with VisualHfsmError.in_place_of(ModuleNotFoundError):
        text = convert_document(source, diagnostics, to=to, fixes_python2=fix_python2)
    report(diagnostics, error_format)
    if to_file:
        _write(path, text, error_format)
    else:
        typer.echo(text, nl=False)
    if lost := sum(each.code in LOST for each in diagnostics):
        if error_format is ErrorFormat.TEXT:
            typer.echo(f"not all of {source} is in it: see W501 and W561 above ({lost})", err=True)
        raise typer.Exit(1)


def _write(path: Path, text: str, error_format: ErrorFormat) -> None:
    with (
        VisualHfsmError.in_place_of(FilesNotWrittenError),
        VisualHfsmError.in_place_of(OSError, "{path}: cannot be written: {reason}", path=str(path)),
    ):
        changes = compare_with_disk([GeneratedFile(path, text)])
        apply(changes)
    if error_format is ErrorFormat.TEXT:  # programs read the rest of stderr
        typer.echo(f"wrote {path}" if changes.write else f"{path} is up to date", err=True)


def _check_suffix(path: Path, others: Iterable[str], name: str) -> None:
    """Refuse a file of an unknown format as wrong usage."""
    known = [".xml", *others]
    if path.suffix.lower() not in known:
        raise typer.BadParameter(f"expected a file that ends with {' or '.join(known)}", param_hint=name)
