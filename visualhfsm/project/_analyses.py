"""What is computed of a version of a document: problems, proofs, completions, component, run, picture."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from codegen.diagnostics import Diagnostics
from codegen.hfsm import resolve
from codegen.hfsm.document import Document
from codegen.messages import Message
from codegen.reasons import reason
from visualhfsm._base.errors import EditError, MissingError, VisualHfsmError
from visualhfsm._document.generate import generate_component
from visualhfsm._document.imported_places import ImportedPlaces
from visualhfsm._document.places import Place, texts_in
from visualhfsm._document.problems import UNTITLED, Findings, Problem, Proof
from visualhfsm._document.reasons import refusal
from visualhfsm._document.serialization import parse_file, written
from visualhfsm.project._code_help.protocol import Completions, Explanation, Signature, Wanted
from visualhfsm.project._editing.files import read_file
from zenoh_ice.data import typed

from ._folder import ProjectFolder
from ._version import Version

if TYPE_CHECKING:
    from visualhfsm.simulation import RobotKind
    from visualhfsm.simulation._behavior import Behavior
    from visualhfsm.trials import Archive

    from ._verdict import Judgement, Verdict


class Analyses:
    """The part of `OpenDocument` that changes nothing: it works on the version that was there when called."""

    version: Version
    """The document at this moment."""

    def __init__(self, folder: ProjectFolder) -> None:
        self._folder = folder
        self._check_lock = threading.RLock()
        self._kept: tuple[Version, Findings] | None = None

    def _checked(self, version: Version, findings: Findings) -> None:
        """Notify the listeners of a version that was checked."""
        raise NotImplementedError

    # -- checks --------------------------------------------------------------------------------------------

    def check(self, *, again: bool = False) -> Findings:
        """Return all that checks and the model checker find in the document, in another process.

        It is computed once for each version: `again` is for other files that have changed, such as imported
        ones. After 20 s the model checker is left out, as a problem says. No code of the document is run.
        """
        version, folder = self.version, self._folder
        with self._check_lock:
            former, findings = self._kept or (None, Findings())
            if (
                again
                or former is None
                or former.document is not version.document
                or former.path != version.path
            ):
                findings = folder.checks.check(
                    version.document, version.path, folder.include, partial(self._checked, version)
                )
            elif former.revision == version.revision:
                return findings
            if not findings.pending:
                self._kept = version, findings
        self._checked(version, findings)
        return findings

    def imports(self) -> ImportedPlaces:
        """Return the places of the files that the document imports, read now."""
        version, folder = self.version, self._folder
        path = version.path or folder.root.directory / UNTITLED
        return ImportedPlaces(version.document, path, folder.include)

    def problems(self) -> list[Problem]:
        """Return what is wrong, doubtful or worth knowing, errors first; see `check`."""
        return [*self.check().problems]

    def prove(self) -> list[Proof]:
        """Return the verdict on each property of the document, in their order; see `check`.

        Raises EditError when the document has errors, or the model checker takes too long.
        """
        version = self.version
        findings = self.check()
        if findings.proofs is None:
            what = Message("Cannot prove the properties of {version}", version=version.title)
            if not findings.problems:  # nothing was drawn yet, which is no problem
                raise EditError(what, "it has no states", "draw some first")
            errors = [each.message for each in findings.problems if each.severity == "error"]
            why = errors[0] if errors else findings.problems[-1].message
            raise EditError(
                what, why, Message("fix the errors first") if errors else Message("make the document smaller")
            )
        return [*findings.proofs]

    def verdict(
        self,
        *,
        seconds: float = 10.0,
        patience: float = 60.0,
        allow: Callable[[Archive], object] = lambda _: None,
        body: str = "",
    ) -> Verdict:
        """Return whether the document is ready to drive a robot, or what is not; see `Verdict`.

        Its files are read once, and a copy is judged: beside `check`, it runs for some seconds of virtual
        time, with the robot without physics, of a `body` as `simulate` takes it, and its tests are run: both
        in other processes, with a limit of `patience` s each. `allow` gets the files of a document without
        errors, and raises what keeps it from running. Raises EditError for a document with changes that are
        not saved.
        """
        return self.judge(seconds=seconds, patience=patience, allow=allow, body=body).verdict

    def judge(
        self,
        *,
        seconds: float = 10.0,
        patience: float = 60.0,
        allow: Callable[[Archive], object] = lambda _: None,
        runs: bool = True,
        body: str = "",
    ) -> Judgement:
        """Return the verdict with what it was made of; see `verdict`. Without `runs` no code is run."""
        from ._copy import Copy  # only who judges waits for trials

        version, what, folder = self.version, Message("Cannot judge the document"), self._folder
        if version.path is None:
            raise EditError(what, "it has no file yet", "save it first")
        with Copy(version.path, folder.root.directory) as copy:
            document = parse_file(read_file(copy.document)[0], version.path)
            if document != version.document:
                raise EditError(what, "it has changes that are not saved", "save it first")
            findings = folder.checks.check(document, copy.document, folder.include)
            limits = (seconds, patience) if runs else None
            return folder.judge.judge(copy, document, findings, allow, limits, body=body)

    # -- code ----------------------------------------------------------------------------------------------

    def complete(
        self, place: Place, *, line: int = 1, column: int = 0, code: str | None = None
    ) -> Completions:
        """Return completions of the code at a place, best first; `line` counts from 1, `column` from 0.

        `code` is the code as it is being typed, by default that of the document. It is read in another
        process, and never run.
        """
        found = self._help_with_code("complete", place, code, line, column)
        return Completions(0, []) if found is None else typed.convert(found, Completions)

    def explain(
        self, place: Place, *, line: int = 1, column: int = 0, code: str | None = None
    ) -> Explanation | None:
        """Return what the name at a position of the code stands for; see `complete`."""
        return typed.convert(self._help_with_code("explain", place, code, line, column), Explanation | None)

    def signature(
        self, place: Place, *, line: int = 1, column: int = 0, code: str | None = None
    ) -> Signature | None:
        """Return the parameters of the call around a position of the code; see `complete`."""
        return typed.convert(self._help_with_code("signature", place, code, line, column), Signature | None)

    def _help_with_code(self, wanted: Wanted, place: Place, code: str | None, line: int, column: int) -> Any:  # noqa: ANN401 - what `CodeHelp.ask` returns
        version = self.version
        if code is None:
            code = next((placed.text for placed in texts_in(version.document) if placed.place == place), None)
        ask = self._folder.code_help.ask
        return ask(wanted, version.document, version.path, place, code or "", line=line, column=column)

    def generate(self, directory: str | Path | None = None) -> Path:
        """Write the component of the document as it is now, with unsaved changes, and return its file.

        It is written beside the document, or into a directory. Raises VisualHfsmError, with the first reason
        of its verdict, after errors.
        """
        version = self.version
        if version.path is None and directory is None:
            hint = Message("save it first, or name a directory")
            raise EditError("Cannot generate the component", "the document has no file yet", hint)
        output = None if directory is None else Path(directory)
        diagnostics, include = Diagnostics(decoded=True), self._folder.include
        file, content = self._source(version)
        found = generate_component(file, output, diagnostics, include, document=content)
        if found is None:
            raise refusal(file, diagnostics, include, document=content)
        return found

    def simulate(self, robot: RobotKind | None = None, **options: Any) -> Behavior:  # noqa: ANN401 - of Behavior
        """Return a run of the component in virtual time, in this process, with a robot or without one.

        `robot` is `fake` or `sim`; the options are those of `visualhfsm.simulation.simulate`. Close it at the
        end, or use a `with` block. This runs the code of the document.
        """
        # Only who simulates waits for the runtime and the robots.
        from visualhfsm.simulation._behavior import simulate
        from visualhfsm.simulation._loading import DocumentInvalid

        file, content = self._source(self.version)
        try:
            return simulate(file, content=content, include=self._folder.include, robot=robot, **options)
        except DocumentInvalid as error:
            raise VisualHfsmError(reason(error)) from error

    def svg(self, automaton: int | None = None) -> str:
        """Return a picture of an automaton, by default of the root, as SVG; imported ones are drawn, too."""
        # Only who draws waits for what places labels and arcs.
        from visualhfsm._drawing.svg import svg

        version = self.version
        document = version.document
        if version.path is not None:
            document = resolve(document, version.path, Diagnostics(), self._folder.include)
        if automaton is None:
            root = document.root
            if root is None:
                raise MissingError.because("{version} has no automaton to draw", version=version.title)
            automaton = root.id
        return svg(document, automaton, component=version.component)

    def _repr_svg_(self) -> str:
        """Show the root in a notebook."""
        return self.svg()

    def _source(self, version: Version) -> tuple[Path, Document | None]:
        """Return the file of a version, and its content if the file does not hold it.

        The content has the places that it has when it is written.
        """
        file = version.path or self._folder.root.directory / f"{version.component}.xml"
        if _holds(file, version.document):
            return file, None
        return file, parse_file(written(version.document).encode(), file)


def _holds(file: Path, document: Document) -> bool:
    """Return whether a file holds a document: another program may just have changed it."""
    try:
        return parse_file(read_file(file)[0], file) == document
    except EditError:
        return False
