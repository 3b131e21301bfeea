"""Measure trials and grading: what a trial costs, how their rate grows, thirty marks, what intervals hold.

`overhead` is the processor time of a trial beside that of a virtual run of the same behavior without one.
`rate` is that of trials with two processes, and with four workers of Dask, beside one, in rounds that take
turns. `short` are trials of 1 s with the fake robot. `grading` is the command `visualhfsm grade` for thirty
submissions, the solution and the mistakes of an exercise, with five trials each. Rates are meaningful on a
machine that does nothing else; the load is printed. Some three minutes; with `--all`, which runs 10,000 short
trials and grades the exercise `goal` too, some eight.

`intervals`, six minutes more: how often the intervals hold what they are of. Means are of numbers that are
drawn from a known distribution, 5,000 times for each count. `given` is the part of the draws of which the
mean gets an interval, `held` the part of these intervals with the true mean. None may reach beyond what a
number can be. A rate is counted exactly: of every number of successes that there can be, with true rates from
1 to 99 %.

    python plugins/trials/benchmarks/bench_trials.py [--all] [--draws 5000] [PART...]
"""

from __future__ import annotations

import argparse
import json
import math
import os
import re
import shutil
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing
from functools import partial
from pathlib import Path
from typing import Final, NamedTuple

import msgspec
import numpy as np
import psutil
from rich.console import Console
from rich.table import Table

from benchmarks.common import parts
from plugins.trials.tests.support.dask_cluster import DaskCluster
from tests.support.places import ROOT
from tests.support.processes import module
from visualhfsm.plugins import success_rate
from visualhfsm.simulation import simulate
from visualhfsm.trials import Disturbance, LocalPool, Outcome, Plan, Pool, Spread, Success, quiet, run_trial
from visualhfsm_classes import read_exercise
from visualhfsm_trials import Cluster
from visualhfsm_trials._record import Record
from visualhfsm_trials._series import KeptSeries
from visualhfsm_trials._statistics import UNBOUNDED, mean_of, rarest, require_scipy
from visualhfsm_trials._summary import summarize

PAIRS: Final = 11
RUNS_OF_A_ROUND: Final = 72
ROUNDS: Final = 3
SUBMISSIONS: Final = 30
SAMPLES: Final = 20
"""How often memory is looked at while short trials run."""
Rows = list[tuple[str, str, str]]
"""What was measured, how much it is, and the goal."""
COUNTS: Final = (4, 5, 10, 20, 50)
TRUE_RATES: Final = tuple(part / 100 for part in range(1, 100))
Draw = Callable[[np.random.Generator, int], np.ndarray]


def short_plan(runs: int, limit: float = 1.0) -> Plan:
    """Return a plan of short trials: a ball that is carried away from the fake robot."""
    return Plan(
        document=str(ROOT / "behaviors" / "follow_ball.xml"),
        robot="fake",
        runs=runs,
        limit=limit,
        scene={"BallGreen.pan": Spread(lowest=-0.4, highest=0.4), "BallGreen.distance": (0.8, 1.0, 1.2)},
        disturbances={
            "carried": Disturbance(at=Spread(lowest=0.1, highest=0.9), move="BallGreen", to={"pan": 3.1})
        },
        success=Success(state="search"),
    )


def overhead() -> Rows:
    """Measure trials beside virtual runs without one, in pairs."""
    follow, score = ROOT / "behaviors" / "follow_ball.xml", ROOT / "behaviors" / "score.xml"
    plans = {
        "follow_ball, fake, 20 s": Plan(document=str(follow), robot="fake", limit=20.0),
        "follow_ball, sim, drawn, 20 s": Plan(document=str(follow), limit=20.0, camera="drawn"),
        "score, sim, drawn, 10 s": Plan(
            document=str(score), limit=10.0, camera="drawn", scene={"world": "soccer"}
        ),
    }
    rows = []
    for name, plan in plans.items():
        ratios = []
        for number in range(PAIRS + 1):
            both = [_bare, _trial] if number % 2 else [_trial, _bare]
            taken = {each: each(plan, number) for each in both}
            if number:  # the first pair imports and compiles
                ratios.append(taken[_trial] / taken[_bare])
        rows.append((f"overhead: {name}", f"{100 * (statistics.median(ratios) - 1):.1f} %", "<= 5 %"))
    return rows


def _bare(plan: Plan, number: int) -> float:
    """Return the processor time in s of a run that nobody judges."""
    began = time.process_time()
    settings = {"camera": plan.camera, "seed": plan.seed_of(number)} if plan.robot == "sim" else {}
    with quiet(), closing(simulate(plan.document, robot=plan.robot, **settings, **plan.scene)) as behavior:  # type: ignore[arg-type]
        behavior.advance(plan.limit)
    return time.process_time() - began


def _trial(plan: Plan, number: int) -> float:
    """Return the processor time in s of a trial."""
    began = time.process_time()
    with quiet():
        run_trial(plan, number)
    return time.process_time() - began


def rate() -> Rows:
    """Measure rounds of trials with one process, two, and four workers of Dask, which take turns."""
    follow = ROOT / "behaviors" / "follow_ball.xml"
    series = KeptSeries(Plan(document=str(follow), limit=10.0, camera="drawn", scene={"noise": True}))
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        cluster = stack.enter_context(DaskCluster(Path(folder), workers=4))
        pools: dict[str, Pool[Outcome]] = {
            "1 process": stack.enter_context(LocalPool(1)),
            "2 processes": stack.enter_context(LocalPool(2)),
            "4 Dask workers": stack.enter_context(Cluster(cluster.address)),
        }
        rates: dict[str, list[float]] = {name: [] for name in pools}
        tables = set()
        for number in range(ROUNDS + 1):
            for name, pool in pools.items():
                began = time.perf_counter()
                outcomes = [*series.outcomes(range(1, RUNS_OF_A_ROUND + 1), pool)]
                taken = time.perf_counter() - began
                tables.add(msgspec.json.encode(sorted(outcomes, key=lambda each: each.number)))
                if number:  # in the first round processes start
                    rates[name].append(RUNS_OF_A_ROUND / taken)
    (table,) = tables  # all are the same, so none is lost and none there twice
    assert [each["number"] for each in json.loads(table)] == [*range(1, RUNS_OF_A_ROUND + 1)]
    one = rates["1 process"]
    rows = [("rate: 1 process, 10 s of the simulation each", f"{statistics.median(one):.1f} 1/s", "")]
    for name, found in rates.items():
        if found is not one:
            ratio = statistics.median(many / single for many, single in zip(found, one, strict=True))
            goal = ">= 1.8 times" if (os.cpu_count() or 1) > 1 else ""
            rows.append((f"rate: {name} beside 1 process", f"{ratio:.2f} times, same table", goal))
    return rows


def short(runs: int) -> Rows:
    """Measure many short trials with two processes: how many in a second, and how much memory grows."""
    series = KeptSeries(short_plan(runs))
    here = psutil.Process()
    memory: list[tuple[float, float]] = []
    with tempfile.TemporaryDirectory() as folder, LocalPool(2) as pool:
        file = Path(folder) / "short.jsonl"
        began = time.perf_counter()
        with Record(file, series.header) as record:
            for number, outcome in enumerate(series.outcomes(series.plan.trials, pool), 1):
                record.add(outcome)
                if number % (runs // SAMPLES) == 0:
                    workers = max(each.memory_info().rss for each in here.children())
                    memory.append((here.memory_info().rss / 1e6, workers / 1e6))
        taken = time.perf_counter() - began
        summary = summarize(file, series.plan.varying, runs)
        assert [row.number for row in summary.rows] == [*range(runs)]
    first, last = memory[1], memory[-1]  # all is imported after a tenth
    after = f"{runs - runs // 10} further trials"
    return [
        (f"short: {runs} trials of 1 s, 2 processes", f"{runs / taken:.0f} 1/s", ">= 50 1/s"),
        (f"short: parent, {first[0]:.0f} MB, after {after}", f"{last[0] - first[0]:+.1f} MB", "flat"),
        (f"short: worker, {first[1]:.0f} MB, after {after}", f"{last[1] - first[1]:+.1f} MB", "flat"),
    ]


def grading(exercises: Sequence[str]) -> Rows:
    """Measure the command that grades thirty submissions, with their pages."""
    rows = []
    for name in exercises:
        with tempfile.TemporaryDirectory() as folder:
            exercise = _with_five_trials(name, Path(folder) / name)
            own = [exercise / "solution" / "solution.xml", *sorted((exercise / "mistakes").glob("*.xml"))]
            handed_in = Path(folder) / "handed-in"
            handed_in.mkdir()
            for number in range(SUBMISSIONS):
                shutil.copy(own[number % len(own)], handed_in / f"pupil{number:02}.xml")
            command = module("visualhfsm", "grade", str(exercise), str(handed_in), "--workers", "2")
            began = time.perf_counter()
            subprocess.run(command, cwd=folder, stdout=subprocess.DEVNULL, check=True)
            taken = time.perf_counter() - began
            marks = (Path(folder) / "marks" / "marks.csv").read_text(encoding="utf-8").splitlines()
            assert len(marks) == SUBMISSIONS + 1
        rows.append((f"grading: {SUBMISSIONS} of `{name}`, five trials each", f"{taken:.0f} s", "< 300 s"))
    return rows


def _with_five_trials(name: str, folder: Path) -> Path:
    """Copy one of our exercises, and let its hidden trials be so many that all together are five."""
    shutil.copytree(ROOT / "exercises" / name, folder)
    exercise = read_exercise(folder)
    missing = 5 - sum(plan.runs for plan in exercise.plans.values())
    last = sorted((folder / "hidden").glob("*.toml"))[-1]
    text = last.read_text(encoding="utf-8")
    last.write_text(
        re.sub(r"(?m)^runs = (\d+)", lambda found: f"runs = {int(found[1]) + missing}", text),
        encoding="utf-8",
    )
    assert sum(plan.runs for plan in read_exercise(folder).plans.values()) == 5
    return folder


class Distribution(NamedTuple):
    """How numbers are drawn, their true mean, and what a number can be."""

    draw: Draw
    mean: float
    bounds: tuple[float, float] = (0.0, math.inf)


def _mixture(random: np.random.Generator, count: int) -> np.ndarray:
    usual, rare = random.normal(1.0, 0.2, count), random.normal(10.0, 1.0, count)
    return np.where(random.random(count) < 0.1, rare, usual)


DISTRIBUTIONS: Final = {
    "normal, 3 ± 1": Distribution(lambda random, count: random.normal(3.0, 1.0, count), 3.0, UNBOUNDED),
    "exponential": Distribution(lambda random, count: random.exponential(1.0, count), 1.0),
    "lognormal, s = 1": Distribution(lambda random, count: random.lognormal(0.0, 1.0, count), math.exp(0.5)),
    "exponential, cut at 2": Distribution(
        lambda random, count: np.minimum(random.exponential(1.0, count), 2.0),
        1.0 - math.exp(-2.0),
        (0.0, 2.0),
    ),
    "1 in 30 %, else 0": Distribution(
        lambda random, count: 1.0 * (random.random(count) < 0.3), 0.3, (0.0, 1.0)
    ),
    "1 in 5 %, else 0": Distribution(
        lambda random, count: 1.0 * (random.random(count) < 0.05), 0.05, (0.0, 1.0)
    ),
    "0, 1, 5 in 60, 30, 10 %": Distribution(
        lambda random, count: random.choice([0.0, 1.0, 5.0], count, p=[0.6, 0.3, 0.1]), 0.8, (0.0, 5.0)
    ),
    "1 ± 0.2, in 10 % 10 ± 1": Distribution(_mixture, 1.9, UNBOUNDED),
}


def means(name: str, draws: int) -> list[tuple[float, float]]:
    """Return for each count which part of the draws has an interval, and which part of these holds."""
    draw, true, bounds = DISTRIBUTIONS[name]
    found = []
    for count in COUNTS:
        random = np.random.default_rng(count)
        intervals = [mean_of(draw(random, count).tolist(), bounds).interval for _ in range(draws)]
        given = [each for each in intervals if each is not None]
        if any(low < bounds[0] or high > bounds[1] for low, high in given):
            raise SystemExit(f"{name}: an interval of {count} numbers reaches beyond what they can be")
        held = sum(low <= true <= high for low, high in given)
        found.append((len(given) / draws, held / len(given) if given else math.nan))
    return found


def rates() -> list[tuple[float, float]]:
    """Return for each count how often the interval of a rate holds it: on average, and the least."""
    binomial = require_scipy().binom
    found = []
    for count in COUNTS:
        intervals = [success_rate(successes, count) for successes in range(count + 1)]
        held = [
            sum(
                binomial.pmf(successes, count, true)
                for successes, each in enumerate(intervals)
                if each.lowest <= true <= each.highest
            )
            for true in TRUE_RATES
        ]
        found.append((statistics.fmean(held), min(held)))
    return found


def intervals(draws: int) -> Rows:
    """Measure for each count of numbers which intervals hold their mean, of those that are given."""
    rows: Rows = []
    for name in DISTRIBUTIONS:
        for count, (given, held) in zip(COUNTS, means(name, draws), strict=True):
            rows.append((f"intervals: {name}, {count}", f"{held:.1%} of {given:.1%}", ""))
    for count, (mean, least) in zip(COUNTS, rates(), strict=True):
        rows.append((f"intervals: a rate, {count}; at the worst", f"{mean:.1%}; {least:.1%}", ""))
        rows.append((f"intervals: may be missing, {count}: rarer than", f"{rarest(count):.0%}", ""))
    return rows


def main() -> None:
    """Measure and print."""
    table = Table(title=f"Trials and grading, with {os.cpu_count()} processors")
    for column, justify in (("", "left"), ("measured", "right"), ("goal", "right"), ("load", "right")):
        table.add_column(column, justify=justify)  # type: ignore[arg-type]

    def add(measure: Callable[[argparse.Namespace], Rows], given: argparse.Namespace) -> None:
        rows = measure(given)
        load = f"{os.getloadavg()[0]:.1f}"  # in the minute before, these processes included
        for row in rows:
            table.add_row(*row, load)

    measured: dict[str, Callable[[argparse.Namespace], Rows]] = {
        "overhead": lambda _: overhead(),
        "rate": lambda _: rate(),
        "short": lambda given: short(10_000 if given.all else 2_000),
        "grading": lambda given: grading(("wake_up", "goal") if given.all else ("wake_up",)),
        "intervals": lambda given: intervals(given.draws),
    }
    parts(__doc__, {name: partial(add, each) for name, each in measured.items()}, all=False, draws=5000)
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
