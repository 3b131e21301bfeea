"""What is told of code that fails in an unusual way, with its place in the document, by both drivers."""

from __future__ import annotations

import logging
import re
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from hfsm_runtime import Component
from hfsm_runtime._component_run import ComponentRun
from hfsm_runtime._runtime import Runtime
from hfsm_runtime._variables import variables_of
from hfsm_runtime.debugger.reload import Reloading
from hfsm_runtime.errors import ReloadRefusedError, VariablesError
from hfsm_runtime.virtual import BehaviorFailed, Execution
from tests.support.documents import compile_to, document, load, state, sub, transition
from tests.support.fast_clock import FastClock
from tests.support.waiting import until

CLASSES = """
class Torn:
    def __bool__(self):
        raise ValueError("torn")

    def __repr__(self):
        raise ValueError("no repr")

class Mute(Exception):
    def __str__(self):
        raise ValueError("no text")

class Other(BaseException):
    pass
"""
DRIVERS = pytest.mark.parametrize("is_virtual", [True, False], ids=["virtual time", "threads"])


def write(
    folder: Path,
    *,
    code: str = "",
    guard: str = "False",
    below: str = "",
    variables: str = "",
    functions: str = CLASSES,
) -> Path:
    """Return the file of a component with an automaton, and one below it with an output."""
    outer = [state(1, "a", code, initial=True, child=2), state(2, "b"), transition(1, 1, 2, guard)]
    root = sub(1, 0, *outer, variables=f"got = 0\n{variables}", functions=functions)
    inner = sub(2, 1, state(1, "low", below, initial=True))
    output = "<output><name>far</name><type>int</type><default>0</default></output>\n"
    taken = '<result name="far">got</result></state>'
    text = document(root.replace("</state>", taken, 1), inner, libraries=("numpy as np",))
    return compile_to(folder, text.replace('idFather="1">', f'idFather="1">\n{output}'))


def component(folder: Path, **parts: str) -> Any:
    """Return such a component."""
    return load(write(folder, **parts))


def failed(made: Component, *, is_virtual: bool) -> tuple[str, str]:
    """Run a component until an error has ended it; return the message and the place of that."""
    run: ComponentRun
    if is_virtual:
        with Execution(made, on_error="stop") as run, suppress(BehaviorFailed):
            run.advance(1.0)
    else:
        run = Runtime(made, FastClock())
        run.start()
        try:
            until(run.ended.is_set, step=0.001)
        finally:
            run.stop()
    assert run.exit_code == 1
    (error,) = run.errors
    return error.message, error.location


def place_of(folder: Path, text: str) -> str:
    """Return the place in the document of the first line with a text, as locations have it."""
    lines = (folder / "behavior.xml").read_text(encoding="utf-8").split("\n")
    return f"(behavior.xml:{next(number for number, line in enumerate(lines, 1) if text in line)})"


@DRIVERS
@pytest.mark.parametrize("guard", ["np.array([1, 2])", "x = got\nreturn np.array([1, 2])"])
def test_a_guard_that_is_neither_true_nor_false_has_its_place(
    guard: str, is_virtual: bool, tmp_path: Path
) -> None:
    message, place = failed(component(tmp_path, guard=guard), is_virtual=is_virtual)
    assert "ambiguous" in message
    assert place.endswith(place_of(tmp_path, "np.array"))


@DRIVERS
def test_a_truth_that_a_class_of_the_document_refuses_has_its_place_there(
    is_virtual: bool, tmp_path: Path
) -> None:
    message, place = failed(component(tmp_path, guard="self.Torn()"), is_virtual=is_virtual)
    assert message == "ValueError: torn"
    assert place.endswith(place_of(tmp_path, "torn"))


@DRIVERS
@pytest.mark.parametrize(
    ("below", "told"),
    [
        ("del far", "`far` has no value yet"),
        ("far = self.Torn()", "is int, not Torn: <Torn instance at"),
    ],
)
def test_an_output_that_has_no_value_or_none_that_can_be_shown_has_the_place_of_its_code(
    below: str, told: str, is_virtual: bool, tmp_path: Path
) -> None:
    message, place = failed(component(tmp_path, below=below), is_virtual=is_virtual)
    assert told in message
    assert place.endswith(place_of(tmp_path, below))


@DRIVERS
@pytest.mark.parametrize("seconds", ["float('nan')", "float('inf')", "1e300"])
def test_a_sleep_that_would_never_end_is_an_error(seconds: str, is_virtual: bool, tmp_path: Path) -> None:
    code = f"self.sleep({seconds})"
    message, place = failed(component(tmp_path, code=code), is_virtual=is_virtual)
    assert re.fullmatch(r"ValueError: self\.sleep\(.*\) would never end", message)
    assert place.endswith(place_of(tmp_path, "self.sleep"))


@DRIVERS
def test_a_component_whose_attributes_cannot_be_listed_says_what_is_missing(
    is_virtual: bool, tmp_path: Path
) -> None:
    functions = "def __dir__(self):\n    raise ValueError('no')"
    made = component(tmp_path, code="self.nothing", functions=functions)
    message, _ = failed(made, is_virtual=is_virtual)
    assert message.startswith("AttributeError: `self.nothing` is not declared")


@pytest.mark.parametrize(
    ("raised", "told"),
    [
        ("Mute()", "Mute: its message is not"),
        ("Other()", "Other: "),
        (r"Other('\udcff')", r"Other: \udcff"),
    ],
)
def test_variables_that_fail_in_any_way_are_told_with_their_place(
    raised: str, told: str, tmp_path: Path
) -> None:
    made = component(tmp_path, variables=f"raise self.{raised}")
    with pytest.raises(VariablesError) as caught:
        Execution(made)
    assert str(caught.value).startswith(f"the variables of the component failed: {told}")
    assert str(caught.value).endswith(place_of(tmp_path, "raise self."))


@pytest.mark.parametrize("raised", ["Mute", "Other"])
@pytest.mark.parametrize(
    "change",
    [
        {"variables": "raise self.{}()"},
        {"functions": CLASSES + "\nraise {}()"},
        {"functions": CLASSES + "\ndef __init__(self):\n    raise self.{}()"},
    ],
    ids=["variables", "functions", "__init__"],
)
def test_a_new_version_that_fails_in_any_way_is_refused_with_its_place(
    change: dict[str, str], raised: str, tmp_path: Path
) -> None:
    with Execution(component(tmp_path)) as run:
        run.advance(0.1)
        write(tmp_path, **{part: text.format(raised) for part, text in change.items()})
        with pytest.raises(ReloadRefusedError) as caught:
            Reloading(run, lambda _: None).reload()
        assert f"{raised}: " in str(caught.value)
        place = place_of(tmp_path, f"{raised}()")
        assert str(caught.value).endswith(place)
        run.advance(0.1)
        assert not run.ended.is_set()


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        ("weakref.proxy(self.Torn())", "<ProxyType: its repr raised ReferenceError>"),
        ("self.Endless()", "<Endless: its repr raised SystemExit>"),
    ],
)
def test_a_variable_that_cannot_be_looked_at_is_shown_nevertheless(
    value: str, shown: str, tmp_path: Path
) -> None:
    functions = (
        f"{CLASSES}\nclass Endless:\n    def __getattribute__(self, name):\n        raise SystemExit\n"
    )
    made = component(tmp_path, variables=f"import weakref\nx = {value}", code="x", functions=functions)
    with Execution(made) as run:
        run.advance(0.1)
        assert variables_of(run.tree.root.automaton)["x"] == shown


@DRIVERS
def test_text_that_cannot_be_encoded_is_escaped_for_those_who_watch(is_virtual: bool, tmp_path: Path) -> None:
    made = component(tmp_path, code="raise ValueError('no \\udcff')")
    logging.disable()  # pytest-xdist cannot send what is logged
    try:
        message, _ = failed(made, is_virtual=is_virtual)
    finally:
        logging.disable(logging.NOTSET)
    assert message == r"ValueError: no \udcff"


LOGS = """
def fail(self, record):
    raise SystemExit(0)
"""


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.parametrize(
    "code",
    ["1 / 0", "raise KeyboardInterrupt", "threading.Thread(target=lambda: 1 / 0).start()\nself.sleep(9)"],
)
def test_a_log_that_fails_keeps_no_component_going(code: str, tmp_path: Path) -> None:
    made = component(
        tmp_path, code=f"import threading\nself.log.addFilter(self.fail)\n{code}", functions=LOGS
    )
    run = Runtime(made, FastClock())
    run.start()
    try:
        until(run.ended.is_set, step=0.001)
    finally:
        made.log.filters.clear()
        run.stop()
    assert run.errors
