"""Run a document from the editor and follow it live, without a robot: generate, start, watch, edit, reload."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document
from tests.support.documents import document, state, sub, transition
from tests.support.limits import CALL_LIMIT, RUN_LIMIT
from tests.support.processes import free_endpoint
from tests.support.pushes import Pushes
from visualhfsm._document.commands.text import SetText
from visualhfsm._document.places import Place
from visualhfsm._editor.parts import Parts, make_parts
from visualhfsm._monitor.messages import Present, Snapshot, Source, Stale, StartedPush, Structure
from visualhfsm._monitor.realm.run_log import LiveSnapshot
from zenoh_ice import Settings

TEXT = document(
    sub(
        1, 0, state(1, "walk", "beats += 1", initial=True), state(2, "stand", "beats += 1"),
        transition(1, 1, 2, "go", type="event"), transition(2, 2, 1, "False"),
        variables="beats = 0", period="20",
    ),
    events=("go",),
)  # fmt: skip


class Page:
    def __init__(self, parts: Parts, pushes: Pushes) -> None:
        self.parts = parts
        self.pushes = pushes

    async def follow(self, name: str) -> None:
        await self.pushes.until(
            lambda: any({"component": name} in push.components for push in self.pushes.of(Present)) or None
        )
        await self.parts.followers.follow(name)

    async def snapshot(self, matches: Callable[[LiveSnapshot], object]) -> LiveSnapshot:
        value = (await self.pushes.next(Snapshot, lambda push: matches(push.value))).value
        assert isinstance(value, LiveSnapshot)
        return value


@pytest.fixture
def source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Source:
    monkeypatch.setenv("VISUALHFSM_CLOCK", "wall")  # there is no robot whose clock could be looked for
    path = tmp_path / "walker.xml"
    path.write_text(TEXT, encoding="utf-8")
    found = read_document(path, Diagnostics())
    assert found is not None
    return Source(1, 1, found, path, False)


async def opened(go: Callable[[Page], object]) -> None:
    pushes = Pushes()
    settings = Settings(realm="test-live-run", connect=(free_endpoint(),), clock="wall", timeout=CALL_LIMIT)
    parts = make_parts(settings)(pushes)
    try:
        async with asyncio.timeout(RUN_LIMIT):
            await go(Page(parts, pushes))  # type: ignore[misc]
    finally:
        for service in (parts.started, parts.followers):
            await service.close()


def test_a_component_is_run_followed_and_reloaded_with_its_state(source: Source) -> None:
    async def go(page: Page) -> None:
        await page.parts.started.start(source, [])
        await page.follow("walker")
        await page.snapshot(
            lambda live: int(live.component.automata[0].variables["beats"]) > 0
        )  # it has begun
        await page.parts.followers.steer("walker", "sendEvent", {"name": "go", "data": ""})
        before = await page.snapshot(lambda live: live.component.automata[0].state == 2)

        edited = SetText(place=Place(kind="state", automaton=1, id=2, part="code"), text="beats -= 1").apply(
            source.document
        )
        await page.parts.started.generate(Source(1, 2, edited, source.path, True))
        report = await page.parts.followers.steer("walker", "reload", {})
        assert getattr(report, "generation", None) == 1
        after = await page.snapshot(lambda live: int(live.component.automata[0].variables["beats"]) < 0)
        assert after.component.automata[0].state == 2
        assert after.component.time > before.component.time
        assert Path(source.path or "").read_text() == TEXT

    asyncio.run(opened(go))


def test_a_component_is_followed_from_its_start_on_before_it_is_present(source: Source) -> None:
    async def go(page: Page) -> None:
        await page.parts.started.start(source, [])
        known = await page.parts.followers.follow("walker", awaited=True)
        assert (known["structure"], known["snapshot"], known["since"]) == (None, None, 0.0)
        structure = await page.pushes.until(lambda: next(iter(page.pushes.of(Structure)), None))
        assert structure.value.structure.name == "walker"
        await page.snapshot(bool)
        assert page.pushes.of(Stale) == []  # what has not begun is not silent

    asyncio.run(opened(go))


def test_a_component_that_is_killed_is_reported_as_ended_and_silent(source: Source) -> None:
    async def go(page: Page) -> None:
        before = set(psutil.Process().children())
        await page.parts.started.start(source, [])
        await page.follow("walker")
        await page.snapshot(bool)
        (child,) = (
            each
            for each in set(psutil.Process().children()) - before
            if "walker.py" in " ".join(each.cmdline())
        )
        child.kill()
        end = await page.pushes.next(StartedPush, lambda push: push.status == "ended")
        assert end.exit_code == -9
        assert end.message.startswith("it was terminated by SIGKILL, by somebody or because memory ran out, ")
        stale = await page.pushes.until(
            lambda: next((push for push in page.pushes.of(Stale) if push.since), None)
        )
        assert stale.component == "walker"
        await page.parts.started.start(source, [])
        await page.pushes.until(
            lambda: next((push for push in page.pushes.of(Stale)[1:] if not push.since), None)
        )

    asyncio.run(opened(go))


def test_the_red_button_ends_what_was_started_here(source: Source) -> None:
    async def go(page: Page) -> None:
        await page.parts.started.start(source, [])
        await page.follow("walker")
        report = await page.parts.followers.emergency_stop()
        assert getattr(report, "stopped", None) == ["walker"]
        end = await page.pushes.until(
            lambda: next((p for p in page.pushes.of(StartedPush) if p.status == "ended"), None)
        )
        assert end.exit_code == 0

    asyncio.run(opened(go))
