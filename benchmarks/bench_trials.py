"""Measure trials and grading: what a trial costs, how their rate grows with processes, and thirty marks.

`overhead` is the processor time of a trial beside that of a virtual run of the same behavior without one.
`rate` is that of trials with two processes, and with four workers of Dask, beside one, in rounds that take
turns. `short` are trials of 1 s with the fake robot. `page` is that of 1,000 trials, of these and of some on
a soccer field with all that a page can show, without a network. `grading` is the command `visualhfsm grade`
for thirty submissions, the solution and the mistakes of an exercise, with five trials each.

Rates are meaningful on a machine that does nothing else; the load is printed. Some three minutes; with
`--all`, which runs 10,000 short trials and grades the exercise `goal` too, some eight.

    python benchmarks/bench_trials.py [--all] [--only PART]... [--json FILE]
"""

from __future__ import annotations

import argparse
import json
import os
import random
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Final

import msgspec
import psutil
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from playwright.sync_api import Browser

from tests.support.browser import NO_CHROMIUM, chromium, chromium_path
from tests.support.dask_cluster import DaskCluster
from tests.support.processes import module
from visualhfsm._base.html_file import write_html
from visualhfsm.simulation import simulate
from visualhfsm.trials import Outcome, Plan, Pool, Spread, Success
from visualhfsm.trials._outcomes import Record, StateChange
from visualhfsm.trials._page import trials_page, write_trials_page
from visualhfsm.trials._plan import Disturbance
from visualhfsm.trials._series import LocalPool, Series
from visualhfsm.trials._summary import summarize
from visualhfsm.trials._trial import quiet, run_trial
from visualhfsm.trials._view import view_of
from visualhfsm_classes import read_exercise
from visualhfsm_cluster._cluster import Cluster

ROOT: Final = Path(__file__).resolve().parents[1]
PARTS: Final = ("overhead", "rate", "short", "page", "grading")
PAIRS: Final = 11
RUNS_OF_A_ROUND: Final = 72
ROUNDS: Final = 3
PAGE_RUNS: Final = 1000
OPENINGS: Final = 5
SUBMISSIONS: Final = 30
SAMPLES: Final = 20
"""How often memory is looked at while short trials run."""

FIRST_PAINT: Final = """
const look = () => {
    const section = document.querySelector('hfsm-trials section');
    if (section) setTimeout(() => { window.shown = performance.now(); });
    else requestAnimationFrame(look);
};
requestAnimationFrame(look);
"""

Rows = list[tuple[str, str, str]]
"""What was measured, how much it is, and the goal."""


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
    series = Series(Plan(document=str(follow), limit=10.0, camera="drawn", scene={"noise": True}))
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
    series = Series(short_plan(runs))
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


def page() -> Rows:
    """Measure two pages of 1,000 trials in Chromium, which is offline."""
    if chromium_path() is None:
        return [("page", NO_CHROMIUM, "")]
    rows: Rows = []
    with tempfile.TemporaryDirectory() as name, chromium() as browser:
        for title, plan, make in (
            ("short trials, with pages of the worst", short_plan(PAGE_RUNS), _write_computed),
            ("soccer, with all that there can be", soccer_plan(), _write_imagined),
        ):
            path = Path(name) / f"{title[:5]}.html"
            size = make(path, plan)
            rows += [
                (f"page: {title}", f"{size / 1e6:.2f} MB", "< 2 MB"),
                ("page: opened from the disk, offline", f"{_opening(browser, path):.2f} s", "<= 1 s"),
            ]
    return rows


def soccer_plan() -> Plan:
    """Return a plan with much that varies: places of robot and ball, light, noise, and disturbances."""
    return Plan(
        document=str(ROOT / "behaviors" / "score.xml"),
        runs=PAGE_RUNS,
        limit=90.0,
        scene={
            "world": "soccer",
            "noise": (True, False),
            "robot.x": Spread(lowest=-4.0, highest=2.0),
            "robot.y": Spread(lowest=-2.5, highest=2.5),
            "robot.heading": Spread(lowest=-3.1, highest=3.1),
            "Ball.x": Spread(lowest=0.0, highest=4.0),
            "Ball.y": Spread(lowest=-2.5, highest=2.5),
            "light.brightness": Spread(mean=1.0, deviation=0.2, lowest=0.3),
        },
        disturbances={
            f"push {number}": Disturbance(at=Spread(lowest=5.0, highest=80.0), push=60.0, seconds=0.2)
            for number in range(3)
        },
        success=Success(state="scored"),
    )


def _write_computed(path: Path, plan: Plan) -> int:
    """Write the page of trials that are run, and return its size in bytes."""
    file = path.with_suffix(".jsonl")
    series = Series(plan)
    with Record(file, series.header) as record, LocalPool() as pool:
        series.run(record, pool)
    return write_trials_page(path, plan, summarize(file, plan.varying, plan.runs), file, series.record)


def _write_imagined(path: Path, plan: Plan) -> int:
    """Write the page of trials that nobody has run, with the most of everything; return its size in bytes."""
    file = path.with_suffix(".jsonl")
    dice = random.Random(1)
    states = [f"playing, level {number % 4}/state {number}" for number in range(40)]
    with Record(file, Series(plan).header) as record:
        for number in plan.trials:
            times = sorted(dice.uniform(0.0, plan.limit) for _ in range(200))
            success = dice.random() < 0.7
            record.add(
                Outcome(
                    number=number,
                    values=plan.draw(number),
                    success=success,
                    reason="" if success else dice.choice(("fell", "not in scored after 90 s", "IndexError")),
                    time=times[-1],
                    states=dice.choice(states),
                    numbers={f"number {index}": dice.gauss(5.0, 1.0) for index in range(12)},
                    changes=tuple(StateChange(at, dice.choice(states)) for at in times),
                )
            )
    view = view_of(plan, summarize(file, plan.varying, plan.runs), file)
    return write_html(path, trials_page(view))


def _opening(browser: Browser, path: Path) -> float:
    """Return the median time in s until a page is shown, in a new window without a network."""
    times: list[float] = []
    asked: list[str] = []
    for _ in range(OPENINGS):
        with closing(browser.new_context(offline=True)) as context:
            page = context.new_page()
            page.on("request", lambda request: asked.append(request.url))
            page.add_init_script(FIRST_PAINT)
            page.goto(path.as_uri())
            page.wait_for_function("window.shown")
            times.append(page.evaluate("window.shown") / 1000)
    outside = [url for url in asked if not url.startswith(("file:", "data:", "blob:"))]
    assert not outside, outside
    return statistics.median(times)


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


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--all", action="store_true", help="10,000 short trials, and the exercise `goal`")
    parser.add_argument("--only", action="append", choices=PARTS, help="measure this part; may be repeated")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures to FILE")
    arguments = parser.parse_args()
    parts: dict[str, Callable[[], Rows]] = {
        "overhead": overhead,
        "rate": rate,
        "short": lambda: short(10_000 if arguments.all else 2_000),
        "page": page,
        "grading": lambda: grading(("wake_up", "goal") if arguments.all else ("wake_up",)),
    }
    table = Table(title=f"Trials and grading, with {os.cpu_count()} processors")
    for column, justify in (("", "left"), ("measured", "right"), ("goal", "right"), ("load", "right")):
        table.add_column(column, justify=justify)  # type: ignore[arg-type]
    found: Rows = []
    for name in arguments.only or PARTS:
        rows = parts[name]()
        load = f"{os.getloadavg()[0]:.1f}"  # in the minute before, these processes included
        for row in rows:
            table.add_row(*row, load)
        found += rows
    Console(width=120).print(table)
    if arguments.json:
        figures = {name: figure for name, figure, _ in found}
        arguments.json.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
