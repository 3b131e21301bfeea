"""One verdict on a document: ready to drive a robot, or what is not, in the order of what to fix first.

First comes what checks and the model checker find; then a run in virtual time, with the robot that has no
physics; then the document's tests. No code of a document with errors is run.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import re
import subprocess
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory, TemporaryFile
from typing import Any, Final, Literal

import msgspec

from codegen.hfsm.codes import PROVED
from codegen.hfsm.document import Document
from visualhfsm._base.environment import child_environment
from visualhfsm._base.errors import MissingPackageError, VisualHfsmError
from visualhfsm._base.languages import decode_message
from visualhfsm._base.line_process import kill_group
from visualhfsm._document.places import Located, Locator, Place, texts_in
from visualhfsm._document.problems import Findings, Problem
from visualhfsm._processes import document_tests as of_tests
from visualhfsm.trials import Archive, Plan, Processes, Task, make_archive, versions
from zenoh_ice.application import tether_command
from zenoh_ice.data import typed
from zenoh_ice.data.text import sentence

_MEMORY: Final = 2000
"""Most memory of the run, in MB."""
_MOST: Final = 100
"""Reasons, warnings, and steps of a reason, that are listed."""
_MOST_RESULTS: Final = 8 << 20  # bytes
_MOST_SAID: Final = 2000  # bytes
_AT: Final = re.compile(r"(?:^|\bat \S+ \()(?P<file>[^()\s:]+):(?P<line>\d{1,9})[:)]")
"""A place in the error of a run, or of a test."""


class Reason(msgspec.Struct, frozen=True, kw_only=True, rename="camel", omit_defaults=True):
    """One thing to fix, who `found` it, and where.

    `line` is that of the `file`, from 1; `place` is an element of the document, as in its commands, and
    `where` says it in words. `steps` lead there: those of a counterexample, or of the run. `hints` are what
    else is known, and what to do.
    """

    found: Literal["checks", "model checker", "run", "tests", "files"]
    message: str
    file: str = ""
    line: int = 0
    state: str = ""
    where: str = ""
    place: Place | None = None
    steps: tuple[str, ...] = ()
    hints: tuple[str, ...] = ()


class Verdict(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    """Whether a document is `ready`, and if not why: `reasons`, what to fix first at first.

    `proved` are the properties that hold in all runs. `warnings`, and properties that the model checker left
    `undecided`, leave it ready. `tests` is how many passed, `seconds` the virtual time of the run. The
    `digest` is that of all files that a run uses, and of the versions of what runs them: of others the
    verdict may be another one.
    """

    document: str
    ready: bool
    reasons: tuple[Reason, ...] = ()
    warnings: tuple[Reason, ...] = ()
    proved: tuple[str, ...] = ()
    undecided: tuple[str, ...] = ()
    tests: int = 0
    seconds: float = 0.0
    digest: str = ""


def digest_of(archive: Archive) -> str:
    """Return the digest of files and of the versions of what runs them, as a verdict has it."""
    return hashlib.sha256(archive.digest.encode() + msgspec.json.encode(versions())).hexdigest()


@dataclass(frozen=True)
class Judge:
    """Runs what verdicts need in processes, which last from verdict to verdict until they are closed."""

    root: Path
    include: Sequence[Path] = ()
    _processes: Processes = field(default_factory=Processes)
    _thread: ThreadPoolExecutor = field(default_factory=partial(ThreadPoolExecutor, 1, "verdict"))
    """Each thread has its own process: one is enough for all who ask."""

    _tests: list[subprocess.Popen[bytes]] = field(default_factory=list)
    """The processes of tests that run."""

    def close(self) -> None:
        """End the processes."""
        self._processes.close()
        for process in [*self._tests]:
            kill_group(process)
        self._thread.shutdown()

    def judge(
        self, file: Path, check: Callable[[], tuple[Document, Findings]], *, seconds: float, patience: float
    ) -> Verdict:
        """Return the verdict on a file, which `check` reads and checks.

        Raises VisualHfsmError if there are too many files beside it, and what `check` raises.
        """
        archive = make_archive(file)
        document, findings = check()
        names = [each.name.strip() or each.expression.text for each in document.properties]
        proofs = [each.verdict for each in findings.proofs or ()] or ["undecided"] * len(names)
        found = [*_reasons(document, file, findings.problems, "error")]
        passed = 0
        if not found:
            found += self._run(archive, document, seconds, patience)
            passed, failed = self._test(file, patience)
            found += failed
        if make_archive(file) != archive:
            changed = sentence("files changed meanwhile")
            found.insert(0, Reason(found="files", message=changed, hints=("ask again",)))
        return Verdict(
            document=file.name,
            ready=not found,
            reasons=tuple(found[:_MOST]),
            warnings=tuple(islice(_reasons(document, file, findings.problems, "warning"), _MOST)),
            proved=tuple(name for name, proof in zip(names, proofs, strict=True) if proof == "holds"),
            undecided=tuple(name for name, proof in zip(names, proofs, strict=True) if proof == "undecided"),
            tests=passed,
            seconds=seconds,
            digest=digest_of(archive),
        )

    def _run(self, archive: Archive, document: Document, seconds: float, patience: float) -> Iterator[Reason]:
        """Yield what is wrong with a run in virtual time."""
        plan = Plan(robot="fake", limit=seconds, patience=patience, memory=_MEMORY, stand_ins=True)
        name = Path(archive.document).name
        hints = (f"see it in a dry run: visualhfsm edit {name}",)
        try:
            outcome = self._thread.submit(self._processes.run, Task(plan, 1, archive)).result()
        except VisualHfsmError as error:
            yield Reason(found="run", message=str(error), hints=hints)
            return
        if not outcome.success:
            at = _place_in(outcome.error)
            code = Locator(document).find_code(at["line"]) if at.get("file") == name else None
            yield Reason(
                found="run",
                message=sentence(f"a run in virtual time failed: {outcome.reason}"),
                state=outcome.states,
                steps=tuple(outcome.error.splitlines()[1:][-_MOST:]),
                hints=hints,
                place=code and code.place,
                **at,
            )

    def _test(self, file: Path, patience: float) -> tuple[int, list[Reason]]:
        """Run the document's tests; return how many passed, and what is wrong."""
        top = of_tests.top_of(file, self.root)
        names = of_tests.find_tests(of_tests.test_files(file, self.root), file, self.root)
        if not names:
            return 0, []
        if importlib.util.find_spec("pytest") is None:
            return 0, [Reason(found="tests", message=str(MissingPackageError("pytest", "test")))]
        with TemporaryDirectory(prefix="visualhfsm-tests-", ignore_cleanup_errors=True) as folder:
            results = Path(folder, "results")
            places = dict.fromkeys(name.partition("::")[0] for name in names)
            command = [*tether_command(), *of_tests.tests_command(top, places, results)]
            environment = {**child_environment(self.include), "TMPDIR": folder}
            code, said = self._run_to_end(command, environment, patience)
            written = results.read_bytes()[:_MOST_RESULTS] if results.is_file() else b""
        lines = filter(None, written.splitlines())
        try:
            went = [typed.from_json(line, of_tests.TestResult, dec_hook=decode_message) for line in lines]
        except (msgspec.MsgspecError, RecursionError):  # a test wrote it
            went, written = [], b""
        failed = [
            Reason(
                found="tests",
                message=each.reason,
                where=each.name,
                steps=tuple(each.timeline.splitlines()[-_MOST:]),
                hints=(f"run it alone: pytest {each.name}",),
                **_place_in(each.reason),
            )
            for each in went
            if each.outcome == "failed"
        ]
        if code is None or not written.endswith(of_tests.END_OF_RESULTS) or (code and not failed):
            ended = sentence(f"the tests took more than {patience:g} s")
            if code is not None:
                ended = sentence(f"pytest ended with {code}, and did not say how all tests went")
            done = {each.name.partition("[")[0] for each in went}
            first = next((name for name in names if name not in done), "")
            failed.append(Reason(found="tests", message=ended, where=first, steps=tuple(said.splitlines())))
        return sum(each.outcome == "passed" for each in went), failed

    def _run_to_end(
        self, command: Sequence[str], env: dict[str, str], limit: float
    ) -> tuple[int | None, str]:
        """Run a command; return its exit code, None if it takes too long, and the end of what it writes."""
        with TemporaryFile() as output:
            process: subprocess.Popen[bytes] = subprocess.Popen(
                command,
                env=env,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=output,
                start_new_session=True,
            )
            self._tests.append(process)
            try:
                code: int | None = process.wait(limit)
            except subprocess.TimeoutExpired:
                code = None
            finally:
                kill_group(process)  # with what tests have started
                process.wait()
                self._tests.remove(process)
            output.seek(max(0, output.seek(0, os.SEEK_END) - _MOST_SAID))
            return code, output.read().decode(errors="replace").strip()


def _reasons(document: Document, file: Path, problems: Iterable[Problem], severity: str) -> Iterator[Reason]:
    """Yield the problems of a severity as reasons, with their places in words and as lines of the file."""
    locator = Locator(document)
    lines = {placed.place: placed.line for placed in texts_in(document)}
    states = {(each.id, state.id): state.name for each in document.automata for state in each.states}
    for problem in problems:
        if problem.severity != severity:
            continue
        place, where, line, state = problem.place, problem.where, problem.line, ""
        if place is not None and not problem.file:
            where = locator.name(Located(place, line, problem.column))
            line = lines.get(place, 0) + max(line - 1, 0)
        if place is not None and place.kind == "state":
            state = states.get((place.automaton, place.id), "").strip()
        steps = problem.counterexample.steps[:_MOST] if problem.counterexample else ()
        if steps:
            state = states.get((steps[-1].automaton, steps[-1].state), "").strip()
        yield Reason(
            found="model checker" if problem.code in PROVED else "checks",
            message=str(problem.message),
            file=problem.file or file.name,
            line=line,
            state=state,
            where=str(where),
            place=place,
            steps=tuple(f"{each.time_ms / 1000:9.3f} s  {each.text}" for each in steps),
            hints=tuple(str(note) for note in problem.notes if not steps or "\n" not in note),
        )


def _place_in(error: str) -> dict[str, Any]:
    """Return file and line of an error, as far as it says them."""
    at = _AT.search(error)
    return {"file": at["file"], "line": int(at["line"])} if at else {}
