"""One verdict on a document: ready to drive a robot, or what is not, in the order of what to fix first.

First comes what checks and the model checker find; then a run in virtual time, with the robot that has no
physics; then trials in which the robot fails as the document must survive; then its tests. No code of a
document with errors is run.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import re
import subprocess
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory, TemporaryFile
from typing import Any, Final, NamedTuple

import msgspec

from codegen.hfsm.codes import UNREADY
from codegen.hfsm.document import Document
from codegen.messages import Message
from visualhfsm._base.environment import child_environment
from visualhfsm._base.errors import MissingPackageError, VisualHfsmError
from visualhfsm._base.languages import decode_message
from visualhfsm._base.line_process import kill_group
from visualhfsm._base.recognition import reason_of
from visualhfsm._document.places import Locator
from visualhfsm._document.problems import Findings
from visualhfsm._document.reasons import MOST, Reason, reasons_of
from visualhfsm._processes import document_tests as of_tests
from visualhfsm.trials import Archive, Outcome, Plan, Processes, Quantity, Task, failure_said, versions
from zenoh_ice.application import tether_command
from zenoh_ice.data import typed
from zenoh_ice.data.text import sentence

from ._copy import Copy
from ._survival import NeverTried, Survival, never_tried, try_failures

_MEMORY: Final = 2000
"""Most memory of the run, in MB."""
_MOST_RESULTS: Final = 8 << 20  # bytes
_MOST_SAID: Final = 2000  # bytes
_AT: Final = re.compile(r"(?:^|\bat \S+ \()(?P<file>[^()\s:]+):(?P<line>\d{1,9})[:)]")
"""A place in the error of a run, or of a test."""


class Verdict(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    """Whether a document is `ready`, and if not why: `reasons`, what to fix first at first.

    `proved` are the properties that hold in all runs. `warnings` leave it ready, and so do properties that
    the model checker left `undecided`, and those `not_shown` by the run to be violated, which they are if
    certain guards ever hold. `survivals` say what became of it under each failure that it must survive, and
    `never_tried` how many others nobody tried, if it uses a robot. `tests` is how many passed, `seconds` the
    virtual time of the run, `missed` the names of states in which it never stayed. The `digest` is that of
    all files that a run uses, and of the versions of what runs them: of others the verdict may be another
    one.
    """

    document: str
    ready: bool
    reasons: tuple[Reason, ...] = ()
    warnings: tuple[Reason, ...] = ()
    proved: tuple[str, ...] = ()
    undecided: tuple[str, ...] = ()
    not_shown: tuple[str, ...] = ()
    survivals: tuple[Survival, ...] = ()
    never_tried: NeverTried | None = None
    tests: int = 0
    seconds: float = 0.0
    missed: tuple[str, ...] = ()
    digest: str = ""


class Judgement(NamedTuple):
    """A verdict, and what it was made of: what checks found, and how the tests went.

    Of the tests the results name the `file`, the copy of the document.
    """

    verdict: Verdict
    findings: Findings
    file: Path
    tests: tuple[of_tests.TestResult, ...] = ()


def digest_of(archive: Archive) -> str:
    """Return the digest of files and of the versions of what runs them, as a verdict has it."""
    return hashlib.sha256(archive.digest.encode() + msgspec.json.encode(versions())).hexdigest()


@dataclass(frozen=True)
class Judge:
    """Runs what verdicts need in processes, which last from verdict to verdict until they are closed."""

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
        self,
        copy: Copy,
        document: Document,
        findings: Findings,
        allow: Callable[[Archive], object],
        limits: tuple[float, float] | None,
        *,
        body: str,
    ) -> Judgement:
        """Return the judgement of a document, of which findings are known; `allow`, `body`: see `verdict`.

        `limits` are the virtual time of the run, and the time of the run, of all failures and of the tests,
        in s; without them no code is run.
        """
        archive, name = copy.archive, copy.document.name
        names = [each.name.strip() or each.expression.text for each in document.properties]
        proofs = [each.verdict for each in findings.proofs or ()] or ["undecided"] * len(names)
        # What is violated only if guards hold, of which nothing says that they do, the run is to show.
        doubtful = [each for each in findings.problems if each.counterexample and each.counterexample.guards]
        certain = [each for each in findings.problems if each not in doubtful]
        warnings = [*reasons_of(document, copy.document, findings.problems, "warning")]
        never_ready = [each for each in warnings if each.code in UNREADY]
        found = [*reasons_of(document, copy.document, certain), *never_ready]
        not_shown: tuple[str, ...] = ()
        went: tuple[of_tests.TestResult, ...] = ()
        missed: tuple[str, ...] = ()
        tried: list[tuple[Survival | None, Reason | None]] = []
        untried: NeverTried | None = None
        seconds, patience = limits or (0.0, 0.0)
        if found or not limits:
            found = [*reasons_of(document, copy.document, findings.problems), *never_ready]
        else:
            allow(archive)
            not_shown = tuple(names[each.place.index] for each in doubtful if each.place)
            scene: dict[str, Quantity] = {"body": body} if body else {}
            plan = Plan(
                robot="fake", limit=seconds, patience=patience, memory=_MEMORY, stand_ins=True, scene=scene
            )
            trial = partial(self._trial, archive)
            missed, failed = self._run(document, name, plan, trial)
            if not failed:
                tried = [*try_failures(document, copy.home, plan, trial)]
                try:
                    untried = never_tried(document, copy.home, plan)
                except VisualHfsmError as error:  # of a sweep that somebody kept
                    warnings.append(Reason(found="survives", message=error.message))
            found += [*failed, *(reason for _, reason in tried if reason)]
            went, failed = self._test(copy, patience)
            found += failed
        verdict = Verdict(
            document=name,
            ready=not found,
            reasons=tuple(found[:MOST]),
            warnings=tuple(each for each in warnings if each.code not in UNREADY)[:MOST],
            proved=tuple(name for name, proof in zip(names, proofs, strict=True) if proof == "holds"),
            undecided=tuple(name for name, proof in zip(names, proofs, strict=True) if proof == "undecided"),
            not_shown=not_shown,
            survivals=tuple(each for each, _ in tried if each),
            never_tried=untried,
            tests=sum(each.outcome == "passed" for each in went),
            seconds=seconds,
            missed=missed,
            digest=digest_of(archive),
        )
        return Judgement(verdict, findings, copy.document, went)

    def _trial(self, archive: Archive, plan: Plan) -> Outcome:
        """Run a trial of the document. Raises VisualHfsmError."""
        return self._thread.submit(self._processes.run, Task(plan, 1, archive)).result()

    def _run(
        self, document: Document, name: str, plan: Plan, trial: Callable[[Plan], Outcome]
    ) -> tuple[tuple[str, ...], list[Reason]]:
        """Run in virtual time; return the states in which it never stayed, and what is wrong with it."""
        hints = (f"see it in a dry run: visualhfsm edit {name}",)
        try:
            outcome = trial(plan)
        except VisualHfsmError as error:
            return (), [
                Reason(found="run", message=error.message, hints=hints, **_place_in(f"{error.message}"))
            ]
        if outcome.success:
            return _missed(document, outcome), []
        at = _place_in(outcome.error)
        code = Locator(document).find_code(at["line"]) if at.get("file") == name else None
        why = failure_said(outcome.reason)
        reason = Reason(
            found="run",
            message=Message("a run in virtual time failed: {why}", why=why),
            state=outcome.states,
            steps=tuple(outcome.error.splitlines()[1:][-MOST:]),
            hints=hints,
            place=code and code.place,
            **at,
        )
        return (), [reason]

    def _test(self, copy: Copy, patience: float) -> tuple[tuple[of_tests.TestResult, ...], list[Reason]]:
        """Run the document's tests; return how they went, and what is wrong."""
        names = copy.tests()
        if not names:
            return (), []
        if importlib.util.find_spec("pytest") is None:
            return (), [Reason(found="tests", message=MissingPackageError("pytest", "test").message)]
        with TemporaryDirectory(prefix="visualhfsm-tests-", ignore_cleanup_errors=True) as folder:
            results = Path(folder, "results")
            places = dict.fromkeys(name.partition("::")[0] for name in names)
            command = [*tether_command(), *of_tests.tests_command(copy.top, places, results)]
            environment = {**child_environment(self.include), "TMPDIR": folder}
            code, said = self._run_to_end(command, copy.top, environment, patience)
            written = results.read_bytes()[:_MOST_RESULTS] if results.is_file() else b""
        lines = filter(None, written.splitlines())
        try:
            went = tuple(
                typed.from_json(line, of_tests.TestResult, dec_hook=decode_message) for line in lines
            )
        except (msgspec.MsgspecError, RecursionError):  # a test wrote it
            went, written = (), b""
        failed = [
            Reason(
                found="tests",
                message=reason_of(each.reason),
                where=each.name,
                steps=tuple(each.timeline.splitlines()[-MOST:]),
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
            steps = tuple(copy.plain(said).splitlines())
            failed.append(Reason(found="tests", message=reason_of(ended), where=first, steps=steps))
        return went, failed

    def _run_to_end(
        self, command: Sequence[str], cwd: Path, env: dict[str, str], limit: float
    ) -> tuple[int | None, str]:
        """Run a command; return its exit code, None if it takes too long, and the end of what it writes."""
        with TemporaryFile() as output:
            process: subprocess.Popen[bytes] = subprocess.Popen(
                command,
                cwd=cwd,
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


def _place_in(error: str) -> dict[str, Any]:
    """Return file and line of an error, as far as it says them."""
    at = _AT.search(error)
    return {"file": at["file"], "line": int(at["line"])} if at else {}


def _missed(document: Document, outcome: Outcome) -> tuple[str, ...]:
    """Return the names of states in which a run never stayed, as far as is known."""
    if outcome.left_out:
        return ()
    paths = "/".join(each.states.replace(", ", "/") for each in outcome.changes)
    names = dict.fromkeys(state.name for _, state in document.states() if state.name)
    return tuple(name for name in names if f"/{name}/" not in f"/{paths}/")
