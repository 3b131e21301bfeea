"""One verdict on a document: ready to drive a robot, or what is not, in the order of what to mend first.

First comes what checks and the model checker find; then a run in virtual time, with the robot that has no
physics; then the document's tests. No code of a document with errors is run.
"""

from __future__ import annotations

import hashlib
import re
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final, Literal

import msgspec

from codegen.hfsm.document import Document
from visualhfsm._base.environment import child_environment
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._base.languages import decode_message
from visualhfsm._base.line_process import kill_group
from visualhfsm._document.places import Located, Locator, Place, texts_in
from visualhfsm._document.problems import Findings, Problem
from visualhfsm._processes.document_tests import TestResult, find_tests, test_files, tests_command, top_of
from visualhfsm.trials import Archive, Outcome, Plan, Processes, Task, make_archive, versions
from zenoh_ice.application import tether_command
from zenoh_ice.data import typed

SECONDS: Final = 10.0
"""Virtual time of the run, in s."""
_RUN_LIMIT: Final = 30.0
"""Longest wall time of the run, in s."""
_TESTS_LIMIT: Final = 120.0
"""Longest wall time of the tests, in s."""
_MEMORY: Final = 2000
"""Most memory of the run, in MB."""
_MOST: Final = 100
"""Reasons, warnings, and steps of a reason, that are listed."""
_LONGEST_RESULTS: Final = 8 << 20
_AT: Final = re.compile(r"\bat \S+ \((?P<file>[^()\s]+):(?P<line>\d{1,9})\)")
_SEVERE: Final = "error"


class Reason(msgspec.Struct, frozen=True, kw_only=True, rename="camel", omit_defaults=True):
    """One thing to mend, who `found` it, and where.

    `line` is that of the `file`, from 1; `place` is an element of the document, as in its commands, and
    `where` says it in words. `steps` lead there: those of a counterexample, or of the run.
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
    """What else is known, and what to do."""


class Verdict(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    """Whether a document is `ready`, and if not why: `reasons`, what to mend first at first.

    `warnings` and properties that are `undecided` leave it ready. The `digest` is that of all files that a
    run uses, and of the versions of what runs them: of others the verdict may be another one.
    """

    document: str
    ready: bool
    reasons: tuple[Reason, ...] = ()
    warnings: tuple[Reason, ...] = ()
    proved: tuple[str, ...] = ()
    """The properties that hold in all runs."""
    undecided: tuple[str, ...] = ()
    """The properties of which the model checker does not know."""
    tests: int = 0
    """The tests that passed."""
    seconds: float = 0.0
    """Virtual time of the run, in s."""
    digest: str = ""


class Judge:
    """Runs what verdicts need in processes, which last from verdict to verdict. A context that ends them."""

    def __init__(self, root: Path, include: Sequence[Path] = ()) -> None:
        self._root = root
        self._include = include
        self._processes = Processes()

    def close(self) -> None:
        """End the processes."""
        self._processes.close()

    def judge(
        self, file: Path, content: bytes, document: Document, findings: Findings, *, seconds: float
    ) -> Verdict:
        """Return the verdict on a document, which was read from the content of its file, and was checked.

        Raises VisualHfsmError if there are too many files beside it.
        """
        archive = make_archive(file, content)
        places = _Places(document, file)
        found = [places.reason(each) for each in findings.problems if each.severity == _SEVERE]
        proofs = findings.proofs or ()
        tests = 0
        if not found:
            found += self._run(archive, seconds)
            results, failed = self._test(file)
            tests = sum(each.outcome == "passed" for each in results)
            found += failed
        if make_archive(file, content) != archive:
            found.insert(0, Reason(found="files", message="files changed meanwhile", hints=("ask again",)))
        return Verdict(
            document=file.name,
            ready=not found,
            reasons=tuple(found[:_MOST]),
            warnings=tuple(
                places.reason(each) for each in findings.problems[:_MOST] if each.severity == "warning"
            ),
            proved=tuple(each.name or each.expression for each in proofs if each.verdict == "holds"),
            undecided=tuple(each.name or each.expression for each in proofs if each.verdict == "undecided"),
            tests=tests,
            seconds=seconds,
            digest=digest_of(archive),
        )

    def _run(self, archive: Archive, seconds: float) -> Iterator[Reason]:
        """Yield what is wrong with a run in virtual time."""
        plan = Plan(robot="fake", limit=seconds, patience=_RUN_LIMIT, memory=_MEMORY, stand_ins=True)
        try:
            outcome = self._processes.run(Task(plan, 1, archive))
        except VisualHfsmError as error:
            yield Reason(found="run", message=str(error))
            return
        if not outcome.success:
            yield _failed_run(outcome)

    def _test(self, file: Path) -> tuple[list[TestResult], list[Reason]]:
        """Run the document's tests; return how they went, and what is wrong."""
        top = top_of(file, self._root)
        names = find_tests(test_files(file, self._root), file, self._root)
        if not names:
            return [], []
        with TemporaryDirectory(prefix="visualhfsm-tests-", ignore_cleanup_errors=True) as folder:
            results = Path(folder, "results")
            results.touch()
            places = dict.fromkeys(name.partition("::")[0] for name in names)
            said = _said_by(
                tests_command(top, places, results), {**child_environment(self._include), "TMPDIR": folder}
            )
            lines = results.read_bytes()[:_LONGEST_RESULTS].splitlines() if results.is_file() else []
        found: list[TestResult] = []
        try:
            found += (typed.from_json(line, TestResult, dec_hook=decode_message) for line in lines)
        except (msgspec.MsgspecError, RecursionError) as error:  # a test wrote it
            said = f"the results of the tests cannot be read: {error}"
        failed = [_failed_test(each) for each in found if each.outcome == "failed"]
        if said and not failed:
            failed.append(Reason(found="tests", message=said))
        return found, failed


def digest_of(archive: Archive) -> str:
    """Return the digest of the files of a verdict, and of the versions of what runs them."""
    return hashlib.sha256(archive.digest.encode() + msgspec.json.encode(versions())).hexdigest()


class _Places:
    """The places of problems, in words and as lines of the file."""

    def __init__(self, document: Document, file: Path) -> None:
        self._file = file
        self._locator = Locator(document)
        self._lines = {placed.place: placed.line for placed in texts_in(document) if placed.line}
        self._states = {
            (automaton.id, state.id): state.name.strip()
            for automaton in document.automata
            for state in automaton.states
        }

    def reason(self, problem: Problem) -> Reason:
        """Return a problem as a reason."""
        place, where, line, state = problem.place, problem.where, problem.line, ""
        if place is not None and not problem.file:
            where = self._locator.name(Located(place, problem.line, problem.column))
            line = self._lines.get(place, 0) + max(problem.line - 1, 0)
        if place is not None and place.kind == "state":
            state = self._states.get((place.automaton, place.id), "")
        shown = problem.counterexample
        steps = () if shown is None else shown.steps[:_MOST]
        return Reason(
            found="checks" if shown is None else "model checker",
            message=str(problem.message),
            file=problem.file or self._file.name,
            line=line,
            state=state,
            where=str(where),
            place=place,
            steps=tuple(f"{step.time_ms / 1000:9.3f} s  {step.text}" for step in steps),
            hints=tuple(map(str, problem.notes)),
        )


def _failed_test(result: TestResult) -> Reason:
    """Return why a test failed."""
    return Reason(
        found="tests",
        message=result.reason,
        where=result.name,
        steps=tuple(result.timeline.splitlines()[-_MOST:]),
        hints=(f"run it alone: pytest {result.name}",),
    )


def _failed_run(outcome: Outcome) -> Reason:
    """Return why a run in virtual time failed."""
    at = _AT.search(outcome.error)
    return Reason(
        found="run",
        message=outcome.reason,
        file="" if at is None else at["file"],
        line=0 if at is None else int(at["line"]),
        state=outcome.states,
        steps=tuple(outcome.error.splitlines()[1:][-_MOST:]),
    )


def _said_by(command: Sequence[str], environment: dict[str, str]) -> str:
    """Run pytest, and return what it says unless all tests passed."""
    process = subprocess.Popen(
        [*tether_command(), *command],
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    )
    try:
        output, _ = process.communicate(timeout=_TESTS_LIMIT)
    except subprocess.TimeoutExpired:
        return f"the tests took more than {_TESTS_LIMIT:g} s"
    finally:
        kill_group(process)  # with what tests have started
        process.wait()
    return "" if process.returncode == 0 else output.decode(errors="replace")[-2000:].strip()
