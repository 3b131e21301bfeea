"""Trials of the editor's tabs, in processes below it."""

from __future__ import annotations

import asyncio
import random
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

import psutil
import pytest

from codegen.messages import Message
from tests.support.coroutines import Loop
from tests.support.interleaving import interleave
from tests.support.processes import assert_gone, children
from tests.support.pushes import Pushes
from tests.support.soak import cases, repeated
from tests.support.waiting_trials import PLAN, WAITS
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._document.serialization import parse
from visualhfsm._monitor.messages import Source
from visualhfsm._monitor.recordings import open_recording
from visualhfsm_trials._messages import Choices, TrialsPush
from visualhfsm_trials._record import read_outcomes
from visualhfsm_trials._service import RunningTrials, TrialsLimits

WORKER = "visualhfsm.trials._worker"
SERIES = "visualhfsm_trials._series_process"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    folder = tmp_path / "documents"
    folder.mkdir()
    (folder / "waits.trials.toml").write_text(PLAN)
    (folder / "waits.xml").write_text(WAITS)
    return folder / "waits.xml"


def source(path: Path, text: str | None = None) -> Source:
    """Return an open document, perhaps with a text that is not saved."""
    found = Source(1, 0, parse(path.read_text(), Message("Cannot read")), path, False, path.stem)
    if text is None:
        return found
    return replace(found, document=parse(text, Message("Cannot read")), dirty=True)


class Trials:
    """A service, and what it has published."""

    def __init__(self, limits: TrialsLimits) -> None:
        self.pushes = Pushes()
        self.service = RunningTrials(self.pushes, limits=limits)

    @property
    def now(self) -> TrialsPush:
        return self.pushes.of(TrialsPush)[-1]

    async def until(self, matches: Callable[[TrialsPush], object]) -> TrialsPush:
        return await self.pushes.until(lambda: self.now if matches(self.now) else None)

    async def idle(self) -> TrialsPush:
        return await self.until(lambda push: push.status == "idle" and push.recording is None)

    async def read(self, opened: Source) -> TrialsPush:
        await self.service.read(opened)
        return await self.idle()

    async def run(self, opened: Source, *, again: bool = False, **choices: object) -> TrialsPush:
        await self.service.run(opened, Choices(**choices), again=again)  # type: ignore[arg-type]
        return await self.idle()


@asynccontextmanager
async def running(limits: TrialsLimits) -> AsyncIterator[Trials]:
    trials = Trials(limits)
    try:
        yield trials
    finally:
        await trials.service.close()


@pytest.fixture
def limits() -> TrialsLimits:
    return TrialsLimits()


@pytest.fixture
def trials(limits: TrialsLimits, loop: Loop) -> Trials:
    return loop.enter(running(limits))


def done(push: TrialsPush) -> int:
    return push.view.share.trials if push.view is not None else 0


@pytest.mark.slow
async def test_the_plan_is_read_and_its_trials_run_and_the_command_goes_on_with_their_outcomes(
    path: Path, trials: Trials
) -> None:
    looked = await trials.read(source(path))
    assert looked.plan is not None
    assert (looked.plan.file, looked.plan.runs, looked.plan.state) == ("waits.trials.toml", 12, "done")
    assert looked.view is None
    found = await trials.run(source(path))
    assert found.error == ""
    assert found.view is not None
    assert found.view.share.trials == 12
    assert 0 < found.view.share.successes < 12
    assert [each.name for each in found.view.dependences] == ["parameters.patience"]
    assert path.with_name("waits.outcomes.csv").read_text().count("\n") == 13
    more = await trials.run(source(path), runs=20)
    assert done(more) == 20
    assert more.view is not None
    assert more.view.looks == [12, 20]
    assert len([*read_outcomes(path.with_name("waits.outcomes.jsonl"))]) == 20


@pytest.mark.slow
async def test_what_is_chosen_is_the_plan_at_once(path: Path, trials: Trials) -> None:
    path.with_name("waits.trials.toml").unlink()
    await trials.read(source(path))
    await trials.service.run(source(path), Choices(runs=10, state="done", robot="none", limit=2))
    began = trials.now
    assert began.status == "running"
    assert began.plan is not None
    plan = began.plan
    assert (plan.runs, plan.state, plan.robot, plan.limit) == (10, "done", "none", 2)
    await trials.service.stop(1)


@pytest.mark.slow
async def test_it_stops_with_what_is_done_goes_on_there_and_ends_with_its_tab(
    path: Path, trials: Trials
) -> None:
    await trials.service.run(source(path), Choices(runs=100_000))
    await trials.until(lambda push: done(push) > 0)
    workers = children(WORKER)
    assert workers
    with pytest.raises(VisualHfsmError, match="run already"):
        await trials.service.run(source(path), Choices())
    await trials.service.stop(1)
    stopped = await trials.idle()
    assert stopped.error == ""
    assert_gone(workers)
    kept = done(stopped)
    assert 0 < kept < 100_000
    await trials.service.run(source(path), Choices(runs=100_000))
    first = await trials.until(lambda push: push.status == "running" and push.view is not None)
    assert done(first) >= kept
    await trials.until(lambda push: done(push) > kept)
    below = [*children(WORKER), *children(SERIES)]
    assert below
    await trials.service.forget(1)
    assert_gone(below)


@pytest.mark.slow
async def test_outcomes_of_an_older_version_are_replaced_only_on_purpose(
    path: Path, tmp_path: Path, trials: Trials
) -> None:
    former = await trials.run(source(path))
    assert former.opens
    changed = source(path, WAITS.replace("+= 0.5", "+= 5"))
    later = await trials.read(changed)
    assert (later.outdated, later.opens) == (True, True)
    async with running(TrialsLimits()) as others:  # which do not know what had run
        first = await others.read(changed)
        assert (first.outdated, first.opens) == (True, False)

    await trials.service.record(1, 3, tmp_path, lambda file: file.name)  # as it ran
    found = await trials.until(lambda push: push.recorded == 3)
    assert found.recording is None
    assert "+= 0.5" in open_recording(tmp_path / found.file).document
    assert [file.name for file in tmp_path.glob("*.mcap")] == [found.file]
    with pytest.raises(VisualHfsmError, match="run the trials"):
        await trials.service.record(2, 3, tmp_path, str)

    kept = await trials.run(changed)
    assert kept.outdated
    assert kept.view == former.view
    replaced = await trials.run(changed, again=True)
    assert not replaced.outdated
    assert replaced.view is not None
    assert replaced.view.share.successes == 12
    assert path.read_text() == WAITS  # changes that are not saved run, too


@pytest.mark.slow
async def test_the_robot_is_the_chosen_one_unless_the_plan_names_one(
    path: Path, tmp_path: Path, trials: Trials
) -> None:
    plan = path.with_name("waits.trials.toml")
    plan.write_text(PLAN.replace('"none"', '"fake"').replace("12", "1"))

    def body(push: TrialsPush) -> str:
        assert push.plan is not None
        return next(each.words for each in push.plan.fixed if each.name == "body")

    assert body(await trials.run(source(path))) == "H25"
    await trials.service.read(source(path), "T1")
    found = await trials.idle()
    assert (body(found), found.outdated) == ("T1", True)
    assert done(await trials.run(source(path), body="T1", again=True)) == 1
    await trials.service.record(1, 1, tmp_path, lambda file: file.name)
    found = await trials.until(lambda push: push.recorded == 1)
    assert open_recording(tmp_path / found.file).described.title == "Booster T1"
    plan.write_text(plan.read_text() + '[scene]\nbody = "G1"\n')
    assert body(await trials.run(source(path), body="T1")) == "G1"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("plan", "text", "words"),
    cases(
        [
            (PLAN + "[parameters]\n", WAITS, "at line 8"),
            (PLAN, WAITS.replace("self.waited += 0.5", "self.waited +="), "waits.xml:3:"),
        ],
        soak=[
            pytest.param(PLAN.replace("limit = 1", "limit = -1"), WAITS, "waits.trials.toml:3"),
            pytest.param(PLAN.replace('"done"', '"nowhere"'), WAITS, "there is no state nowhere"),
        ],
    ),
)
async def test_what_is_wrong_is_said_with_file_and_line(
    path: Path, plan: str, text: str, words: str, trials: Trials
) -> None:
    path.with_name("waits.trials.toml").write_text(plan)
    path.write_text(text)
    assert words in (await trials.run(source(path))).error


async def test_a_document_without_a_file_is_to_be_saved_first(path: Path, trials: Trials) -> None:
    with pytest.raises(VisualHfsmError, match="save the document first"):
        await trials.service.read(replace(source(path), path=None))


@pytest.mark.slow
async def test_a_process_that_is_killed_is_reported_and_what_is_done_is_kept(
    path: Path, trials: Trials
) -> None:
    await trials.service.run(source(path), Choices(runs=100_000))
    kept = done(await trials.until(lambda push: done(push) > 0))
    workers = children(WORKER)
    (series,) = children(SERIES)
    psutil.Process(series.pid).kill()
    assert "ended with -9" in (await trials.idle()).error
    assert_gone(workers)
    assert done(await trials.run(source(path), runs=kept)) == kept


@pytest.mark.slow
@pytest.mark.parametrize("limits", [TrialsLimits(longest_report=200)])
async def test_a_report_that_is_too_long_ends_the_process(path: Path, trials: Trials) -> None:
    assert "too long" in (await trials.run(source(path), runs=12)).error
    assert children(SERIES) == []


@pytest.mark.slow
def test_no_trials_run_after_they_were_stopped_or_their_tab_closed_whatever_is_asked_meanwhile(
    path: Path, tmp_path: Path
) -> None:
    async def go_on(seed: int) -> None:
        async with running(TrialsLimits(stop=(0.2, 0.2))) as trials:
            asked, closing = 0, False

            async def begin(request: Callable[[], Awaitable[object]]) -> None:
                nonlocal asked
                asked += 1
                await request()

            async def stop() -> None:
                before = asked
                await trials.service.stop(1)
                assert asked != before or closing or not children(SERIES)

            async def close() -> None:
                nonlocal closing
                closing = True  # this ends them now, not who stops them then
                await trials.service.forget(1)

            run = partial(begin, partial(trials.service.run, source(path), Choices()))
            look = partial(begin, partial(trials.service.read, source(path)))
            record = partial(begin, partial(trials.service.record, 1, 1, tmp_path, lambda file: file.name))
            await interleave(random.Random(seed), [run, stop, look, run, record, stop, close, run, look])
            assert not children(SERIES)
            with pytest.raises(VisualHfsmError, match="the document was closed"):
                await trials.service.run(source(path), Choices())

    for seed in range(repeated(6, soak=1000)):
        asyncio.run(go_on(seed))
