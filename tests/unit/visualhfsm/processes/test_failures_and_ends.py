"""How and where a component ended, from what it wrote and what it executed."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from codegen.messages import Message
from tests.support.editing import tree
from visualhfsm._document.origins import Origin, Origins
from visualhfsm._document.places import Place
from visualhfsm._monitor.messages import Stopper
from visualhfsm._processes.failures import End, LastWords, describe_end
from zenoh_ice.application.last_cycle import LastCycle

HERE = Origin(Place(kind="state", automaton=1, id=1, part="code"), 2)
CALLED = Origin(Place(kind="automaton", automaton=1, part="functions"), 1)
LOGGED = "2026-11-21 13:49:57.123"
KILLED = -signal.SIGKILL
DOCUMENT = tree()
STATE = DOCUMENT.automata[0].states[0]
ITS_PLACE = Origin(Place(kind="state", automaton=DOCUMENT.automata[0].id, id=STATE.id), 0)
CUT_SHORT = LastCycle(DOCUMENT.automata[0].id, STATE.id, 0, running=True)
ORIGINS = Origins(DOCUMENT, Path("walk.xml"), Path("walk.py"))


def words(*heard: tuple[str, Origin | None]) -> LastWords:
    made = LastWords()
    for line, origin in heard:
        made.parse(line, origin)
    return made


def test_the_last_error_leads_to_its_place_and_what_is_no_error_does_not() -> None:
    error = f"{LOGGED} ERROR    walk: walk/go: ValueError at walk.py:9 (walk.xml:4)", HERE
    warning = f"{LOGGED} WARNING  walk: walk/go: is refused at walk.py:3 (walk.xml:2)", CALLED
    assert describe_end(1, words(error, warning), None, None, stopped=False)[1] == HERE
    assert describe_end(1, words(warning), None, None, stopped=False)[1] is None


def test_a_crash_leads_to_its_innermost_frame() -> None:
    crash = words(
        ('  File "walk.py", line 3, in earlier', CALLED),
        ("Fatal Python error: Aborted", None),
        ('  File "walk.py", line 9 in state_go', HERE),
        ('  File "walk.py", line 3 in help', CALLED),
    )
    assert describe_end(-6, crash, LastCycle(1, 1, 0, running=True), None, stopped=False)[1] == HERE


def test_an_end_that_was_requested_or_in_order_leads_nowhere() -> None:
    error = words((f"{LOGGED} ERROR    walk: at walk.py:9 (walk.xml:4)", HERE))
    assert describe_end(130, error, None, None, stopped=True) == End(Message("it was stopped"))
    assert describe_end(KILLED, error, LastCycle(1, 1, 0, running=True), None, stopped=True)[1] is None
    assert describe_end(0, error, None, None, stopped=False) == End(Message("it has finished"))


@pytest.mark.parametrize(
    ("by", "says"), [("window", "it was stopped in another window"), ("viewer", "it was stopped by a viewer")]
)
def test_an_end_that_was_requested_says_by_whom(by: Stopper, says: str) -> None:
    assert describe_end(130, words(), None, None, stopped=True, by=by) == End(Message(says))
    assert describe_end(3, words(), None, None, stopped=True, by=by).message == "it ended with exit code 3"


@pytest.mark.parametrize("code", [0, 130, KILLED])
def test_a_stop_of_code_that_hangs_leads_to_its_line(code: int) -> None:
    what = "its cycle did not end within 1 s and is abandoned: its code must not block"
    hung = words(
        (f"{LOGGED} ERROR    walk: walk/go: {what} at walk.py:9 (walk.xml:4)", HERE),
        (f"{LOGGED} ERROR    walk: walk/wait: {what} at walk.py:3 (walk.xml:2)", CALLED),
    )
    end = describe_end(code, hung, None, None, stopped=True, by="viewer")
    assert end == End(Message("it was stopped by a viewer while hanging in go"), HERE, "go")


def test_a_stop_of_code_that_hangs_and_cannot_be_abandoned_leads_to_its_state() -> None:
    end = describe_end(KILLED, words(), CUT_SHORT, ORIGINS, stopped=True)
    assert end == End(Message(f"it was stopped while hanging in {STATE.name}"), ITS_PLACE, STATE.name)
    end = describe_end(KILLED, words(), CUT_SHORT._replace(running=False), ORIGINS, stopped=True)
    assert end == End(Message("it was terminated by SIGKILL"))


def test_what_was_cut_short_counts_more_than_an_earlier_error() -> None:
    error = words((f"{LOGGED} ERROR    walk: at walk.py:9 (walk.xml:4)", CALLED))
    message, origin, _ = describe_end(KILLED, error, CUT_SHORT, ORIGINS, stopped=False)
    assert message.endswith(f"because memory ran out, during a cycle in the state {STATE.name}")
    assert origin == ITS_PLACE
    message, *_ = describe_end(0, error, CUT_SHORT, ORIGINS, stopped=False)
    assert message.startswith("it ended at once, with exit code 0, during")
    # An automaton of another file is not in this document.
    assert describe_end(KILLED, error, LastCycle(999, 1, 0, running=True), ORIGINS, stopped=False) == End(
        Message("it was terminated by SIGKILL, by somebody or because memory ran out")
    )


@pytest.mark.parametrize(
    ("what", "short"),
    [
        ("ZeroDivisionError: float division by zero", "float division by zero in left"),
        ("KeyError: 'x'", "KeyError: 'x' in left"),
        (
            "NameError: `x` is one of a, and b has its own; write it",
            "`x` is one of a, and b has its own, in left",
        ),
        ("sys.exit(3) ends the component; a final state would end it", "sys.exit(3) in left"),
        ("os._exit(3) ends the process before it stops the robot", "os._exit(3) in left"),
    ],
)
def test_an_end_by_an_error_says_what_and_in_which_state(what: str, short: str) -> None:
    error = words((f"{LOGGED} ERROR    walk: walk/left: {what} at walk.py:9 (walk.xml:4)", HERE))
    assert describe_end(1, error, None, None, stopped=False) == End(
        Message("it ended: {short}", short=short), HERE
    )


def test_a_crash_is_in_the_state_whose_cycle_it_cut_short() -> None:
    crash = words(
        ("Fatal Python error: Segmentation fault", None), ('  File "walk.py", line 9 in state_go', HERE)
    )
    end = describe_end(-11, crash, CUT_SHORT, ORIGINS, stopped=False)
    assert end.message == f"it ended: Segmentation fault in {STATE.name}"
