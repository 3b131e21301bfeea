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
from tests.support.processes import assert_gone
from tests.support.waiting import until
from visualhfsm._new import new
from visualhfsm.trials import Plan, Spread, Success, TrialsError, run_trials
from visualhfsm.trials._summary import write_table

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
    assert sorted(ended) == [*range(24)]
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


def test_a_server_that_is_no_scheduler_is_not_waited_for(project: Path) -> None:
    with (
        socket.create_server(("127.0.0.1", 0)) as silent,
        pytest.raises(TrialsError, match="cannot be reached"),
    ):
        run_trials(plan(project), cluster=f"tcp://127.0.0.1:{silent.getsockname()[1]}")
