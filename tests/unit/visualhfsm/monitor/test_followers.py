"""Follow components on loopback as the page asks for it; their monitors are stubs that say what a test says."""

from __future__ import annotations

import asyncio
import time as wall
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Final

import msgspec
import pytest

from hfsm_runtime.recording_file.reader import RecordingFile
from interfaces.hfsm import ComponentSnapshot
from interfaces.jderobot import Camera, ImageData, ImageDescription, Time
from tests.support.coasting import Coasting
from tests.support.component import MonitorStub, snapshot
from tests.support.coroutines import Loop
from tests.support.limits import CALL_LIMIT, FOREVER
from tests.support.pushes import Pushes
from tests.support.robot_server import served
from tests.support.suite import Pair
from tests.support.watching import content
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._monitor.followers import Followers
from visualhfsm._monitor.messages import PartLimits, Present, Snapshot, Stale, Structure
from visualhfsm._monitor.realm.description import nao
from visualhfsm._monitor.realm.follower import Follower
from visualhfsm._monitor.realm.robot import RobotPresence
from visualhfsm._monitor.stopping import StopReport
from zenoh_ice import Settings

pytestmark = pytest.mark.slow

LIMITS: Final = PartLimits(refreshment=0.005, silence=FOREVER, component_end=0.05)


class Dance(MonitorStub):
    """A component whose snapshots a test publishes."""

    stops = 0

    def stop(self, current: object) -> None:
        self.stops += 1

    def say(self, time: float) -> None:
        """Publish what a component does at a time in s of its run."""
        self.getSnapshotPublisher.publish(said(time))


def said(time: float) -> ComponentSnapshot:
    return msgspec.structs.replace(snapshot(1.0), time=time)


def see(*_: object) -> ImageData:
    return ImageData(ImageDescription(1, 1, 3, "RGB8"), Time(0, 0), bytes(3))


Eye: Final = type("Eye", (Camera,), dict.fromkeys(Camera.__abstractmethods__) | {"getImageData": see})
"""A camera that is asked for nothing but images."""


class Page:
    """What the page asks for and gets, and the components of its realm."""

    def __init__(self, pair: Pair, limits: PartLimits = LIMITS) -> None:
        self.pair = pair
        self.pushes = Pushes()
        self.seen: list[RobotPresence] = []
        self.service = Followers(
            self.pushes,
            Settings(
                realm=pair.server.realm, connect=(pair.endpoint,), listen=(), clock="wall", timeout=CALL_LIMIT
            ),
            self.seen.append,
            limits=limits,
        )

    async def serve(self, name: str = "dance") -> Dance:
        """Serve a component, and wait until it is seen."""
        dance = Dance()
        self.pair.adapter.add(dance, f"Hfsm.{name}")
        await self.pushes.until(lambda: name in self.present() or None)
        return dance

    async def follow(self, dance: Dance, name: str = "dance") -> None:
        """Follow a component until its structure and its state are known."""
        await self.service.follow(name)
        seen = len(self.pushes.of(Snapshot))
        while not self.pushes.of(Structure) or len(self.pushes.of(Snapshot)) == seen:
            dance.say(1.0)  # one that is silent is not asked for its structure
            await asyncio.sleep(0.01)

    def present(self) -> list[object]:
        newest = self.pushes.of(Present)
        return [each["component"] for each in newest[-1].components] if newest else []


@asynccontextmanager
async def following(pair: Pair, limits: PartLimits = LIMITS) -> AsyncIterator[Page]:
    page = Page(pair, limits)
    try:
        yield page
    finally:
        await page.service.close()


@pytest.fixture
def limits() -> PartLimits:
    return LIMITS


@pytest.fixture
def page(pair: Pair, limits: PartLimits, loop: Loop) -> Page:
    return loop.enter(following(pair, limits))


def topics(path: Path) -> set[str]:
    """Return the topics of a recording that was written to its end."""
    file = RecordingFile(path)
    found = {message.topic for message in file.messages()}
    assert not file.truncated
    return found


async def test_components_that_come_and_go_are_reported_and_so_is_whether_there_is_a_robot(
    pair: Pair, page: Page
) -> None:
    await page.serve()
    pair.adapter.removeAll(["Hfsm.dance"])
    await page.pushes.until(lambda: not page.present() or None)
    assert not page.seen[-1].present


async def test_one_that_is_not_there_is_followed_only_if_it_is_awaited(page: Page) -> None:
    with pytest.raises(VisualHfsmError, match="dance"):
        await page.service.follow("dance")
    known = await page.service.follow("dance", awaited=True)
    assert (known["structure"], known["snapshot"], known["since"]) == (None, None, 0.0)
    await page.serve()
    await page.pushes.until(lambda: page.pushes.of(Structure) or None)


async def test_who_follows_gets_what_is_known_and_what_comes(page: Page) -> None:
    dance = await page.serve()
    await page.follow(dance)
    known = await page.service.follow("dance")
    assert known["structure"] is not None
    assert known["snapshot"] is not None
    assert known["structure"].structure.name == "dance_and_follow"
    assert known["snapshot"].component.time == 1.0
    assert {push.component for push in page.pushes.of(Snapshot)} == {"dance"}


@pytest.mark.parametrize("limits", [replace(LIMITS, silence=0.05)])
async def test_a_component_that_says_nothing_is_silent_since_then_until_it_speaks(page: Page) -> None:
    dance = await page.serve()
    await page.follow(dance)
    silent = await page.pushes.until(lambda: [push for push in page.pushes.of(Stale)[-1:] if push.since])
    assert silent[0].component == "dance"
    before = len(page.pushes.of(Stale))  # nothing ends the silence until it speaks
    dance.say(2.0)
    await page.pushes.until(lambda: [push for push in page.pushes.of(Stale)[before:] if not push.since])


async def test_what_is_followed_no_more_is_not_steered_asked_nor_recorded(tmp_path: Path, page: Page) -> None:
    dance = await page.serve()
    await page.follow(dance)
    await page.service.steer("dance", "pause", {})
    await page.service.unfollow("dance")
    for asked in (
        page.service.steer("dance", "pause", {}),
        page.service.moment("dance", 1.0),
        page.service.record("dance", tmp_path / "x.mcap", "", 0),
        page.service.exported("dance", None, ()),
    ):
        with pytest.raises(VisualHfsmError, match="dance is not followed"):
            await asked
    await page.service.unfollow("dance")  # again, by a window that did not know


class TestRecordings:
    async def test_one_runs_at_a_time_and_ends_when_that_is_asked(self, tmp_path: Path, page: Page) -> None:
        dance = await page.serve()
        await page.follow(dance)
        await page.service.record("dance", tmp_path / "run.mcap", "<VisualHFSM/>", 0)
        with pytest.raises(VisualHfsmError, match="dance is being recorded already"):
            await page.service.record("dance", tmp_path / "other.mcap", "", 0)
        shown = await page.pushes.until(
            lambda: next(
                (
                    push
                    for push in page.pushes.of(Present)
                    if any("recording" in each for each in push.components)
                ),
                None,
            )
        )
        assert shown.components[0]["recording"] == "run.mcap"
        await page.service.end_record("dance")
        await page.service.end_record("dance")
        assert not (tmp_path / "other.mcap").exists()
        assert "/snapshots" in topics(tmp_path / "run.mcap")

    async def test_its_file_has_all_when_it_was_ended_whoever_ended_it_first(
        self, tmp_path: Path, page: Page
    ) -> None:
        dance = await page.serve()
        await page.follow(dance)
        await page.service.record("dance", tmp_path / "run.mcap", "", 0)
        first = asyncio.create_task(page.service.end_record("dance"))
        await asyncio.sleep(0)  # it has begun
        await page.service.end_record("dance")
        assert "/snapshots" in topics(tmp_path / "run.mcap")
        await first

    async def test_it_ends_with_who_follows_and_with_the_page(
        self, pair: Pair, tmp_path: Path, loop: Loop
    ) -> None:
        async with following(pair) as page:
            dance = await page.serve()
            for name in ("first", "second"):
                await page.follow(dance)
                await page.service.record("dance", tmp_path / f"{name}.mcap", "", 0)
                if name == "first":
                    await page.service.unfollow("dance")
        for name in ("first", "second"):
            assert "/snapshots" in topics(tmp_path / f"{name}.mcap")

    async def test_it_waits_for_the_first_news_of_a_component(self, tmp_path: Path, page: Page) -> None:
        await page.service.follow("dance", awaited=True)
        begun = asyncio.create_task(page.service.record("dance", tmp_path / "run.mcap", "", 0))
        dance = await page.serve()
        while not begun.done():
            dance.say(1.0)
            await asyncio.sleep(0.01)
        await begun


async def test_one_whose_update_fails_keeps_no_other_from_being_updated(
    page: Page, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    update = Follower.update

    def fail(follower: Follower) -> None:
        if follower.component == "bad":
            raise ValueError("this is none of ours")
        update(follower)

    await page.serve("bad")
    dance = await page.serve()
    await page.service.follow("bad")
    monkeypatch.setattr(Follower, "update", fail)
    await page.follow(dance)
    assert "this is none of ours" in caplog.text


class TestStop:
    async def test_without_a_robot_components_end_and_there_is_nothing_else_to_report(
        self, pair: Pair, page: Page
    ) -> None:
        dance = await page.serve()
        stop = asyncio.create_task(page.service.emergency_stop())
        while not dance.stops:
            await asyncio.sleep(0.01)
        pair.adapter.removeAll(["Hfsm.dance"])
        assert await stop == StopReport(["dance"], {})

    async def test_a_component_that_goes_on_is_named(self, page: Page) -> None:
        await page.serve()
        report = await page.service.emergency_stop()
        assert {name: str(why) for name, why in report.failed.items()} == {
            "dance": "it has not ended within 0.05 s"
        }

    async def test_it_goes_on_without_its_caller_and_the_page_closes_once_it_is_over(
        self, loop: Loop
    ) -> None:
        robot = Coasting()

        def stops() -> list[asyncio.Task[object]]:
            return [each for each in asyncio.all_tasks() if each.get_name() == "emergency stop"]

        with served(robot) as server:
            settings = Settings(
                realm=server.realm, connect=(server.endpoint,), clock="wall", timeout=CALL_LIMIT
            )
            service = Followers(Pushes(), settings, limits=replace(LIMITS, standstill=FOREVER))
            stop = asyncio.create_task(service.emergency_stop())
            while not stops():
                await asyncio.sleep(0.01)
            stop.cancel()
            closing = asyncio.create_task(service.close())
            since = robot.reads
            while robot.reads < since + 10:
                await asyncio.sleep(0.01)
            assert not closing.done()
            robot.coasts = False
            await closing
            assert not stops()


async def test_a_robot_is_drawn_by_its_hash_while_somebody_shows_it(page: Page) -> None:
    assert await page.service.body(nao().hash) == msgspec.Raw(nao().page)
    assert await page.service.body("gone") is None


async def test_a_picture_that_nobody_kept_is_none(page: Page) -> None:
    assert await page.service.picture("dance", "Camera", 1.0) is None


async def test_the_page_of_a_run_has_the_pictures_of_its_time_alone(pair: Pair, page: Page) -> None:
    pair.adapter.add(Eye(), "Camera")
    await page.follow(await page.serve("before"), "before")
    while await page.service.picture("before", "Camera", wall.time()) is None:
        await asyncio.sleep(0.01)
    await page.service.unfollow("before")
    dance, second = await page.serve(), 1.0
    pictures: dict[str, list[tuple[float, str]]] = {}
    await page.service.follow("dance")
    while not pictures:
        await asyncio.sleep(0.01)
        dance.say(second := second + 0.1)
        with suppress(VisualHfsmError):  # as long as nothing is known of the run
            found, moments = content(await page.service.exported("dance", None, ()))
            pictures = found["pictures"]
    assert all(moments[0]["at"] <= taken <= moments[-1]["at"] for taken, _ in pictures["Camera"])


async def test_documents_may_use_what_a_nao_serves_while_no_robot_is_there(page: Page) -> None:
    await page.serve()
    found = await page.service.identities()
    assert {"Hfsm.dance", "Body", "Head"} <= found.keys()
