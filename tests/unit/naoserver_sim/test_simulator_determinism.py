"""The same seed gives the same simulation, bit by bit: noise, walk and senses."""

import os
import subprocess
import sys

import pytest

from tests.support.limits import RUN_LIMIT
from tests.support.processes import REPOSITORY
from tests.support.simulation_trace import trace
from tests.support.soak import cases

pytestmark = pytest.mark.sim


BODIES = ["H25", "T1", "G1", "Cart"]


@pytest.fixture(scope="module", params=cases(["H25", "T1", "Cart"], ["G1"]))
def body(request):
    return request.param


@pytest.fixture(scope="module")
def first(body):
    return trace(3, body)


@pytest.fixture(scope="module")
def elsewhere():
    """The traces of the same seed in another process, by body."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.support.simulation_trace", "3", *BODIES],
        cwd=REPOSITORY,
        env={**os.environ, "PYTHONHASHSEED": "17"},
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=True,
    )
    return dict(line.split() for line in done.stdout.splitlines())


def test_the_same_seed_is_the_same_trace_also_in_another_process(first, body, elsewhere):
    assert first == elsewhere[body]


def test_another_seed_is_another_trace():
    assert trace(4, seconds=0.2) != trace(5, seconds=0.2)


def test_without_a_seed_it_is_the_same_each_time_too():
    assert trace(None, seconds=0.2) == trace(None, seconds=0.2)


def test_how_often_somebody_looks_changes_nothing(first, body):
    assert trace(3, body, period=0.01) == first
