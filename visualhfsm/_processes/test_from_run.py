"""A run as a test for pytest: the states that it reached, with their times.

The test has the parameters of the run, sends the events that came from outside, forces the transitions that
were forced, and sets what was set, each as it came. What it cannot repeat is named in its first lines.
Conditions may depend on a world that the robot of the test has not.
"""

from __future__ import annotations

import ast
import json
import math
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import groupby
from keyword import iskeyword
from operator import itemgetter
from pathlib import Path
from typing import Any, Final

from codegen.hfsm.code.names import component_name
from codegen.hfsm.document import Automaton, Document
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._monitor.realm.run_log import Intervention, Interventions, Timeline
from zenoh_ice.data.text import printable

_LATEST_START: Final = 0.5
"""Component time in s at which a run that was seen from its beginning was seen first."""
_MOST_CHANGES: Final = 60
_TOLERANCE: Final = 0.5
"""Seconds by which a time may differ: the clock of a run is not that of a test."""
_MOST_LEFT_OUT: Final = 40
"""Sentences about what a test leaves out."""
_DEEPEST_VALUE: Final = 40
"""Levels of a value that is written: Python reads no more than some hundred."""
_JUST_BEFORE: Final = 0.001
"""Seconds before a change of state at which something that may cause it is set at the latest."""
_LONGEST_NAME: Final = 100
_EVENT: Final = "event"
_NOT_KNOWN: Final = (
    "It is not known whether transitions were forced or variables set: the recording does not say."
)

_Change = tuple[float, int, int, int, int]
"""A change of state of a timeline: time, automaton, origin, destination, transition."""


@dataclass(frozen=True)
class RunTest:
    """A test of one document, and what it leaves out of a run, a sentence each."""

    options: str
    lines: Sequence[str]
    left_out: Sequence[str]

    def text(self, path: str) -> str:
        """Return the file of the test, which finds its document at a path."""
        name = component_name(Path(path).stem)
        lines = [
            f'"""{name} does what it did in a run, which the editor wrote down."""',
            *([""] if self.left_out else []),
            *(f"# {sentence}" for sentence in self.left_out),
            "",
            "import pytest",
            "",
            "",
            f"def test_{name}_does_what_it_did(behavior):",
            f"    b = behavior({_text(path)}{self.options})",
            *(f"    {line}" for line in self.lines),
        ]
        return "\n".join(lines) + "\n"


def run_as_test(
    document: Document,
    timeline: Timeline,
    robot: str | None,
    parameters: Mapping[str, str] | None = None,
    interventions: Interventions | None = None,
) -> RunTest:
    """Return a test, in which a document does what it did in a run.

    `parameters` are those at the beginning of the run, each as Python's repr, and `interventions` are what
    somebody did to it, None where that is not known. Raises VisualHfsmError for a run that was not seen from
    its beginning, or in which nothing happened.
    """
    if timeline.start > _LATEST_START:
        raise VisualHfsmError.because(
            "the run was seen from {start:.1f} s on, not from its beginning: run it again",
            start=timeline.start,
        )
    script = _Script(document, () if interventions is None else interventions.kept)
    script.repeat(timeline.changes)
    if not script.changes:
        raise VisualHfsmError.because(
            "the run has not changed its state yet: a test would have nothing to expect"
        )
    left_out = [_NOT_KNOWN] if interventions is None else []
    if interventions is not None and interventions.lost:
        left_out.append(f"Not in the test: what was done before the last {len(interventions.kept)} actions.")
    given, unknown = _given(document, parameters or {})
    left_out += [f"Not in the test: {printable(each)}." for each in (*unknown, *script.left_out)]
    if len(left_out) > _MOST_LEFT_OUT:
        more = len(left_out) - _MOST_LEFT_OUT
        left_out[_MOST_LEFT_OUT:] = [f"Not in the test: {more} more of such actions."]
    options = "" if robot is None else f", robot={_text(robot)}"
    if given:
        options += f", parameters={{{', '.join(given)}}}"
    return RunTest(options, script.lines, left_out)


def _given(document: Document, values: Mapping[str, str]) -> tuple[list[str], list[str]]:
    """Return the parameters that are not their defaults as items of a dictionary, and what is not known."""
    given, unknown = [], []
    for parameter in document.parameters:
        if parameter.name not in values:
            continue  # a new one has its default
        try:
            value = _value_of(values[parameter.name])
        except ValueError:
            name = parameter.name[:_LONGEST_NAME]
            unknown.append(f"the value of the parameter {name}, of which only the beginning is known")
            continue
        with suppress(ValueError):
            if value == _value_of(parameter.default.text.strip()):
                continue
        given.append(f"{_text(parameter.name)}: {_literal(value)}")
    return given, unknown


def _value_of(text: str) -> Any:  # noqa: ANN401 - whatever a parameter may be
    """Return the value that a repr shows; raises ValueError."""
    try:
        return ast.literal_eval(text)
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        return float(text)  # of nan, inf and -inf, which are no literals


class _Script:
    """The body of a test that repeats what was done to a run, and expects the same effects."""

    def __init__(self, document: Document, interventions: Sequence[Intervention]) -> None:
        self.lines: list[str] = []
        self.left_out: list[str] = []
        self.changes = 0
        """The number of changes of state that are expected."""
        self._document = document
        self._outside = {event.name.strip() for event in document.events}
        self._forced = [each for each in interventions if each.action == "forceTransition"]
        self._settings = deque(each for each in interventions if each.action == "setVariable")
        self._now = 0.0
        self._expected = 0.0
        for action, one, several in (
            ("step", "a cycle that was run by hand", "{} cycles that were run by hand"),
            ("reload", "the reload of the component", "{} reloads of the component"),
        ):
            found = [each for each in interventions if each.action == action]
            if len(found) == 1:
                self.left_out.append(f"{one} at {found[0].time:.3f} s")
            elif found:
                when = f"from {found[0].time:.3f} to {found[-1].time:.3f} s"
                self.left_out.append(f"{several.format(len(found))} {when}")

    def repeat(self, changes: Iterable[_Change]) -> None:
        """Write what was done before each change of state, and that the change follows."""
        for time, group in groupby(sorted(changes, key=itemgetter(0)), itemgetter(0)):
            if time > 0 and self.changes < _MOST_CHANGES:
                self._repeat(time, [*group])
        for each in sorted([*self._forced, *self._settings], key=lambda each: each.since):
            late = each.since >= self._expected
            why = "it follows the last change of state" if late else "no change of state shows that it fired"
            self.left_out.append(f"{self._said(each)}: {why}")

    def _repeat(self, time: float, changes: Iterable[_Change]) -> None:
        """Write what was done before the changes at a time, and the first of them that a path shows."""
        while self._settings and self._settings[0].since < time:
            self._set(self._settings.popleft(), time - _JUST_BEFORE)
        where = None
        causes: dict[str, float] = {}
        for _, number, origin, destination, fired in changes:
            automaton = self._document.automaton(number)
            if automaton is None:
                continue  # the run was of another document
            if cause := self._cause(time, automaton, destination, fired):
                causes[cause] = _period(automaton)
            if where is None and origin != destination:
                where = _path(self._document, automaton, destination)
        if causes:
            self._advance(time - max(causes.values()))
            self.lines += causes
        if where is not None:
            self.changes += 1
            limit = time - self._expected + 2 * _TOLERANCE
            self.lines += [
                f"b.run_until({_text(where)}, limit={limit:.3f})",
                f"assert b.time == pytest.approx({time:.3f}, abs={_TOLERANCE})",
            ]
            self._expected = self._now = time

    def _cause(self, time: float, automaton: Automaton, destination: int, fired: int) -> str:
        """Return the line that makes a transition fire; empty for one that fires by itself."""
        transition = next((each for each in automaton.transitions if each.id == fired), None)
        if transition is not None and transition.destination != destination:
            return ""  # it fired before: the state was entered again with that above it
        for each in self._forced:
            if each.since <= time and (each.automaton, each.transition) == (automaton.id, fired):
                self._forced.remove(each)
                return f"b.force({automaton.id}, {fired})"
        event = "" if transition is None or transition.type != _EVENT else transition.trigger.text.strip()
        return f"b.send({_text(event)})" if event in self._outside else ""

    def _set(self, setting: Intervention, latest: float) -> None:
        """Write that a variable, or a parameter, is set, or say why not."""
        name = setting.name
        if not setting.confirmed:
            self.left_out.append(f"{self._said(setting)}: whether it was set is not known")
            return
        if setting.value is None:
            self.left_out.append(f"{self._said(setting)}: its value is too long")
            return
        try:
            value = _literal(json.loads(setting.value))
        except (ValueError, RecursionError):
            self.left_out.append(f"{self._said(setting)}: its value cannot be written in Python")
            return
        if not name.isidentifier() or iskeyword(name):
            self.left_out.append(f"{self._said(setting)}: this is not a name of Python")
            return
        self._advance(min(setting.time, latest))
        self.lines.append(f"b.set({setting.automaton}, {name}={value})")

    def _advance(self, until: float) -> None:
        """Write that time passes up to a time of the run in s."""
        seconds = round(until - self._now, 3)
        if seconds > 0:
            self.lines.append(f"b.advance({seconds:.3f})")
            self._now = until

    def _said(self, done: Intervention) -> str:
        """Return what was done, and when, as part of a sentence."""
        what = f"automaton {done.automaton}" if done.automaton else "the component"
        if done.action == "setVariable":
            return f"{done.name[:_LONGEST_NAME]} of {what}, set at {done.time:.3f} s"
        automaton = self._document.automaton(done.automaton)
        transitions = () if automaton is None else automaton.transitions
        names = (each.name for each in transitions if each.id == done.transition and each.name)
        name = next(names, str(done.transition))[:_LONGEST_NAME]
        return f"the transition {name} of {what}, forced at {done.time:.3f} s"


def _literal(value: object, depth: int = 0) -> str:
    """Return a value of plain types as an expression of Python. Raises ValueError for a deep one."""
    if depth > _DEEPEST_VALUE:
        raise ValueError("the value has too many levels")
    match value:
        case str():
            return _text(value)
        case float() if not math.isfinite(value):
            return f'float("{value}")'
        case list():
            return f"[{', '.join(_literals(value, depth))}]"
        case tuple():
            return f"({', '.join(_literals(value, depth))}{',' * (len(value) == 1)})"
        case dict():
            pairs = zip(_literals(value, depth), _literals(value.values(), depth), strict=True)
            return f"{{{', '.join(f'{key}: {each}' for key, each in pairs)}}}"
    return repr(value)


def _literals(values: Iterable[object], depth: int) -> Iterator[str]:
    return (_literal(each, depth + 1) for each in values)


def _text(text: str) -> str:
    """Return a text as an expression of Python."""
    return json.dumps(text, ensure_ascii=False) if text.isprintable() else repr(text)


def _period(automaton: Automaton) -> float:
    """Return the period of an automaton in s."""
    try:
        return max(0.0, float(automaton.iteration_time.text.strip())) / 1000
    except ValueError:
        return 0.1


def _path(document: Document, automaton: Automaton, state: int) -> str | None:
    """Return the path of a state from the root down; None for one that is not in the document."""
    own = next((each for each in automaton.states if each.id == state), None)
    owners = map(document.owner, (automaton, *document.above(automaton)))
    names = [each.name for each in (own, *owners) if each is not None]
    return None if own is None else "/".join(reversed(names))
