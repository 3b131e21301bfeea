"""What a document must survive: a trial for each failure that it states; and which others nobody tried."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final, Literal

import msgspec

from codegen.hfsm.document import SUCCEED, Document, Survives
from codegen.messages import Message
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._document.places import Place
from visualhfsm._document.reasons import MOST, Reason
from visualhfsm.trials import (
    FAILURE,
    FATE,
    FATE_AT,
    SUFFIX,
    Outcome,
    Plan,
    TrialsError,
    failure_said,
    read_plan,
    untried_failures,
    with_failure,
)
from zenoh_ice.data import typed
from zenoh_ice.plugins import NotInstalledError, optional

Fate = Literal["succeeded", "stopped", "failed", "fell", "hung"]
_SAID: Final[dict[Fate, Message]] = {
    "succeeded": Message("with {failure} it went on until {at:.1f} s", failure="", at=0.0),
    "stopped": Message("with {failure} it stopped at {at:.1f} s", failure="", at=0.0),
    "failed": Message("with {failure} it went on until {at:.1f} s, and failed", failure="", at=0.0),
    "fell": Message("with {failure} it fell at {at:.1f} s", failure="", at=0.0),
    "hung": Message("with {failure} it hung at {at:.1f} s", failure="", at=0.0),
}
_SHORTEST: Final = 1.0
"""Least time in s that is left for a trial."""


class Survival(msgspec.Struct, frozen=True, kw_only=True, rename="camel", omit_defaults=True):
    """What became of a behavior under a `failure`, such as `Camera black`, since which virtual `seconds`.

    It `held` if that is what the document states. `error` is that of its code, or of its trial.
    """

    failure: str
    held: bool
    fate: Fate
    seconds: float
    error: str = ""

    @property
    def text(self) -> Message:
        """It in words: what fails, the fate and when."""
        said = _SAID[self.fate].again({"failure": self.failure, "at": self.seconds})
        return Message("{said}: {why}", said=said, why=failure_said(self.error)) if self.error else said


class NeverTried(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    """How many of `all` failures that the robot of a document can have were never tried, and what tries them.

    Of links the first counts, and of two sides the left one: those that a sweep tries.
    """

    count: int
    all: int
    sweep: str

    @property
    def text(self) -> Message:
        """It in one line."""
        return Message(
            "never tried: {count} of the {all} failures that its robot can have: {sweep}",
            count=self.count,
            all=self.all,
            sweep=self.sweep,
        )


def try_failures(
    document: Document, file: Path, plan: Plan, run: Callable[[Plan], Outcome]
) -> Iterator[tuple[Survival | None, Reason | None]]:
    """Yield what became of a behavior under each failure that it must survive, and why that is not enough.

    Each trial is the first of the plan beside the `file`, as in a sweep, or of `plan`; the plan's limit is
    the time from the failure on. All together take the patience of `plan` at most.
    """
    until = time.monotonic() + plan.patience
    for index, each in enumerate(document.survives):
        at: dict[str, Any] = {"file": file.name, "line": each.line}
        at["place"] = Place(kind="document", part="survives", index=index)
        try:
            amount = float(each.amount) if each.amount else None
            planned = with_failure(_planned(file, plan), each.part, each.kind, amount, each.fails_at)
            if (left := until - time.monotonic()) < _SHORTEST:
                raise VisualHfsmError.because(
                    "no time is left for {failure}: all failures took {patience:g} s",
                    failure=each.failure,
                    patience=plan.patience,
                )
            outcome = run(msgspec.structs.replace(planned, patience=left))
            _require_tried(each, outcome)
        except VisualHfsmError as error:
            yield None, Reason(found="survives", message=error.message, **at)
            continue
        found = _judged(each, planned, outcome)
        if found.held:
            yield found, None
            continue
        message = Message("it does not survive: {what}", what=found.text)
        if each.must == SUCCEED and found.fate == "stopped":
            message = Message("it must succeed: {what}", what=found.text)
        steps = tuple(outcome.error.splitlines()[1:][-MOST:])
        yield found, Reason(found="survives", message=message, state=outcome.states, steps=steps, **at)


def _planned(file: Path, plan: Plan) -> Plan:
    """Return the plan of trials of a document with the body of `plan`. Raises TrialsError."""
    beside = file.with_name(file.stem + SUFFIX)
    if not beside.is_file():
        return plan
    found = read_plan(beside, document=file)
    if found.others:
        raise TrialsError.because(
            "{path}: a verdict tries one robot alone, not with others", path=beside.name
        )
    return msgspec.structs.replace(found, scene={**found.scene, **plan.scene})


def _require_tried(survives: Survives, outcome: Outcome) -> None:
    """Raise VisualHfsmError for a trial that says nothing about a failure."""
    if FATE in outcome.groups and outcome.time < survives.fails_at:
        raise VisualHfsmError.because(
            "it ended at {at:.1f} s, before {failure}: write an earlier `after`",
            at=outcome.time,
            failure=survives.failure,
        )
    if FATE not in outcome.groups and outcome.time:  # a function of its plan failed
        raise VisualHfsmError.because(
            "nothing is known of {failure}: {why}",
            failure=survives.failure,
            why=failure_said(outcome.reason),
        )


def _judged(survives: Survives, plan: Plan, outcome: Outcome) -> Survival:
    # Without a fate its trial took too long, or its process ended.
    fate = typed.convert(outcome.groups.get(FATE, "hung"), Fate)
    succeeded = fate == "succeeded" or (outcome.success and outcome.time < plan.limit)  # it ended by itself
    return Survival(
        failure=survives.failure,
        held=fate in ("stopped", "succeeded") and (succeeded or survives.must != SUCCEED),
        fate=fate,
        seconds=outcome.numbers.get(FATE_AT, outcome.time),
        error=outcome.reason if outcome.error or FATE not in outcome.groups else "",
    )


def never_tried(document: Document, file: Path, plan: Plan) -> NeverTried | None:
    """Return which failures were never tried, by what the document states and the kept sweep beside it.

    It is None for a document that uses no robot. Raises VisualHfsmError.
    """
    if not document.all_interfaces and not any(each.imported for each in document.automata):
        return None
    kept = file.with_name(f"{file.stem}.sweep.outcomes.jsonl")
    tried = {f"{each.part} {each.kind}" for each in document.survives}
    if kept.is_file() and kept.stat().st_mtime >= file.stat().st_mtime:
        tried |= _swept(kept)
    count, total = untried_failures(_planned(file, Plan(scene=plan.scene)), tried)
    here = Path.cwd()
    name = file.relative_to(here) if file.is_relative_to(here) else file.name
    sweep = f"visualhfsm sweep {name}" + " --again" * kept.is_file()
    try:
        optional("visualhfsm_trials", "visualhfsm[trials]")
    except NotInstalledError as error:
        sweep = str(error)
    return NeverTried(count=count, all=total, sweep=sweep)


class _Line(msgspec.Struct):
    """A line of a kept sweep: an outcome, or something without values."""

    values: dict[str, Any] = {}


def _swept(kept: Path) -> set[str]:
    """Return what failed in the trials of a kept sweep. Raises VisualHfsmError."""
    with (
        VisualHfsmError.in_place_of(
            (OSError, msgspec.MsgspecError), "{path}: it is no kept sweep: {reason}", path=kept.name
        ),
        kept.open("rb") as file,
    ):
        # The last line may have been cut off.
        lines = [typed.from_json(line, _Line) for line in file if line.endswith(b"\n")]
    return {str(each.values[FAILURE]) for each in lines if FAILURE in each.values}
