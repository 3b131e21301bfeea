"""A virtual run does not notice that its process was stopped, or that the machine was late: not by a single bit."""

from __future__ import annotations

import random
import signal
import subprocess

import pytest

from tests.support.examples import examples
from tests.support.limits import RUN_LIMIT
from tests.support.plugins import needs
from tests.support.processes import REPOSITORY, module
from tests.support.soak import cases, repeated
from tests.support.virtual_trace import BEGINS, trace

pytestmark = [pytest.mark.sim, pytest.mark.gl, needs("visualhfsm_match")]  # it plays football

LONG_PAUSE = 1.2  # s, longer than one wait for a picture
LONGEST_PAUSE = repeated(0.2, soak=2.0)  # s
SECONDS = repeated(2.0, soak=6.0)
"""How long a run lasts in its own time."""
TIMES = range(examples(1))


@pytest.fixture(scope="module", params=cases(["H25"], ["G1"]))
def body(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def undisturbed(body: str) -> str:
    return trace(body, SECONDS)


def run(body: str, *arguments: str) -> subprocess.Popen[str]:
    command = module("tests.support.virtual_trace", body, str(SECONDS), *arguments)
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=REPOSITORY
    )


def ended(process: subprocess.Popen[str], seconds: float) -> bool:
    """Wait so long for a process; return whether it has ended."""
    try:
        process.wait(seconds)
    except subprocess.TimeoutExpired:
        return False
    return True


def stopped_now_and_then(process: subprocess.Popen[str], numbers: random.Random) -> tuple[str, str]:
    """Stop a process again and again until it has ended; return the rest of its output, and its errors."""
    assert process.stdout is not None
    assert process.stderr is not None
    pause = LONG_PAUSE
    while not ended(process, numbers.uniform(0.05, 0.5)):
        process.send_signal(signal.SIGSTOP)
        ended(process, pause)
        process.send_signal(signal.SIGCONT)
        pause = numbers.uniform(0.05, LONGEST_PAUSE)
    return process.stdout.read(), process.stderr.read()


@pytest.mark.parametrize("number", TIMES)
@pytest.mark.parametrize(
    ("stops", "jumps"),
    cases([pytest.param(True, True)], [pytest.param(True, False), pytest.param(False, True)]),
)
def test_it_is_the_same_when_its_process_is_stopped_and_when_clocks_on_the_wall_jump(
    body: str, undisturbed: str, number: int, *, stops: bool, jumps: bool
) -> None:
    with run(body, *([str(number)] if jumps else [])) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == BEGINS
            if stops:
                output, errors = stopped_now_and_then(process, random.Random(number))
            else:
                output, errors = process.communicate(timeout=RUN_LIMIT)
        finally:
            process.kill()
    assert output == undisturbed + "\n", errors
