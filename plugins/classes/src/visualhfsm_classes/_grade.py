"""Grade one document: run all trials of an exercise, and judge each by the criteria."""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import msgspec

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document
from codegen.reasons import reason
from hfsm_runtime.virtual.errors import ExecutionError
from visualhfsm.simulation import DocumentInvalid
from visualhfsm.trials import Outcome, TrialsError, quiet, run_trial
from visualhfsm_classes._containment import Containment
from visualhfsm_classes._criteria import Verdict, did, judge
from visualhfsm_classes._errors import ComputerFailed, ComputerTooBusy, GradingError
from visualhfsm_classes._exercise import SOLUTION, Exercise
from visualhfsm_classes._judged_run import JudgedRun
from visualhfsm_classes._marks import Earned, Marks
from visualhfsm_classes._words import say
from zenoh_ice.data.text import encodable, printable

if TYPE_CHECKING:
    from visualhfsm.trials import Plan
    from visualhfsm_classes._exercise import Criterion

_LONGEST_REASON: Final = 600
_ENOUGH: Final = 2
"""States of one name by which another exercise is recognized."""
_DIGITS: Final = 3
_ATTEMPTS: Final = 3
"""The most attempts at a trial for which the computer has no time, or no process."""
_AROUND: Final = re.compile(r" cannot be (run|read):$|^\d+ errors?\b")
"""Lines of the compiler before and after the errors."""
_COMPILED: Final = re.compile(r"\S+\.py:\d+ \(([^()\n]*)\)")
"""A line of the component, with that of the document that the pupil knows."""


@dataclass(frozen=True, slots=True)
class _Judged:
    """A trial that was judged."""

    plan: str
    number: int
    verdicts: Sequence[Verdict | None]
    """One for each criterion, None where the trial does not count for it."""
    error: str = ""
    """The error that ended it."""
    did: str = ""
    """Its states, in words."""

    def lost(self, exercise: Exercise) -> float:
        """Return how many points were lost in it."""
        given = zip(exercise.criteria, self.verdicts, strict=True)
        return sum(of.points * (1.0 - each.share) for of, each in given if each is not None)


class Grader:
    """Grade a document by an exercise, in words of a language.

    The document's folder is that of the document alone: what stands beside it can be imported. Raises
    SandboxUnavailable where its code cannot be contained, unless it is `unsafe`.
    """

    def __init__(self, exercise: Exercise, document: Path, language: str, *, unsafe: bool) -> None:
        self._exercise = exercise
        self._document = document
        self._language = exercise.language(language)
        self._unsafe = unsafe
        self._worst: _Judged | None = None

    def grade(self, name: str) -> Marks:
        """Return the marks of the document, which is the submission of that name.

        Raises ComputerTooBusy if it cannot be graded now.
        """
        exercise = self._exercise
        try:
            with self._containment() as containment, quiet():
                for each in {name for plan in exercise.plans.values() for name in plan.others}:
                    with GradingError.in_place_of(
                        DocumentInvalid, "the exercise {name}: {reason}", name=exercise.name
                    ):
                        containment.read(exercise.folder / each)
                judged = [
                    self._run(containment, plan_name, number)
                    for plan_name, plan in exercise.plans.items()
                    for number in plan.trials
                ]
        except DocumentInvalid as error:
            return Marks.broken(exercise, name, self._language, self._plain(str(error)))
        self._worst = max(judged, key=lambda each: each.lost(exercise))  # the first of equals
        return Marks(
            name=name,
            language=self._language,
            earned=tuple(
                self._earned(criterion, [each.verdicts[index] for each in judged])
                for index, criterion in enumerate(exercise.criteria)
            ),
            error=next((each.error for each in judged if each.error), ""),
            did=self._besides(self._worst),
            worst_plan=self._worst.plan,
            worst_number=self._worst.number,
        )

    def _besides(self, worst: _Judged) -> str:
        """Say what a document did in the trial that lost the most points; empty if it lost none."""
        if not worst.lost(self._exercise):
            return ""
        other = other_exercise(self._exercise, self._document)
        found = [say(self._language, "other", name=other)] if other else []
        return "; ".join([*found, worst.did] if worst.did else found)

    def record(self, marks: Marks, recording: Path) -> None:
        """Judge the worst trial again, and record it in a file. Raises VisualHfsmError."""
        plan = self._plan(marks.worst_plan)
        with self._containment(shows_variables=True) as containment, quiet():
            run_trial(
                plan,
                marks.worst_number,
                recording,
                folder=self._exercise.folder,
                simulate=containment.simulate,
            )

    def _containment(self, *, shows_variables: bool = False) -> Containment:
        beside = sorted(path for path in self._document.parent.iterdir() if path != self._document)
        ours = sorted(self._exercise.folder.glob("*.xml"))  # what the documents of other robots may import
        return Containment(
            files=[*beside, *ours],
            hidden=[self._exercise.folder],
            seconds=max(plan.limit for plan in self._exercise.plans.values()),
            shows_variables=shows_variables,
            unsafe=self._unsafe,
        )

    def _plan(self, name: str) -> Plan:
        return msgspec.structs.replace(self._exercise.plans[name], document=str(self._document))

    def _run(self, containment: Containment, name: str, number: int) -> _Judged:
        for _ in range(_ATTEMPTS - 1):
            with suppress(ComputerTooBusy, ComputerFailed):
                return self._try(containment, name, number)
        return self._try(containment, name, number)

    def _try(self, containment: Containment, name: str, number: int) -> _Judged:
        witness = _Judge(self._exercise, name, self._language)
        try:
            outcome = run_trial(
                self._plan(name),
                number,
                folder=self._exercise.folder,
                simulate=containment.simulate,
                witness=witness,
            )
        except DocumentInvalid:
            raise
        except (TrialsError, ExecutionError) as error:
            if error.__cause__ is not None and not isinstance(error.__cause__, ExecutionError):
                raise GradingError(reason(error)) from error  # the plan and the computer make the robot
            return self._stopped(name, number, str(error))
        if outcome.error or not witness.verdicts:
            return self._stopped(name, number, outcome.error or outcome.reason, witness.did)
        return _Judged(name, number, witness.verdicts, did=witness.did)

    def _stopped(self, plan: str, number: int, error: str, did: str = "") -> _Judged:
        """Return what a trial came to that an error ended."""
        verdict = Verdict(0.0, say(self._language, "stopped"))
        verdicts = [
            verdict if not each.trials or plan in each.trials else None for each in self._exercise.criteria
        ]
        return _Judged(plan, number, verdicts, self._plain(error), did)

    def _plain(self, error: str) -> str:
        """Return what an error says first, without the folder in which the document is graded."""
        text = error.replace(f"{self._document.parent}/", "").partition("\ntimeline of ")[0]
        lines = [printable(encodable(line)) for line in text.splitlines() if not _AROUND.search(line)]
        return _COMPILED.sub(r"\1", "\n".join(lines)).strip()[:_LONGEST_REASON]

    def _earned(self, criterion: Criterion, verdicts: Sequence[Verdict | None]) -> Earned:
        """Return what a criterion earned in all its trials, in the words of the first one that is worst."""
        counted = [each for each in verdicts if each is not None]
        worst = min(counted, key=lambda each: each.share)
        share = sum(each.share for each in counted) / len(counted)
        words = worst.words
        less = sum(each.share < 1.0 for each in counted)
        if 0 < less < len(counted):
            words = say(self._language, "in trials", count=less, all=len(counted), words=words)
        return Earned(
            asks=criterion.asks[self._language],
            points=round(criterion.points * share, _DIGITS),
            of=criterion.points,
            words=words,
            failed=any(each.failed for each in counted),
        )


class _Judge(JudgedRun):
    """The run of a trial, which is judged at its end."""

    def __init__(self, exercise: Exercise, plan: str, language: str) -> None:
        super().__init__(exercise.plans[plan])
        self._exercise = exercise
        self._plan = plan
        self._language = language
        self.verdicts: list[Verdict | None] = []
        """One for each criterion; empty if it did not come to its end."""
        self.did = ""

    def end(self, outcome: Outcome) -> None:
        """Judge it, unless an error ended it."""
        self.did = did(self, self._language, failed=bool(outcome.error))
        if outcome.error:
            return
        self.verdicts = [
            judge(self, each, self._exercise, self._language)
            if not each.trials or self._plan in each.trials
            else None
            for each in self._exercise.criteria
        ]


def other_exercise(exercise: Exercise, document: Path) -> str:
    """Return the name of the exercise beside this one that a document is for; empty if it is of this one."""
    own = _states(document)
    if len(own) < _ENOUGH or own & _states(exercise.solution):
        return ""
    for solution in sorted(exercise.folder.parent.glob(f"*/{SOLUTION}")):
        theirs = _states(solution)
        if len(own & theirs) >= _ENOUGH and (own <= theirs or theirs <= own):
            return solution.relative_to(exercise.folder.parent).parts[0]
    return ""


def _states(path: Path) -> set[str]:
    """Return the names of all states of a document, none if it cannot be read."""
    try:
        document = read_document(path, Diagnostics())
    except (OSError, ValueError, RecursionError):
        return set()
    found = document.automata if document is not None else ()
    return {state.name.strip() for automaton in found for state in automaton.states}
