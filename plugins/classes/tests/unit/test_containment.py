"""A contained submission: its trials are those of the same document outside."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Final

import pytest

from codegen.logic import read_proofs
from tests.support.documents import document, state, sub, transition
from visualhfsm.trials import Plan, Success
from visualhfsm.trials._trial import run_trial
from visualhfsm_classes import Allowance, Containment
from visualhfsm_classes._errors import ComputerTooBusy


@pytest.mark.slow
def test_a_contained_trial_has_the_outcome_of_any_other(tmp_path: Path) -> None:
    path = tmp_path / "waits.xml"
    waits = state(1, "waiting", "count += 1", initial=True)
    path.write_text(
        document(sub(1, 0, waits, state(2, "done"), transition(1, 1, 2, "count > 3"), variables="count = 0")),
        encoding="utf-8",
    )
    plan = Plan(document=str(path), robot="none", limit=2.0, success=Success(state="done"))
    with Containment(unsafe=True) as containment:
        assert run_trial(plan, 1, simulate=containment.simulate) == run_trial(plan, 1)


@pytest.mark.slow
def test_a_contained_error_is_in_the_words_of_the_document_too(tmp_path: Path) -> None:
    path = tmp_path / "fails.xml"
    above = sub(1, 0, state(1, "play", initial=True, child=2), variables="count = 0")
    path.write_text(
        document(above, sub(2, 1, state(1, "look", "count += 1", initial=True))), encoding="utf-8"
    )
    plan = Plan(document=str(path), robot="none", limit=1.0)
    with Containment(unsafe=True) as containment:
        contained = run_trial(plan, 1, simulate=containment.simulate)
    assert "NameError: `count` is a variable of fails, and play has its own" in contained.reason


@pytest.mark.slow
def test_a_proof_that_is_wrong_fails_a_contained_trial(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "asks.xml"
    asks = state(1, "ask", 'self.send("go")', initial=True)
    path.write_text(
        document(sub(1, 0, asks, state(2, "run"), transition(1, 1, 2, "go", type="event"))), encoding="utf-8"
    )
    plan = Plan(document=str(path), robot="none", limit=1.0)
    with Containment(unsafe=True) as containment:
        assert run_trial(plan, 1, simulate=containment.simulate).success
        monkeypatch.setattr(
            "visualhfsm_classes._containment.read_proofs",
            lambda text: tuple(("sent", row[1], ()) for row in read_proofs(text) if row[0] == "sent"),
        )
        contained = run_trial(plan, 1, simulate=containment.simulate)
    assert "asks.xml is wrong here: the state `ask` sent `go`" in contained.reason


OUTPUTS = document(
    sub(
        1, 0,
        state(1, "search", initial=True, child=2).replace(
            "</state>", '<history>restart</history><result name="found">seen</result></state>'
        ),
        state(2, "rest"),
        state(3, "done"),
        transition(1, 1, 3, "seen == 3 and rounds == 2"),
        transition(2, 1, 2, "300", type="time"),
        transition(3, 2, 1, "100", type="time", code="rounds += 1"),
        variables="seen = rounds = 0",
    ),
    sub(
        2, 1, state(1, "look", "found += 1 if total > 3 else 0\ntotal += 1", initial=True),
        "<output><name>found</name><type>int</type><default>0</default></output>",
        variables="total = 0",
    ),
)  # fmt: skip


@pytest.mark.slow
def test_outputs_stay_at_the_far_end_and_are_handed_up_there(tmp_path: Path) -> None:
    path = tmp_path / "outputs.xml"
    path.write_text(OUTPUTS, encoding="utf-8")
    plan = Plan(document=str(path), robot="none", limit=3.0, success=Success(state="done"))
    with Containment(unsafe=True) as containment:
        contained = run_trial(plan, 1, simulate=containment.simulate)
    assert contained == run_trial(plan, 1)
    assert contained.reason == ""
    path.write_text(OUTPUTS.replace("found += 1 if", "found = 'x' if"), encoding="utf-8")
    with Containment(unsafe=True) as containment:
        failed = run_trial(plan, 1, simulate=containment.simulate)
    assert "the output 'found' of automaton 2 ('search') is int, not str: 'x'" in failed.reason
    assert "in the outputs of automaton 2, line 14" in failed.reason


WANTS_TOO: Final = """
import os, sys, time
print(flush=True)
while not os.path.exists(sys.argv[1]):
    time.sleep(0.01)
while True:
    pass
"""
"""A process that wants the processor once a file exists."""
COMPUTES: Final = """
import time
open({path!r}, "w").close()
end = time.process_time() + {seconds}
while time.process_time() < end:
    pass
over = True
"""
"""Code for which the others wait: what comes before it would only take longer beside them."""


@contextmanager
def busy_processor(others: int, once: Path) -> Iterator[None]:
    """Leave the processes that are started here one processor, which others want, too, once a file exists."""
    processors = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(processors)})
    with ExitStack() as ends:
        ends.callback(os.sched_setaffinity, 0, processors)
        wants = [sys.executable, "-S", "-c", WANTS_TOO, str(once)]
        for _ in range(others):
            # As a session, since systems may share time among those.
            other = subprocess.Popen(wants, stdout=subprocess.PIPE, start_new_session=True)
            ends.enter_context(other)
            ends.callback(other.kill)
            assert other.stdout is not None
            other.stdout.readline()
        yield


def computing(folder: Path, seconds: float) -> tuple[Path, Path]:
    """Write a document that computes for some seconds; return its file, and that which exists once it does."""
    path, begun = folder / "computes.xml", folder / "begun"
    computes = state(1, "computing", COMPUTES.format(path=str(begun), seconds=seconds), initial=True)
    walk = sub(1, 0, computes, state(2, "done"), transition(1, 1, 2, "over"), variables="over = False")
    path.write_text(document(walk), encoding="utf-8")
    return path, begun


@pytest.mark.slow
def test_code_has_its_time_on_a_busy_computer(tmp_path: Path) -> None:
    path, begun = computing(tmp_path, 0.3)
    plan = Plan(document=str(path), robot="none", limit=1.0, success=Success(state="done"))
    with (
        Containment(unsafe=True, allowance=Allowance(block=0.6, delay=1000.0)) as containment,
        busy_processor(3, begun),
    ):
        assert run_trial(plan, 1, simulate=containment.simulate).success


@pytest.mark.slow
def test_a_computer_without_time_is_not_the_fault_of_the_code(tmp_path: Path) -> None:
    path, begun = computing(tmp_path, 0.5)
    plan = Plan(document=str(path), robot="none", limit=1.0)
    with (
        Containment(unsafe=True, allowance=Allowance(block=0.6, begin=600.0, delay=1.0)) as containment,
        busy_processor(3, begun),
        pytest.raises(ComputerTooBusy, match="the computer was too busy: state computing took 1 s"),
    ):
        run_trial(plan, 1, simulate=containment.simulate)


@pytest.mark.slow
def test_a_trial_has_calls_and_data_in_proportion_to_how_long_it_lasts(tmp_path: Path) -> None:
    path = tmp_path / "looks.xml"
    path.write_text(
        document(
            sub(1, 0, state(1, "look", "pose = self.Head.getPose()", initial=True), variables="pose = None"),
            config="<iceinterface><nameinterface>Head</nameinterface><nameproxy>Head</nameproxy>"
            "<interface>PoseHead</interface></iceinterface>",
        ),
        encoding="utf-8",
    )
    plan = Plan(document=str(path), robot="fake", limit=3.0)
    with Containment(unsafe=True, allowance=Allowance(requests=10)) as containment:
        refused = run_trial(plan, 1, simulate=containment.simulate)
    assert "made more than 10 requests in a trial, the last in state look" in refused.reason
    with Containment(unsafe=True, allowance=Allowance(data=0)) as containment:
        refused = run_trial(plan, 1, simulate=containment.simulate)
    assert "asked for more than 0 MB of the robot's data" in refused.reason
    usual, match = Allowance(), Allowance.for_trial(600.0)
    assert Allowance.for_trial(3.0) == usual
    assert (match.requests, match.data, match.trial) == (
        5 * usual.requests,
        5 * usual.data,
        5 * usual.trial,
    )
