"""The command `visualhfsm draw`: a picture of one automaton of a document, or a page with all of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from codegen.diagnostics import Diagnostics
from codegen.options import DOCUMENTS, ErrorFormat, report, require_directories, require_extensions
from visualhfsm._base.errors import MissingError, VisualHfsmError
from visualhfsm._base.options import Include, examples

if TYPE_CHECKING:
    from codegen.hfsm.document import Automaton, Document

EPILOG: Final = examples(
    "draw follow_ball.xml",
    "draw dance_and_follow.xml docs/dance.svg --automaton dance",
    "draw dance_and_follow.xml drawing.html",
    "draw follow_ball.xml - > picture.svg",
)

_PAGES: Final = frozenset((".html", ".htm"))
_STANDARD_OUTPUT: Final = Path("-")


def draw(
    source: Annotated[Path, typer.Argument(metavar="DOCUMENT", help="The document to draw.")],
    picture: Annotated[
        Path | None,
        typer.Argument(
            metavar="FILE",
            help="The file to write: a picture, a page where its name ends in .html, or - for stdout.",
            show_default="DOCUMENT.svg",
        ),
    ] = None,
    *,
    automaton: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="The state whose automaton to draw, or the number of an automaton.",
            show_default="the root",
        ),
    ] = "",
    include: Include = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite FILE.")] = False,
) -> None:
    """Draw one automaton of a document as an SVG picture, or all of them as a page of HTML.

    A page is as the editor exports it: one file, to look at and to send, that shows every automaton with its
    code, needs no network, and changes nothing. Parts of imported documents are drawn, too.
    """
    # Imported here: other commands need not wait for the reader of documents.
    from codegen.hfsm import read_document, resolve
    from visualhfsm._drawing.page import drawing_page
    from visualhfsm._drawing.svg import svg

    require_extensions([source], DOCUMENTS)
    target = picture or source.with_suffix(".svg")
    is_page = target.suffix.lower() in _PAGES
    if is_page and automaton:
        why = "a page shows all automata: name a file that ends in .svg for one of them"
        raise typer.BadParameter(why, param_hint="--automaton")
    to_file = target != _STANDARD_OUTPUT
    if to_file and target.exists() and not force:
        raise typer.BadParameter(f"{target} exists: --force overwrites it", param_hint="FILE")
    diagnostics = Diagnostics()
    document = read_document(source, diagnostics)
    if document is not None:
        document = resolve(document, source, diagnostics, require_directories(include))
    report(diagnostics, ErrorFormat.TEXT)
    assert document is not None  # otherwise there are errors
    if is_page:
        drawn = drawing_page(source.stem, document)
    else:
        drawn = svg(document, _find(document, automaton).id, component=source.stem)
    if not to_file:
        typer.echo(drawn, nl=False)
        return
    with VisualHfsmError.in_place_of(OSError, "{path}: cannot be written: {reason}", path=str(target)):
        target.write_text(drawn, encoding="utf-8")
    typer.echo(f"wrote {target}", err=True)


def _find(document: Document, name: str) -> Automaton:
    """Return the automaton that a name means; raise MissingError for none, or several."""
    if not name:
        root = document.root
        if root is None:
            raise MissingError.because("the document has no root: name an automaton with --automaton")
        return root
    found = [
        each
        for each in document.automata
        if str(each.id) == name or ((owner := document.owner(each)) is not None and owner.name == name)
    ]
    if len(found) == 1:
        return found[0]
    if found:
        numbers = ", ".join(str(each.id) for each in found)
        raise MissingError.because(
            "several automata belong to states named {name}: choose one of {numbers}",
            name=name,
            numbers=numbers,
        )
    owners = {owner.name for each in document.automata if (owner := document.owner(each)) is not None}
    known = ", ".join(sorted(owners)) or "none"
    raise MissingError.because(
        "no state named {name} has an automaton; those that have one: {known}", name=name, known=known
    )
