"""A run as a test for pytest: the states that it reached, with their times.

The test has the parameters of the run, and sends the events that came from outside as they came. What else
one did to the run, such as forcing a transition, is not known here, and conditions may depend on a world that
the robot of the test has not.
"""

from __future__ import annotations

import ast
import json
from collections.abc import Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Final

from codegen.hfsm.code.names import component_name
from codegen.hfsm.document import Automaton, Document
from codegen.messages import Message
from visualhfsm._errors import VisualHfsmError
from visualhfsm._monitoring.run_log import Timeline

_LATEST_START: Final = 0.5
"""Component time in s at which a run that was seen from its beginning was seen first."""
_MOST_CHANGES: Final = 60
_TOLERANCE: Final = 0.5
"""Seconds by which a time may differ: the clock of a run is not that of a test."""
_MOST_LEVELS: Final = 64
_EVENT: Final = "event"


def run_as_test(
    document: Document,
    path: str,
    timeline: Timeline,
    robot: str | None,
    parameters: Mapping[str, str] | None = None,
) -> str:
    """Return the text of a test, in which a document does what it did in a run.

    `path` is where a test finds it, `parameters` are those of the run, each as Python's repr. Raises
    VisualHfsmError for a run that was not seen from its beginning, or in which nothing happened.
    """
    if timeline.start > _LATEST_START:
        raise VisualHfsmError(
            Message(
                "the run was seen from {start:.1f} s on, not from its beginning: run it again",
                start=timeline.start,
            )
        )
    steps = [*islice(_steps(document, timeline), _MOST_CHANGES)]
    if not steps:
        raise VisualHfsmError(
            Message("the run has not changed its state yet: a test would have nothing to expect")
        )
    name = component_name(Path(path).stem)
    options = "" if robot is None else f", robot={json.dumps(robot)}"
    if given := [*_given(document, parameters or {})]:
        options += f", parameters={{{', '.join(given)}}}"
    lines = [
        f'"""{name} does what it did in a run, which the editor wrote down."""',
        "",
        "import pytest",
        "",
        "",
        f"def test_{name}_does_what_it_did(behavior):",
        f"    b = behavior({json.dumps(path)}{options})",
        *(f"    {line}" for step in steps for line in step),
    ]
    return "\n".join(lines) + "\n"


def _given(document: Document, parameters: Mapping[str, str]) -> Iterator[str]:
    """Yield the parameters whose values are not their defaults, as items of a dictionary."""
    for parameter in document.parameters:
        try:
            value = ast.literal_eval(parameters[parameter.name])
        except (KeyError, SyntaxError, ValueError):  # it has none, or a long one was cut
            continue
        try:
            is_default = value == ast.literal_eval(parameter.default.text.strip())
        except (SyntaxError, ValueError):
            is_default = False
        if not is_default and isinstance(value, bool | int | float | str):
            yield f"{json.dumps(parameter.name)}: {json.dumps(value) if isinstance(value, str) else value}"


def _steps(document: Document, timeline: Timeline) -> Iterator[list[str]]:
    """Yield the lines for each change of state."""
    outside = {event.name.strip() for event in document.events}
    former = 0.0
    for time, number, origin, destination, fired in timeline.changes:
        automaton = document.automaton(number)
        where = None if automaton is None else _path(document, automaton, destination)
        if automaton is None or where is None or time <= former or origin == destination:
            continue  # of another document, with the change before, or nothing that a path shows
        transition = next((each for each in automaton.transitions if each.id == fired), None)
        event = "" if transition is None or transition.type != _EVENT else transition.trigger.text.strip()
        lines = []
        if event in outside:
            lines += [f"b.advance({max(0.0, time - former - _period(automaton)):.3f})"]
            lines += [f"b.send({json.dumps(event)})"]
        lines += [f"b.run_until({json.dumps(where)}, limit={time - former + 2 * _TOLERANCE:.3f})"]
        lines += [f"assert b.time == pytest.approx({time:.3f}, abs={_TOLERANCE})"]
        former = time
        yield lines


def _period(automaton: Automaton) -> float:
    """Return the period of an automaton in s."""
    try:
        return max(0.0, float(automaton.iteration_time.text.strip())) / 1000
    except ValueError:
        return 0.1


def _path(document: Document, automaton: Automaton, state: int) -> str | None:
    """Return the path of a state from the root down; None for one that is not in the document."""
    names = [each.name for each in automaton.states if each.id == state]
    above: Automaton | None = automaton
    while names and above is not None and len(names) < _MOST_LEVELS:
        owner = document.owner(above)
        if owner is None:
            return "/".join(reversed(names))
        names.append(owner.name)
        above = document.automaton(above.father)
    return None
