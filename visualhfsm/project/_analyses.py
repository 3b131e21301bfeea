"""What is computed of a version of a document: problems, proofs, completions, component, run, picture."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document, resolve
from codegen.hfsm.document import Document
from codegen.messages import Message
from codegen.reasons import reason
from visualhfsm._base.errors import EditError, MissingError, VisualHfsmError
from visualhfsm._document.generate import generate_component, summary
from visualhfsm._document.imported_places import ImportedPlaces
from visualhfsm._document.places import Place, spots
from visualhfsm._document.problems import UNTITLED, Findings, Proof
from visualhfsm._document.serialization import parse_file, written
from visualhfsm.project._check_process import CheckProcess
from visualhfsm.project._code_help.question import Wanted
from visualhfsm.project._code_help.service import CodeHelp
from visualhfsm.project._session.files import read_file

from ._root import Root
from ._version import Version

if TYPE_CHECKING:
    from visualhfsm.simulation._behavior import Behavior


class Tools(Protocol):
    """What analyses need of the project."""

    @property
    def root(self) -> Root:
        """The folder of the project."""

    @property
    def include(self) -> Sequence[Path]:
        """Directories with packages of interfaces."""

    @property
    def checks(self) -> CheckProcess:
        """The process that checks documents."""

    @property
    def code_help(self) -> CodeHelp:
        """The processes that read code."""


class Analyses:
    """The analyses of one document, in any version; thread-safe. Errors are VisualHfsmError.

    `checked` is called with a version that was checked.
    """

    def __init__(self, tools: Tools, checked: Callable[[Version, Findings], None]) -> None:
        self._tools = tools
        self._checked = checked
        self._check_lock = threading.RLock()
        self._kept: tuple[Version, Findings] | None = None

    def check(self, version: Version, *, again: bool = False) -> Findings:
        """Return what was found in the last checked version if it is this one, or else check this one."""
        tools = self._tools
        with self._check_lock:
            kept = self._kept
            if again or kept is None or not _same(kept[0], version):
                findings = tools.checks.check(version.document, version.path, tools.include)
            else:
                findings = kept[1]
                if kept[0].revision == version.revision:
                    return findings
            self._kept = version, findings
        self._checked(version, findings)
        return findings

    def imports(self, version: Version) -> ImportedPlaces:
        """Return the places of the files that the document imports, read now."""
        path = version.path or self._tools.root.directory / UNTITLED
        return ImportedPlaces(version.document, path, self._tools.include)

    def prove(self, version: Version) -> list[Proof]:
        """Return the verdict on each property; raises EditError when the model checker did not run."""
        findings = self.check(version)
        if findings.proofs is None:
            what = Message("Cannot prove the properties of {version}", version=version.title)
            if not findings.problems:  # nothing was drawn yet, which is no problem
                raise EditError(what, Message("it has no states"), Message("draw some first"))
            errors = [each.message for each in findings.problems if each.severity == "error"]
            why = errors[0] if errors else findings.problems[-1].message
            raise EditError(
                what, why, Message("fix the errors first") if errors else Message("make the document smaller")
            )
        return [*findings.proofs]

    def help_with_code(
        self, wanted: Wanted, version: Version, place: Place, code: str | None, position: tuple[int, int]
    ) -> Any:  # noqa: ANN401 - what `CodeHelp.ask` returns
        """Ask about the code at a place, by default that of the version, at a line and a column."""
        if code is None:
            code = next((spot.text for spot in spots(version.document) if spot.place == place), None)
        line, column = position
        return self._tools.code_help.ask(
            wanted, version.document, version.path, place, code or "", line=line, column=column
        )

    def generate(self, version: Version, directory: Path | None) -> Path:
        """Write the component beside the document, or into a directory, and return its file."""
        if version.path is None and directory is None:
            hint = Message("save it first, or name a directory")
            raise EditError(
                Message("Cannot generate the component"), Message("the document has no file yet"), hint
            )
        diagnostics = Diagnostics()
        file, content = self._source(version)
        include = self._tools.include
        found = generate_component(file, directory, diagnostics, include, document=content)
        if found is None:
            raise VisualHfsmError(summary(diagnostics))
        return found

    def simulate(self, version: Version, **options: Any) -> Behavior:  # noqa: ANN401 - of Behavior
        """Return a run of the component in virtual time."""
        # Only who simulates waits for the runtime and the robots.
        from visualhfsm.simulation._behavior import simulate
        from visualhfsm.simulation._loading import DocumentInvalid

        file, content = self._source(version)
        try:
            return simulate(file, content=content, include=self._tools.include, **options)
        except DocumentInvalid as error:
            raise VisualHfsmError(reason(error)) from error

    def svg(self, version: Version, automaton: int | None) -> str:
        """Return a picture of an automaton, by default of the root; imported ones are drawn, too."""
        # Only who draws waits for what places labels and arcs.
        from visualhfsm._drawing.svg import svg

        document = version.document
        if version.path is not None:
            document = resolve(document, version.path, Diagnostics(), self._tools.include)
        if automaton is None:
            root = document.root
            if root is None:
                raise MissingError.because("{version} has no automaton to draw", version=version.title)
            automaton = root.id
        return svg(document, automaton, component=version.component)

    def _source(self, version: Version) -> tuple[Path, Document | None]:
        """Return the file of a version, and its content if the file does not hold it.

        The content has the places that it has when it is written.
        """
        file = version.path or self._tools.root.directory / f"{version.component}.xml"
        if _holds(file, version.document):
            return file, None
        diagnostics = Diagnostics()
        content = parse_document(written(version.document), file, diagnostics)
        if content is None:
            raise VisualHfsmError(summary(diagnostics))
        return file, content


def _holds(file: Path, document: Document) -> bool:
    """Return whether a file holds a document: another program may just have changed it."""
    try:
        return parse_file(read_file(file)[0], file) == document
    except EditError:
        return False


def _same(one: Version, other: Version) -> bool:
    """Return whether two versions are checked alike."""
    return one.document is other.document and one.path == other.path
