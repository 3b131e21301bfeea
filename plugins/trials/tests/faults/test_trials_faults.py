"""Whatever is killed while trials run, or fills up, the same command goes on, and its table is as undisturbed.

In `make test` each fault comes once, and those of clusters and of single processes, which other tests cause,
not at all; in `make soak` each of them comes at thirty random moments, and many trials end their process, too.
"""

from __future__ import annotations

import random
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import psutil
import pytest

from plugins.trials.tests.support.dask_cluster import DaskCluster
from tests.support.commands import run_here
from tests.support.documents import document, state, sub, transition
from tests.support.limits import FOREVER
from tests.support.places import ROOT
from tests.support.processes import ComponentProcess, assert_gone, children, module
from tests.support.soak import repeated
from tests.support.waiting import until
from visualhfsm._commands.app import app
from visualhfsm_trials._record import read_outcomes

pytestmark = pytest.mark.slow

RUNS: Final = repeated(test=8, soak=24)
TIMES: Final = range(repeated(test=1, soak=30))
WORKERS: Final = repeated(test="1", soak="2")
MISHAPS: Final = repeated(test="0, 0, 0, 2", soak=f"{'0, ' * 18} 1, 2")
WORKER: Final = "visualhfsm.trials._worker"
ENVIRONMENT: Final = {"PYTHONPATH": str(ROOT), "COLUMNS": "200"}

_PARAMETERS: Final = (
    "<parameters><parameter><name>weight</name><type>float</type><default>1</default></parameter>"
    "<parameter><name>mishap</name><type>int</type><default>0</default></parameter></parameters>"
)
ROLLS: Final = document(
    sub(
        1,
        0,
        state(
            1,
            "rolling",
            "throws.append(random.randint(1, 6) * self.weight)\n"
            "if self.mishap == 1:\n    os._exit(3)\n"
            "if self.mishap == 2:\n    kept = bytearray(900 << 20)",
            initial=True,
        ),
        state(2, "won"),
        transition(1, 1, 2, "sum(throws) > 20", name="enough"),
        variables="throws = []",
    ),
    libraries=("random", "os"),
    head=_PARAMETERS,
)
"""It may end its process, or need more memory than it may have."""
PLAN: Final = f"""
robot = "none"
runs = {RUNS}
seed = 10
limit = 0.8
memory = 600
parameters.weight = {{ from = 0.5, to = 1.5 }}
parameters.mishap = [{MISHAPS}]
success.state = "won"
"""
HANGS: Final = document(
    sub(1, 0, state(1, "only", "while self.endless:\n    pass", initial=True)),
    head="<parameters><parameter><name>endless</name><type>bool</type><default>False</default></parameter></parameters>",
)
HANGING_PLAN: Final = """
robot = "none"
runs = 4
limit = 0.8
patience = 10
seed = 7
parameters.endless = [false, false, true]
"""


Kept = tuple[bytes, list[bytes]]
"""The table of a series, and the lines of its outcomes in order."""


@dataclass(frozen=True)
class Series:
    """A folder with a document and a plan, and what its trials come to."""

    folder: Path
    arguments: tuple[str, ...] = ("trials", "rolls.xml", "--workers", WORKERS)

    @property
    def outcomes(self) -> Path:
        """The file of outcomes."""
        return self.folder / "rolls.outcomes.jsonl"

    @property
    def done(self) -> int:
        """How many outcomes are there."""
        return len([*read_outcomes(self.outcomes)]) if self.outcomes.exists() else 0

    def until_done(self, number: int, client: ComponentProcess) -> None:
        """Wait until so many outcomes are there, unless the command ends before."""
        until(lambda: self.done >= number or client.process.poll() is not None, FOREVER)
        assert self.done >= number, client.output

    @contextmanager
    def running(self, *arguments: str, command: Sequence[str] = ()) -> Iterator[ComponentProcess]:
        """Run the command in a `with` block."""
        full = [*(command or module("visualhfsm")), *self.arguments, *arguments]
        with ComponentProcess(full, ENVIRONMENT, cwd=self.folder) as client:
            yield client

    def finish(self, *arguments: str) -> Kept:
        """Run the command to its end; return what it keeps."""
        done = run_here(app, "visualhfsm", *self.arguments, *arguments, cwd=self.folder)
        assert done.returncode == 0, done.stderr
        lines = self.outcomes.read_bytes().splitlines(keepends=True)
        return self.outcomes.with_suffix(".csv").read_bytes(), sorted(lines)


def series(folder: Path, text: str = ROLLS, plan: str = PLAN) -> Series:
    folder.mkdir(parents=True)
    (folder / "rolls.xml").write_text(text, encoding="utf-8")
    (folder / "rolls.trials.toml").write_text(plan, encoding="utf-8")
    return Series(folder)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Kept:
    table, lines = series(tmp_path_factory.mktemp("undisturbed") / "documents").finish()
    assert table.count(b"\n") == RUNS + 1
    assert len(lines) == RUNS + 2  # what they are of, and how many are asked for
    assert table.count(b",ended its process,") >= repeated(test=0, soak=1)
    assert table.count(b"MemoryError") >= 1
    assert table.count(b",true,") >= 1
    return table, lines


@pytest.fixture
def disturbed(tmp_path: Path) -> Series:
    """The same trials, which a test disturbs."""
    return series(tmp_path / "documents")


def moment(number: int, kind: str) -> int:
    """Return the number of outcomes after which a fault comes."""
    return random.Random(f"{kind}/{number}").randrange(1, RUNS // 2)


@pytest.mark.soak(
    "tests/unit/visualhfsm/trials/test_series.py::test_a_killed_process_costs_its_trial_only_which_is_run_again"
)
@pytest.mark.parametrize("number", TIMES)
def test_killed_processes_change_nothing(disturbed: Series, undisturbed: Kept, number: int) -> None:
    first = moment(number, "processes")
    with disturbed.running() as client:
        for done in (first, first + 3, first + 6):
            disturbed.until_done(done, client)
            for each in children(WORKER):
                each.kill()
        assert client.wait(FOREVER) == 0, client.output
    assert disturbed.finish() == undisturbed


@pytest.mark.parametrize("number", TIMES)
def test_a_killed_command_goes_on(disturbed: Series, undisturbed: Kept, number: int) -> None:
    with disturbed.running() as client:
        disturbed.until_done(moment(number, "client"), client)
        below = children(WORKER)
        client.process.kill()
        client.wait()
        assert_gone(below)
    # As if the computer had lost its power while the last line was written.
    kept = disturbed.outcomes.read_bytes()
    last = kept.rindex(b"\n", 0, -1) + 1
    disturbed.outcomes.write_bytes(kept[: random.Random(number).randrange(last, len(kept))])
    assert disturbed.finish() == undisturbed


@pytest.mark.parametrize("number", TIMES)
def test_ctrl_c_twice_keeps_what_is_done(disturbed: Series, undisturbed: Kept, number: int) -> None:
    with disturbed.running() as client:
        disturbed.until_done(moment(number, "ctrl-c"), client)
        below = children(WORKER)
        client.process.send_signal(signal.SIGINT)
        client.process.send_signal(signal.SIGINT)
        assert client.wait() == 130, client.output
        assert_gone(below)
    # On a busy machine the signals may come when the last trial has ended: then there may be nothing to go on with.
    assert "the same command goes on" in client.output or disturbed.done == RUNS
    assert disturbed.finish() == undisturbed


@pytest.mark.parametrize("number", TIMES)
def test_a_full_disk_keeps_what_is_done(disturbed: Series, undisturbed: Kept, number: int) -> None:
    size = sum(map(len, undisturbed[1]))
    most = random.Random(number).randrange(size // 4, size * 3 // 4)
    limited = (
        f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, ({most}, {most})); "
        "from visualhfsm.__main__ import main; main()"
    )
    with disturbed.running(command=[sys.executable, "-c", limited]) as client:
        assert client.wait(FOREVER) == 1, client.output
    assert "cannot be kept" in client.output
    assert "the same command goes on with what is there" in client.output
    assert 1 <= disturbed.done < RUNS
    assert disturbed.finish() == undisturbed


@pytest.mark.soak(
    "tests/unit/visualhfsm/trials/test_series.py::test_a_trial_that_hangs_fails_with_its_values_however_often_it_is_killed"
)
@pytest.mark.parametrize("number", TIMES)
def test_a_run_that_hangs_fails_however_often_it_is_killed(tmp_path: Path, number: int) -> None:
    undisturbed = series(tmp_path / "undisturbed" / "documents", HANGS, HANGING_PLAN).finish()
    assert undisturbed[0].count(b",took more than 10 s,") == 1
    disturbed = series(tmp_path / "documents", HANGS, HANGING_PLAN)
    with disturbed.running() as client:
        disturbed.until_done(3, client)  # only that one is left
        for each in children(WORKER):
            each.kill()
        assert client.wait(FOREVER) == 0, client.output
    assert disturbed.finish() == undisturbed


@pytest.mark.soak(
    "plugins/trials/tests/integration/test_trials_cluster.py::test_workers_that_are_killed_before_the_first_trial_ends_change_nothing"
)
@pytest.mark.parametrize("number", TIMES)
def test_a_cluster_goes_on_without_killed_workers_and_after_a_killed_command(
    disturbed: Series, undisturbed: Kept, number: int
) -> None:
    with DaskCluster(disturbed.folder.with_name("cluster"), workers=3) as cluster:
        there = ("--cluster", cluster.address)
        with disturbed.running(*there) as client:
            first = moment(number, "cluster")
            disturbed.until_done(first, client)
            below: list[psutil.Process] = []
            for worker in cluster.workers[:2]:
                below += cluster.kill(worker)
            disturbed.until_done(first + 4, client)
            client.process.kill()
        assert_gone(below)
        cluster.add_worker()
        assert disturbed.finish(*there) == undisturbed


@pytest.mark.soak(
    "plugins/trials/tests/integration/test_trials_cluster.py::test_a_run_that_is_ended_leaves_a_cluster_free_and_goes_on_there"
)
@pytest.mark.parametrize("number", TIMES)
def test_ctrl_c_leaves_a_cluster_free(disturbed: Series, undisturbed: Kept, number: int) -> None:
    with DaskCluster(disturbed.folder.with_name("cluster"), workers=2) as cluster:
        there = ("--cluster", cluster.address)
        with disturbed.running(*there) as client:
            disturbed.until_done(moment(number, "ctrl-c there"), client)
            client.process.send_signal(signal.SIGINT)
            assert client.wait() == 130, client.output
        assert "the same command goes on" in client.output or disturbed.done == RUNS
        assert disturbed.finish(*there) == undisturbed


@pytest.mark.soak(
    "plugins/trials/tests/integration/test_trials_cluster.py::test_a_killed_scheduler_keeps_what_is_done_and_is_said_in_a_line"
)
@pytest.mark.parametrize("number", TIMES)
def test_a_killed_scheduler_keeps_what_is_done(disturbed: Series, undisturbed: Kept, number: int) -> None:
    with (
        DaskCluster(disturbed.folder.with_name("cluster"), workers=2) as cluster,
        disturbed.running("--cluster", cluster.address) as client,
    ):
        disturbed.until_done(moment(number, "scheduler"), client)
        cluster.kill(cluster.scheduler)
        assert client.wait(FOREVER) == 1, client.output
        assert "What is done is kept, and the same command goes on" in client.output
    assert disturbed.finish() == undisturbed
