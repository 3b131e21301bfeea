"""Trials on a real cluster of Dask: the same table, with all that they need, or a clear refusal."""

from __future__ import annotations

import csv
import signal
import socket
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Literal

import msgspec
import pytest

from tests.support.dask_cluster import DaskCluster
from tests.support.documents import document, state, sub, transition
from tests.support.limits import FOREVER
from tests.support.places import ROOT
from tests.support.processes import assert_gone, children
from tests.support.waiting import until
from visualhfsm._new import new
from visualhfsm.trials import Plan, Spread, Success, TrialsError, run_trials
from visualhfsm.trials._summary import write_table

pytestmark = pytest.mark.slow

WORKER = "visualhfsm.trials._worker"

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
    folder = tmp_path / "project"
    new(folder)
    behaviors = folder / "behaviors"
    (behaviors / "parts").mkdir()
    (behaviors / "rolls.xml").write_text(ROLLS, encoding="utf-8")
    (behaviors / "parts" / "asks.xml").write_text(ASKS, encoding="utf-8")
    (behaviors / "dice.py").write_text("import random\n\ndef throw():\n    return random.randint(1, 6)\n")
    (behaviors / "judge.py").write_text(JUDGE)
    return behaviors / "rolls.xml"


def plan(path: Path, runs: int = 24) -> Plan:
    return Plan(
        document=str(path), robot="none", runs=runs, limit=0.8,
        parameters={"weight": Spread(lowest=0.5, highest=1.5)},
        success=Success(state="won", function="judge.py:even"), numbers={"throws": "judge.py:throws"},
    )  # fmt: skip


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[DaskCluster]:
    with DaskCluster(tmp_path / "cluster", workers=2) as cluster:
        yield cluster


def test_a_cluster_computes_the_same_table_as_one_process_and_two(
    project: Path, cluster: DaskCluster
) -> None:
    ended: list[int] = []
    there = run_trials(plan(project), cluster=cluster.address, ended=lambda each: ended.append(each.number))
    assert sorted(ended) == [*range(1, 25)]
    for workers in (1, 2):
        assert run_trials(plan(project), workers=workers).rows == there.rows
    assert 0 < there.rate.successes < 24
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
        ("fake", {}),
        pytest.param("sim", {"noise": True}, marks=[pytest.mark.sim, pytest.mark.gl]),
    ],
)
def test_robots_with_noise_and_pictures_do_the_same_bit_by_bit(
    tmp_path: Path, robot: Literal["fake", "sim"], scene: dict[str, bool]
) -> None:
    folder = tmp_path / "documents"
    folder.mkdir()
    (folder / "follow_ball.xml").write_bytes((ROOT / "behaviors" / "follow_ball.xml").read_bytes())
    (folder / "sees.py").write_text(SEES)
    follows = Plan(
        document=str(folder / "follow_ball.xml"), robot=robot, camera="rendered", runs=8, limit=1.5,
        scene={"BallGreen.pan": Spread(lowest=-0.4, highest=0.4), **scene},
        numbers={"picture": "sees.py:picture"}, samples={"aim": "sees.py:aim"},
    )  # fmt: skip

    def computed(name: str, **where: Any) -> tuple[bytes, list[bytes]]:
        out, table = tmp_path / f"{name}.jsonl", tmp_path / f"{name}.csv"
        write_table(table, run_trials(follows, out=out, **where))
        return table.read_bytes(), sorted(out.read_bytes().splitlines())

    one = computed("one", workers=1)
    assert computed("two", workers=2) == one
    with DaskCluster(tmp_path / "cluster", workers=4) as cluster:
        assert computed("cluster", cluster=cluster.address) == one
    rows = [*csv.DictReader(one[0].decode("utf-8-sig").splitlines())]
    assert len({row["aim mean"] for row in rows}) == 8
    assert len({row["picture"] for row in rows}) == 8


def test_a_plan_that_is_not_possible_is_refused_there_as_here(project: Path, cluster: DaskCluster) -> None:
    project.write_text("no document", encoding="utf-8")
    with pytest.raises(TrialsError) as there:
        run_trials(plan(project), cluster=cluster.address)
    with pytest.raises(TrialsError) as here:
        run_trials(plan(project), workers=1)
    assert str(there.value) == str(here.value)
    assert "behaviors/rolls.xml cannot be run" in str(here.value)


def test_a_worker_with_another_version_is_refused_by_name(tmp_path: Path, project: Path) -> None:
    older = tmp_path / "older" / "numpy-1.0.dist-info"
    older.mkdir(parents=True)
    (older / "METADATA").write_text("Metadata-Version: 2.1\nName: numpy\nVersion: 1.0\n")
    with DaskCluster(tmp_path / "cluster") as cluster:
        cluster.add_worker({"PYTHONPATH": str(older.parent)})
        cluster.wait()
        with pytest.raises(TrialsError, match=r"the worker tcp://127\.0\.0\.1:\d+ has numpy 1\.0; here are "):
            run_trials(plan(project), cluster=cluster.address)


def test_a_worker_without_our_package_is_refused(tmp_path: Path, project: Path) -> None:
    hiding = tmp_path / "hiding"
    (hiding / "visualhfsm").mkdir(parents=True)
    (hiding / "visualhfsm" / "__init__.py").write_text("raise ModuleNotFoundError('no visualhfsm')")
    with DaskCluster(tmp_path / "cluster", workers=0) as cluster:
        cluster.add_worker({"PYTHONPATH": str(hiding)})
        cluster.wait()
        with pytest.raises(
            TrialsError, match=r"127\.0\.0\.1:\d+ cannot run trials, install visualhfsm there"
        ):
            run_trials(plan(project), cluster=cluster.address)


def test_a_cluster_without_workers_is_refused(tmp_path: Path, project: Path) -> None:
    with (
        DaskCluster(tmp_path / "cluster", workers=0) as cluster,
        pytest.raises(TrialsError, match="has no workers: start some, with `dask worker tcp://127"),
    ):
        run_trials(plan(project), cluster=cluster.address)


def test_a_worker_that_hangs_is_not_waited_for(tmp_path: Path, project: Path) -> None:
    with DaskCluster(tmp_path / "cluster") as cluster:
        cluster.workers[0].process.send_signal(signal.SIGSTOP)
        try:
            with pytest.raises(TrialsError, match="not all of it answers within 15 s"):
                run_trials(plan(project), cluster=cluster.address)
        finally:
            cluster.workers[0].process.send_signal(signal.SIGCONT)


def test_a_cluster_that_ends_no_trial_any_more_is_not_waited_for(
    tmp_path: Path, project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("visualhfsm.trials._cluster._START_LIMIT", 1.0)
    out = tmp_path / "rolls.outcomes.jsonl"
    many = msgspec.structs.replace(plan(project, 100_000), patience=3.0)
    with DaskCluster(tmp_path / "cluster") as cluster, ThreadPoolExecutor(1) as aside:
        trials = aside.submit(run_trials, many, out=out, cluster=cluster.address)
        until(lambda: trials.done() or (out.exists() and out.read_bytes().count(b"\n") > 2))
        cluster.workers[0].process.send_signal(signal.SIGSTOP)
        try:
            with pytest.raises(TrialsError, match="none of its trials has ended for 4 s"):
                trials.result(FOREVER)
        finally:
            below = cluster.kill(cluster.workers[0])
        assert_gone(below)


UNREADABLE = """
from visualhfsm.trials._outcomes import Outcome

Outcome.__reduce__ = lambda self: (__import__, ("nowhere",))
"""


def test_an_outcome_that_cannot_be_received_ends_the_run(tmp_path: Path, project: Path) -> None:
    changed = tmp_path / "changed"
    changed.mkdir()
    (changed / "sitecustomize.py").write_text(UNREADABLE)
    with DaskCluster(tmp_path / "cluster", workers=0) as cluster:
        cluster.add_worker({"PYTHONPATH": str(changed)})
        cluster.wait()
        with pytest.raises(
            TrialsError, match=r"does not give the outcome of trial \d+: No module named 'nowhere'"
        ):
            run_trials(plan(project), cluster=cluster.address)


@pytest.mark.parametrize("failures", [0, 3])
def test_workers_that_are_killed_before_the_first_trial_ends_change_nothing(
    tmp_path: Path, project: Path, failures: int
) -> None:
    out = tmp_path / "rolls.outcomes.jsonl"
    with (
        DaskCluster(tmp_path / "cluster", workers=3, failures=failures) as cluster,
        ThreadPoolExecutor(1) as aside,
    ):
        trials = aside.submit(run_trials, plan(project), out=out, cluster=cluster.address)
        until(lambda: trials.done() or out.exists(), FOREVER)
        until(lambda: trials.done() or children(WORKER) != [], FOREVER)
        below = [each for worker in cluster.workers[:2] for each in cluster.kill(worker)]
        there = trials.result(FOREVER)
    assert there.rows == run_trials(plan(project), workers=2).rows
    assert_gone(below)


FRAIL = """
import os, signal
from visualhfsm.trials import _cluster, _outcomes

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
    cluster.add_worker(frail(tmp_path / "frail", "_outcomes.versions"))
    cluster.wait()
    assert len(run_trials(plan(project, 4), cluster=cluster.address).rows) == 4


def test_a_worker_that_dies_of_the_files_costs_no_trial(tmp_path: Path, project: Path) -> None:
    with DaskCluster(tmp_path / "cluster", workers=0, failures=0) as cluster, ThreadPoolExecutor(1) as aside:
        worker = cluster.add_worker(frail(tmp_path / "frail", "_cluster._hold"))
        cluster.wait()
        trials = aside.submit(run_trials, plan(project, 4), cluster=cluster.address)
        until(lambda: trials.done() or worker.process.poll() is not None, FOREVER)
        cluster.add_worker()
        assert len(trials.result(FOREVER).rows) == 4


def test_a_cluster_that_loses_its_last_worker_ends_the_run(
    tmp_path: Path, project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("visualhfsm.trials._cluster._NO_WORKER_LIMIT", 1.0)
    out = tmp_path / "rolls.outcomes.jsonl"
    with DaskCluster(tmp_path / "cluster") as cluster, ThreadPoolExecutor(1) as aside:
        trials = aside.submit(run_trials, plan(project, 100_000), out=out, cluster=cluster.address)
        until(lambda: trials.done() or (out.exists() and out.read_bytes().count(b"\n") > 2), FOREVER)
        below = cluster.kill(cluster.workers[0])
        with pytest.raises(TrialsError, match="it has had no worker for 1 s"):
            trials.result(FOREVER)
        assert_gone(below)


def test_a_scheduler_that_hangs_ends_the_run(
    tmp_path: Path, project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "rolls.outcomes.jsonl"
    with DaskCluster(tmp_path / "cluster") as cluster, ThreadPoolExecutor(1) as aside:
        trials = aside.submit(run_trials, plan(project, 100_000), out=out, cluster=cluster.address)
        until(lambda: trials.done() or (out.exists() and out.read_bytes().count(b"\n") > 2), FOREVER)
        monkeypatch.setattr("visualhfsm.trials._cluster._CONNECT_LIMIT", 1.0)
        cluster.scheduler.freeze()
        try:
            with pytest.raises(TrialsError, match="its scheduler does not answer: "):
                trials.result(FOREVER)
        finally:
            cluster.scheduler.process.send_signal(signal.SIGCONT)


def test_a_server_that_is_no_scheduler_is_not_waited_for(project: Path) -> None:
    with (
        socket.create_server(("127.0.0.1", 0)) as silent,
        pytest.raises(TrialsError, match="cannot be reached"),
    ):
        run_trials(plan(project), cluster=f"tcp://127.0.0.1:{silent.getsockname()[1]}")
