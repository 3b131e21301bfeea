"""Judge a run by a criterion: what share of the points it earns, and why, in words with figures."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Final

import msgspec
from msgspec import Meta, Struct

from codegen.reasons import reason
from visualhfsm.trials import FunctionFailed, TrialsError, call_function
from visualhfsm_classes._errors import GradingError
from visualhfsm_classes._exercise import Criterion, Exercise
from visualhfsm_classes._judged_run import JudgedRun
from visualhfsm_classes._words import figure, say
from zenoh_ice.data import typed
from zenoh_ice.data.text import encodable, printable

_SLACK: Final = 1e-9
"""s by which a time in binary may be beyond its limit."""
_LONGEST_WORDS: Final = 500
_MOST_STATES: Final = 4
"""States of a run that are said."""
_LONGEST_STATE: Final = 60
_MILLISECONDS: Final = 3
"""Digits after the point."""

_Judged = tuple[Annotated[float, Meta(ge=0, le=1)], str | dict[str, str]]


class Verdict(Struct, frozen=True):
    """What a criterion says of one run."""

    share: float
    """Of the points, from 0 to 1."""
    words: str
    failed: bool = False
    """True if its judge failed: a fault of the exercise."""


def judge(run: JudgedRun, criterion: Criterion, exercise: Exercise, language: str) -> Verdict:
    """Return what a criterion says of a run at its end. Raises GradingError for a missing function."""
    if criterion.judge is not None:
        return _by_function(run, criterion.judge, exercise.folder, language)
    assert criterion.state is not None
    return _by_state(run, criterion, criterion.state, exercise.events, language)


def did(run: JudgedRun, language: str, *, failed: bool) -> str:
    """Return in which states a run was, and for how long: the first ones, in words."""
    current = run.current(failed=failed)
    if not current:
        return ""
    if len(current) == 1:
        return say(language, "did", states=say(language, "stayed in", state=_shown(current[0][2])))
    states = [
        say(language, "was in", state=_shown(state), time=figure(language, end - begin, _MILLISECONDS))
        for begin, end, state in current[:_MOST_STATES]
    ]
    if len(current) > _MOST_STATES:
        time = figure(language, run.time)
        states.append(say(language, "and so on", count=len(current) - 1, time=time))
    return say(language, "did", states=", ".join(states))


def _shown(state: str) -> str:
    return printable(encodable(state), _LONGEST_STATE).replace("`", "'")


def _by_state(
    run: JudgedRun, criterion: Criterion, state: str, events: Mapping[str, Mapping[str, str]], language: str
) -> Verdict:
    event = events[criterion.after][language] if criterion.after is not None else ""
    start = run.events[criterion.after] if criterion.after is not None else 0.0
    entered = run.entered(state, start)
    late = None if entered is None else entered - start
    if late is None:
        words = say(language, "never" if event else "never from start", state=state, event=event)
    elif late < _SLACK:
        words = say(language, "at once" if event else "starts", state=state, event=event)
    else:
        time = figure(language, late)
        words = say(language, "goes" if event else "goes from start", state=state, time=time, event=event)
    good = late is not None and (criterion.within is None or late <= criterion.within + _SLACK)
    if criterion.within is not None:
        words += say(language, "asked", time=figure(language, criterion.within))
    return Verdict(1.0 if good else 0.0, words)


def _by_function(run: JudgedRun, reference: str, folder: Path, language: str) -> Verdict:
    try:
        found = typed.convert(call_function(reference, folder.resolve(), run, lambda given: given), _Judged)
    except TrialsError as error:
        raise GradingError(reason(error)) from error
    except FunctionFailed as error:
        return Verdict(
            0.0,
            say(language, "judge failed", reason=printable(encodable(str(error)), _LONGEST_WORDS)),
            failed=True,
        )
    except msgspec.ValidationError as error:
        raise GradingError.because(
            '{folder}: it must return a share from 0 to 1 and words, as in return 1.0, {{"en": '
            '"walks 1.02 m", "es": "anda 1,02 m"}}: {reason}',
            folder=str(folder / reference),
            reason=reason(error),
        ) from error
    share, words = found
    if not isinstance(words, str):
        words = words.get(language) or next(iter(words.values()), "")
    return Verdict(share, printable(encodable(words), _LONGEST_WORDS))
