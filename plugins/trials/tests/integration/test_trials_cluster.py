"""Trials on a real cluster of Dask: the same table, with all that they need, or a clear refusal."""

from __future__ import annotations

import csv
import signal
import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Final, Literal

import msgspec
import psutil
import pytest

from plugins.trials.tests.support.dask_cluster import DaskCluster
from tests.support.documents import document, state, sub, transition
from tests.support.limits import FOREVER
from tests.support.places import ROOT
from tests.support.processes import ComponentProcess, assert_gone, module
from tests.support.soak import cases, repeated
from tests.support.waiting import until
from visualhfsm._commands.new import new
from visualhfsm.trials import Outcome, Plan, Spread, Success, TrialsError
from visualhfsm_trials import Summary, run_trials
from visualhfsm_trials._cluster import Cluster, ClusterLimits
from visualhfsm_trials._record import Record, read_outcomes
from visualhfsm_trials._series import KeptSeries
from visualhfsm_trials._summary import write_table

pytestmark = pytest.mark.slow

ROLLS = document(
    sub(
        1,
        0,
        state(1, "rolling", "throws.append(dice.throw() * self.weight)", initial=True, child=2),
        state(2, "won"),
        transition(1, 1, 2, "sum(throws) > 20", name="enough"),
        variables="throws = []",
    ),
    '<SubAutomata id="2" idFather="1"><import>parts/asks.xml</import></SubAutomata>',
    libraries=("dice",),
    config="<iceinterface><nameinterface>Lamp</nameinterface><interface>Lamp</interface></iceinterface>",
    head="<parameters><parameter><name>weight</name><type>float</type><default>1</default></parameter></parameters>",
)
ASKS = document(
    sub(
        1,
        0,
        state(1, "asking", "answers += callable(self.Lamp.setOn)", initial=True),
        variables="answers = 0",
    )
)
JUDGE = """
def throws(run):
    return len(run.variables(1)["throws"])

def even(run):
    return throws(run) % 2 == 0 or "an odd number of throws"
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A project with its own interface, and a document that imports another one and a module."""
    return make_project(tmp_path / "project")


@pytest.fixture(scope="module")
def here(tmp_path_factory: pytest.TempPathFactory) -> Sequence[Outcome]:
    """What the trials of the project come to in one process of this computer."""
    path = make_project(tmp_path_factory.mktemp("here") / "project")
    return run_trials(plan(path), workers=1).rows


def make_project(folder: Path) -> Path:
    new(folder)
    behaviors = folder / "behaviors"
    (behaviors / "parts").mkdir()
    (behaviors / "rolls.xml").write_text(ROLLS, encoding="utf-8")
    (behaviors / "parts" / "asks.xml").write_text(ASKS, encoding="utf-8")
    (behaviors / "dice.py").write_text("import random\n\ndef throw():\n    return random.randint(1, 6)\n")
    (behaviors / "judge.py").write_text(JUDGE)
    return behaviors / "rolls.xml"


RUNS: Final = repeated(test=12, soak=24)
ENDLESS: Final = 100_000
"""More trials than a test waits for."""


def plan(path: Path, runs: int = RUNS) -> Plan:
    return Plan(
        document=str(path), robot="none", runs=runs, limit=0.8,
        parameters={"weight": Spread(lowest=0.5, highest=1.5)},
        success=Success(state="won", function="judge.py:even"), numbers={"throws": "judge.py:throws"},
    )  # fmt: skip


@pytest.fixture(scope="module")
def lasting(tmp_path_factory: pytest.TempPathFactory) -> Iterator[DaskCluster]:
    with DaskCluster(tmp_path_factory.mktemp("cluster"), workers=2, failures=0) as cluster:
        yield cluster


@pytest.fixture
def cluster(lasting: DaskCluster) -> DaskCluster:
    """A cluster with two workers; each test may kill some of them."""
    lasting.replenish()
    return lasting


def run_with(limits: ClusterLimits, series: Plan, cluster: DaskCluster, out: Path) -> None:
    """Run a series that waits less long for its cluster."""
    wanted = KeptSeries(series)
    with Record(out, wanted.header) as record, Cluster(cluster.address, limits) as pool:
        wanted.run(record, pool)


def some_are_done(out: Path, ended: Callable[[], bool]) -> None:
    """Wait until a file has outcomes, or the run has ended."""
    until(lambda: ended() or (out.exists() and len([*read_outcomes(out)]) > 1), FOREVER)


def test_a_cluster_computes_the_same_table_as_one_process_and_two(
    project: Path, cluster: DaskCluster, here: Sequence[Outcome]
) -> None:
    ended: list[int] = []
    there = run_trials(plan(project), cluster=cluster.address, ended=lambda each: ended.append(each.number))
    assert sorted(ended) == [*range(1, RUNS + 1)]
    assert there.rows == here
    for workers in repeated(test=[], soak=[2]):
        assert run_trials(plan(project), workers=workers).rows == here
    assert 0 < there.rate.successes < RUNS
    assert {row.reason for row in there.rows} == {"", "an odd number of throws", "not in won after 0.8 s"}
    for worker in cluster.workers:
        assert [*worker.cwd.iterdir()] == []


SEES = """
import zlib

def aim(run):
    return run.robot.head[0]

def picture(run):
    return zlib.crc32(bytes(run.robot.look().pixels))
"""


@pytest.mark.parametrize(
    ("robot", "scene"),
    [
        pytest.param("fake", {}, marks=pytest.mark.soak),
        pytest.param("sim", {"noise": True}, marks=[pytest.mark.sim, pytest.mark.gl]),
    ],
)
def test_robots_with_noise_and_pictures_do_the_same_bit_by_bit(
    tmp_path: Path, cluster: DaskCluster, robot: Literal["fake", "sim"], scene: dict[str, bool]
) -> None:
    runs = repeated(test=3, soak=8)
    folder = tmp_path / "documents"
    folder.mkdir()
    (folder / "follow_ball.xml").write_bytes((ROOT / "behaviors" / "follow_ball.xml").read_bytes())
    (folder / "sees.py").write_text(SEES)
    follows = Plan(
        document=str(folder / "follow_ball.xml"), robot=robot, camera="rendered", runs=runs,
        limit=repeated(test=0.5, soak=1.5), scene={"BallGreen.pan": Spread(lowest=-0.4, highest=0.4), **scene},
        numbers={"picture": "sees.py:picture"}, samples={"aim": "sees.py:aim"},
    )  # fmt: skip

    def computed(name: str, **where: Any) -> tuple[bytes, list[bytes]]:
        out, table = tmp_path / f"{name}.jsonl", tmp_path / f"{name}.csv"
        write_table(table, run_trials(follows, out=out, **where))
        return table.read_bytes(), sorted(out.read_bytes().splitlines())

    there = computed("cluster", cluster=cluster.address)
    for workers in repeated(test=[1], soak=[1, 2]):
        assert computed(f"{workers} here", workers=workers) == there
    rows = [*csv.DictReader(there[0].decode("utf-8-sig").splitlines())]
    assert len({row["aim mean"] for row in rows}) == runs
    assert len({row["picture"] for row in rows}) == runs


def test_a_plan_that_is_not_possible_is_refused_there_as_here(project: Path, cluster: DaskCluster) -> None:
    project.write_text("no document", encoding="utf-8")
    with pytest.raises(TrialsError) as there:
        run_trials(plan(project), cluster=cluster.address)
    with pytest.raises(TrialsError) as here:
        run_trials(plan(project), workers=1)
    assert str(there.value) == str(here.value)
    assert "behaviors/rolls.xml cannot be run" in str(here.value)


def test_a_worker_with_another_version_is_refused_by_name(
    tmp_path: Path, project: Path, cluster: DaskCluster
) -> None:
    older = tmp_path / "older" / "numpy-1.0.dist-info"
    older.mkdir(parents=True)
    (older / "METADATA").write_text("Metadata-Version: 2.1\nName: numpy\nVersion: 1.0\n")
    with (
        cluster.added_worker({"PYTHONPATH": str(older.parent)}),
        pytest.raises(TrialsError, match=r"the worker tcp://127\.0\.0\.1:\d+ has numpy 1\.0; here are "),
    ):
        run_trials(plan(project), cluster=cluster.address)


def test_a_worker_without_our_package_is_refused(tmp_path: Path, project: Path, cluster: DaskCluster) -> None:
    hiding = tmp_path / "hiding"
    (hiding / "visualhfsm").mkdir(parents=True)
    (hiding / "visualhfsm" / "__init__.py").write_text("raise ModuleNotFoundError('no visualhfsm')")
    with (
        cluster.added_worker({"PYTHONPATH": str(hiding)}),
        pytest.raises(TrialsError, match=r"127\.0\.0\.1:\d+ cannot run trials, install visualhfsm there"),
    ):
        run_trials(plan(project), cluster=cluster.address)


def test_a_worker_that_hangs_is_not_waited_for(tmp_path: Path, project: Path, cluster: DaskCluster) -> None:
    cluster.workers[0].freeze()
    try:
        with pytest.raises(TrialsError, match=r"not all of it answers within 0\.5 s"):
            run_with(ClusterLimits(look=0.5), plan(project), cluster, tmp_path / "rolls.outcomes.jsonl")
    finally:
        cluster.workers[0].process.send_signal(signal.SIGCONT)


def test_a_cluster_that_ends_no_trial_any_more_is_not_waited_for(
    tmp_path: Path, project: Path, cluster: DaskCluster
) -> None:
    out = tmp_path / "rolls.outcomes.jsonl"
    many = msgspec.structs.replace(plan(project, ENDLESS), patience=0.5)
    with ThreadPoolExecutor(1) as aside:
        limits = ClusterLimits(start=0.5, check=0.05)
        trials = aside.submit(run_with, limits, many, cluster, out)
        some_are_done(out, trials.done)
        for worker in cluster.workers:
            worker.freeze()
        try:
            with pytest.raises(TrialsError, match="none of its trials has ended for 1 s"):
                trials.result(FOREVER)
        finally:
            for worker in cluster.workers:
                worker.process.send_signal(signal.SIGCONT)


UNREADABLE = """
from visualhfsm.trials import Outcome

Outcome.__reduce__ = lambda self: (__import__, ("nowhere",))
"""


def test_an_outcome_that_cannot_be_received_ends_the_run(
    tmp_path: Path, project: Path, cluster: DaskCluster
) -> None:
    changed = tmp_path / "changed"
    changed.mkdir()
    (changed / "sitecustomize.py").write_text(UNREADABLE)
    with (
        cluster.added_worker({"PYTHONPATH": str(changed)}),
        pytest.raises(
            TrialsError, match=r"does not give the outcome of trial \d+: No module named 'nowhere'"
        ),
    ):
        run_trials(plan(project, 60), cluster=cluster.address)


def test_a_run_that_is_ended_leaves_a_cluster_free_and_goes_on_there(
    tmp_path: Path, project: Path, cluster: DaskCluster, here: Sequence[Outcome]
) -> None:
    series, out, stop = KeptSeries(plan(project)), tmp_path / "rolls.outcomes.jsonl", threading.Event()
    with Record(out, series.header) as record, Cluster(cluster.address) as pool:
        series.run(record, pool, lambda _: stop.set(), stop)
    assert 1 <= len([*read_outcomes(out)]) < RUNS
    whole = run_trials(plan(project), out=out, cluster=cluster.address)
    assert whole.rows == here


@pytest.mark.parametrize("failures", cases([0], soak=[3]))
def test_workers_that_are_killed_before_the_first_trial_ends_change_nothing(
    tmp_path: Path, project: Path, cluster: DaskCluster, here: Sequence[Outcome], failures: int
) -> None:
    out = tmp_path / "rolls.outcomes.jsonl"
    with ExitStack() as stack:
        if failures:
            cluster = stack.enter_context(DaskCluster(tmp_path / "cluster", failures=failures))
        killed = [stack.enter_context(cluster.added_worker({})) for _ in range(repeated(test=1, soak=2))]
        aside = stack.enter_context(ThreadPoolExecutor(1))
        trials = aside.submit(run_trials, plan(project), out=out, cluster=cluster.address)
        until(lambda: trials.done() or all(map(has_begun, killed)), FOREVER)
        assert not trials.done()
        below = [each for worker in killed for each in cluster.kill(worker)]
        there = trials.result(FOREVER)
    assert there.rows == here
    assert_gone(below)


def has_begun(worker: ComponentProcess) -> bool:
    """Return whether a worker has started a process for trials."""
    return bool(psutil.Process(worker.process.pid).children())


FRAIL = """
import os, signal
from visualhfsm.trials import _outcomes
from visualhfsm_trials import _cluster

PLACE = lambda *_: os.kill(os.getpid(), signal.SIGKILL)
"""


def frail(folder: Path, function: str) -> dict[str, str]:
    """Return the environment of a worker that dies when it calls a function."""
    folder.mkdir()
    (folder / "sitecustomize.py").write_text(FRAIL.replace("PLACE", function))
    return {"PYTHONPATH": str(folder)}


def test_a_worker_that_dies_when_it_is_looked_at_is_not_counted(
    tmp_path: Path, project: Path, cluster: DaskCluster
) -> None:
    with cluster.added_worker(frail(tmp_path / "frail", "_outcomes.versions")):
        assert len(run_trials(plan(project, 4), cluster=cluster.address).rows) == 4


def test_a_cluster_may_lose_workers_but_not_its_last_one(tmp_path: Path, project: Path) -> None:
    """One of them dies of the files, which costs no trial."""
    out = tmp_path / "rolls.outcomes.jsonl"
    with DaskCluster(tmp_path / "cluster", workers=0, failures=0) as cluster, ThreadPoolExecutor(1) as aside:
        with pytest.raises(TrialsError, match="has no workers: start some, with `dask worker tcp://127"):
            run_trials(plan(project), cluster=cluster.address)

        worker = cluster.add_worker(frail(tmp_path / "frail", "_cluster._hold"))
        cluster.wait()
        trials: Future[Summary] = aside.submit(run_trials, plan(project, 4), cluster=cluster.address)
        until(lambda: trials.done() or worker.process.poll() is not None, FOREVER)
        last = cluster.add_worker()
        assert len(trials.result(FOREVER).rows) == 4

        limits = ClusterLimits(no_worker=0.1, check=0.05)
        many = aside.submit(run_with, limits, plan(project, ENDLESS), cluster, out)
        some_are_done(out, many.done)
        below = cluster.kill(last)
        with pytest.raises(TrialsError, match=r"it has had no worker for 0\.1 s"):
            many.result(FOREVER)
        assert_gone(below)


def test_a_scheduler_that_hangs_ends_the_run(tmp_path: Path, project: Path, cluster: DaskCluster) -> None:
    out = tmp_path / "rolls.outcomes.jsonl"
    with ThreadPoolExecutor(1) as aside:
        limits = ClusterLimits(answer=0.5, check=0.05)
        trials = aside.submit(run_with, limits, plan(project, ENDLESS), cluster, out)
        some_are_done(out, trials.done)
        cluster.scheduler.freeze()
        try:
            with pytest.raises(TrialsError, match="its scheduler does not answer: "):
                trials.result(FOREVER)
        finally:
            cluster.scheduler.process.send_signal(signal.SIGCONT)


def test_a_killed_scheduler_is_said_alike_by_whoever_notices_first(
    tmp_path: Path, project: Path, cluster: DaskCluster
) -> None:
    out = tmp_path / "rolls.outcomes.jsonl"
    with ThreadPoolExecutor(1) as aside:
        looks_always = ClusterLimits(check=0.0)
        trials = aside.submit(run_with, looks_always, plan(project, ENDLESS), cluster, out)
        some_are_done(out, trials.done)
        cluster.kill(cluster.scheduler)
        with pytest.raises(TrialsError, match="its scheduler does not answer any more"):
            trials.result(FOREVER)


def test_a_server_that_is_no_scheduler_is_not_waited_for() -> None:
    with (
        socket.create_server(("127.0.0.1", 0)) as silent,
        pytest.raises(TrialsError, match="cannot be reached"),
    ):
        Cluster(f"tcp://127.0.0.1:{silent.getsockname()[1]}", ClusterLimits(look=0.2))


PLAN = f"""
robot = "none"
runs = {ENDLESS}
limit = 0.8
[parameters]
weight = {{ from = 0.5, to = 1.5 }}
[success]
state = "won"
function = "judge.py:even"
[numbers]
throws = "judge.py:throws"
"""
"""The plan in `plan`, as a file."""


def test_a_killed_scheduler_keeps_what_is_done_and_is_said_in_a_line(
    project: Path, cluster: DaskCluster, here: Sequence[Outcome]
) -> None:
    (project.parent / "rolls.trials.toml").write_text(PLAN, encoding="utf-8")
    out = project.parent / "rolls.outcomes.jsonl"
    command = module("visualhfsm", "trials", "rolls.xml", "--cluster", cluster.address)
    with ComponentProcess(command, {"PYTHONPATH": str(ROOT)}, cwd=project.parent) as process:
        some_are_done(out, lambda: process.process.poll() is not None)
        cluster.kill(cluster.scheduler)
        assert process.wait(FOREVER) == 1, process.output
    said = f"the cluster at {cluster.address} is lost: its scheduler does not answer any more."
    assert f"visualhfsm: error: {said} What is done is kept, and the same command goes on" in process.output
    for words in ("Traceback", "distributed", "asyncio"):
        assert words not in process.output
    done = [outcome.number for outcome in read_outcomes(out)]
    again: list[int] = []
    whole = run_trials(plan(project), out=out, workers=1, ended=lambda each: again.append(each.number))
    assert sorted(again) == sorted({*range(1, RUNS + 1)} - {*done})
    assert whole.rows == here
