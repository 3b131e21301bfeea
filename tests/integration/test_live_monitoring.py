"""Follow and steer components for the page: real automata, real Zenoh on loopback, a fake robot."""

from __future__ import annotations

import asyncio
import io
import json
import math
import random
import re
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import asynccontextmanager, closing, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import pytest
from PIL import Image

from hfsm_runtime import Component
from hfsm_runtime._runtime import Runtime
from hfsm_runtime.debugger.monitor import Monitor
from hfsm_runtime.recording_file.messages import Fault
from hfsm_runtime.recording_file.reader import RecordingFile
from interfaces.hfsm import ComponentStatus, ComponentStructure
from interfaces.jderobot import CommandRefusedException
from interfaces.nao import (
    Description,
    PoseHeadPrx,
    SafetyPrx,
    SoundsPrx,
    SpeechPrx,
    Vector3,
)
from naoserver.bodies import find_body
from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from naoserver.serving.server import serve
from tests.support.calculator_servant import CalculatorI
from tests.support.coasting import Coasting
from tests.support.component import MonitorStub, dance_and_follow, snapshot
from tests.support.documents import compile_to, document, load, state, sub, transition
from tests.support.interleaving import interleave
from tests.support.limits import CALL_LIMIT, RUN_LIMIT
from tests.support.pushes import Pushes
from tests.support.robot_server import ServedRobot, eventually, served
from tests.support.soak import repeated
from tests.support.suite import Pair
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._monitor.followers import Followers
from visualhfsm._monitor.messages import PartLimits, Present, Snapshot, Stale, Structure
from visualhfsm._monitor.realm.description import nao
from visualhfsm._monitor.realm.follower import Follower, LiveStructure, Silence
from visualhfsm._monitor.realm.robot import RobotMonitor, RobotState
from visualhfsm._monitor.realm.run_log import LiveSnapshot
from visualhfsm._monitor.recordings import open_recording
from zenoh_ice import Current, Sample, Settings, WallClock, initialize

PARAMETERS = "<parameters><parameter><name>speed</name><type>float</type><default>0.3</default></parameter></parameters>"


LIMITS = PartLimits(component_end=0.1)
"""The components here have the process of the test, and do not end before it ends them."""


def walker(code: str = "beats += 1") -> str:
    """Return a document: walk, with step and rest below it, and stand."""
    return document(
        sub(
            1, 0, state(1, "walk", code, initial=True, child=2), state(2, "stand"),
            transition(1, 1, 2, "ball_lost", type="event", name="lost"),
            transition(2, 2, 1, "False", name="back"), transition(3, 1, 2, "3600000", type="time"),
            variables="beats = 0", period="20",
        ),
        sub(
            2, 1, state(1, "step", initial=True), state(2, "rest"),
            transition(1, 1, 2, "tired > 5", name="rest"), transition(2, 2, 1, "False"),
            variables="tired = 1", period="20",
        ),
        head=PARAMETERS, events=("ball_lost",),
    )  # fmt: skip


@dataclass
class Walker:
    """A component that runs in the test's process, with a separate session."""

    runtime: Runtime
    file: Path


@pytest.fixture
def robot() -> Iterator[ServedRobot]:
    with served(FakeRobot()) as server:
        yield server


@pytest.fixture
def component(tmp_path: Path) -> Component:
    return load(compile_to(tmp_path, walker(), "walker"))


@pytest.fixture
def running(robot: ServedRobot, component: Component, tmp_path: Path) -> Iterator[Walker]:
    with start(robot, component) as runtime:
        yield Walker(runtime, tmp_path / "walker.xml")


@contextmanager
def start(robot: ServedRobot, component: Component) -> Iterator[Runtime]:
    with initialize(realm=robot.realm, connect=[robot.endpoint], clock="wall") as communicator:
        runtime = Runtime(component, WallClock())
        with Monitor(runtime, communicator):
            runtime.start()
            try:
                yield runtime
            finally:
                runtime.stop()


@dataclass
class Page:
    """What a page has: the service, and what it published."""

    service: Followers
    pushes: Pushes

    async def attach(self) -> Any:
        await self.pushes.until(lambda: any(c.components for c in self.pushes.of(Present)) or None)
        return await self.service.follow("walker")

    async def do(self, action: str, **arguments: object) -> Any:
        return await self.service.steer("walker", action, arguments)

    async def snapshot(self, matches: Callable[[LiveSnapshot], object] = lambda _: True) -> LiveSnapshot:
        push = await self.pushes.next(Snapshot, lambda push: matches(push.value))
        assert isinstance(push.value, LiveSnapshot)
        return push.value


@asynccontextmanager
async def page(robot: ServedRobot) -> AsyncIterator[Page]:
    pushes = Pushes()
    service = Followers(
        pushes,
        Settings(realm=robot.realm, connect=(robot.endpoint,), clock="wall", timeout=CALL_LIMIT),
        limits=LIMITS,
    )
    try:
        yield Page(service, pushes)
    finally:
        await service.close()


def on_page(robot: ServedRobot, go: Callable[[Page], Awaitable[None]]) -> None:
    async def run() -> None:
        async with asyncio.timeout(RUN_LIMIT), page(robot) as opened:
            await go(opened)

    asyncio.run(run())


def state_names(opened: Page) -> set[str]:
    """Return the names of the states that the page knows of."""
    automata = opened.pushes.of(Structure)[-1].value.structure.automata
    return {state.name for automaton in automata for state in automaton.states}


def test_structure_and_snapshots_are_published_as_time_goes_on(robot: ServedRobot, running: Walker) -> None:
    async def go(opened: Page) -> None:
        await opened.attach()
        structure = await opened.pushes.until(lambda: next(iter(opened.pushes.of(Structure)), None))
        assert isinstance(structure.value, LiveStructure)
        assert [a.name for a in structure.value.structure.automata] == ["walker", "walk"]
        times = [(await opened.snapshot()).component.time for _ in range(5)]
        assert times == sorted(set(times))
        encoded = msgspec.json.decode(msgspec.json.encode(opened.pushes.of(Snapshot)[-1]))
        assert encoded["value"]["component"]["automata"][0]["variables"].keys() == {"beats"}

    on_page(robot, go)


def test_a_change_of_state_is_reported_at_once_and_can_be_scrubbed_back_to(
    robot: ServedRobot, running: Walker
) -> None:
    async def go(opened: Page) -> None:
        await opened.attach()
        await opened.snapshot()
        await opened.do("sendEvent", name="ball_lost", data="")
        changed = await opened.snapshot(lambda live: live.component.automata[0].state == 2)
        assert changed.component.automata[1].ghost
        entered = changed.component.automata[0].enteredAt
        timeline = (await opened.service.follow("walker"))["timeline"]
        assert (entered, 1, 1, 2, 1) in timeline.changes
        before = msgspec.convert(await opened.service.moment("walker", entered - 1e-6), LiveSnapshot)
        assert before.component.automata[0].state == 1
        series = await opened.service.series("walker", ["1.beats", "1:lastCycle"], 0.0, 1e12, 1000)
        beats = [value for value in series["values"]["1.beats"] if value is not None]
        assert beats == sorted(beats)
        assert len(series["times"]) == len(series["values"]["1:lastCycle"])

    on_page(robot, go)


def test_everything_that_steers_a_component_reaches_it(robot: ServedRobot, running: Walker) -> None:
    """What each of these does is a promise of the runtime, whose tests have the cases."""
    points = [{"automaton": 2, "state": 2, "transition": 0, "condition": "tired == 9"}]

    async def go(opened: Page) -> None:
        await opened.attach()
        with pytest.raises(VisualHfsmError, match=r"no component walkr runs in .*; did you mean walker"):
            await opened.service.follow("walkr")
        await opened.do("pause")
        paused = await opened.snapshot(lambda live: live.component.status == 1)
        for _ in range(3):
            await opened.do("step", automaton=1)
        cycles = paused.component.automata[0].cycles
        await opened.snapshot(lambda live: live.component.automata[0].cycles >= cycles + 3)
        await opened.do("resume")
        await opened.snapshot(lambda live: live.component.status == 0)
        assert "tired" in (await opened.do("explain", automaton=2)).transitions[0].reason
        await opened.do("setVariable", automaton=0, name="speed", value="0.75")
        await opened.snapshot(lambda live: live.component.parameters == {"speed": "0.75"})
        with pytest.raises(VisualHfsmError, match="9"):
            await opened.do("forceTransition", automaton=9, transition=1)
        with pytest.raises(VisualHfsmError, match="nothing"):
            await opened.do("setVariable", automaton=1, name="nothing", value="1")
        await opened.do("forceTransition", automaton=2, transition=1)
        await opened.snapshot(lambda live: live.component.automata[1].state == 2)

        compile_to(running.file.parent, walker("beats -= 1"), "walker")
        assert (await opened.do("reload")).generation == 1
        await opened.pushes.until(
            lambda: any(push.value.structure.generation == 1 for push in opened.pushes.of(Structure))
        )
        assert (await opened.snapshot()).component.automata[1].state == 2
        with pytest.raises(VisualHfsmError, match="<event><name>nap</name></event>"):
            await opened.do("sendEvent", name="nap", data="")
        await opened.do("forceTransition", automaton=2, transition=2)
        await opened.do("setBreakpoints", breakpoints=points)
        known = await opened.pushes.until(
            lambda: next((push for push in opened.pushes.of(Structure) if push.value.breakpoints), None)
        )
        assert known.value.breakpoints[0].condition == "tired == 9"
        await opened.do("setVariable", automaton=2, name="tired", value="9")
        stopped = await opened.snapshot(lambda live: live.component.stoppedAt)
        assert stopped.component.automata[1].state == 2
        await opened.do("stop")

    on_page(robot, go)
    eventually(lambda: running.runtime.status is ComponentStatus.Halted or running.runtime.ended.is_set())


def test_breakpoints_are_never_reported_as_none_while_they_are_requested_again(
    robot: ServedRobot, running: Walker
) -> None:
    async def go(opened: Page) -> None:
        def published() -> list[int]:
            return [len(structure.value.breakpoints) for structure in opened.pushes.of(Structure)]

        await opened.attach()
        first = {"automaton": 2, "state": 2, "transition": 0, "condition": "tired == 9"}
        await opened.do("setBreakpoints", breakpoints=[first])
        await opened.pushes.until(lambda: 1 in published())
        await opened.do("setBreakpoints", breakpoints=[first, first | {"automaton": 1, "condition": "False"}])
        await opened.pushes.until(lambda: 2 in published())
        assert published() == sorted(published())

    on_page(robot, go)


def test_a_lost_component_is_silent_since_then_and_recovers(
    robot: ServedRobot, component: Component, tmp_path: Path
) -> None:
    (tmp_path / "later").mkdir()
    later = load(compile_to(tmp_path / "later", walker().replace(">rest<", ">sleep<"), "walker"))

    async def go(opened: Page) -> None:
        with start(robot, component):
            await opened.attach()
            last = await opened.snapshot()
        # On a busy machine it may have been silent before it ended, too.
        await opened.pushes.until(
            lambda: next((push for push in opened.pushes.of(Stale) if push.since >= last.at - 1), None)
        )
        with start(robot, later):
            await opened.pushes.until(lambda: opened.pushes.of(Stale)[-1].since == 0)
            again = await opened.snapshot()
            assert again.component.startedAt > last.component.startedAt
            await opened.pushes.until(
                lambda: next((push for push in opened.pushes.of(Structure) if push.value.run == 2), None)
            )
            await opened.pushes.until(
                lambda: state_names(opened) == {"walk", "stand", "step", "sleep"} or None
            )

    on_page(robot, go)


def test_the_last_word_of_a_component_that_is_gone_does_not_bring_it_back(pair: Pair) -> None:
    published: list[object] = []
    robot: Any = SimpleNamespace(read=RobotState, cameras=list)
    follower = Follower(pair.client, "dance_and_follow", robot, published.append)
    follower.update()
    follower._on_snapshot(Sample(snapshot(1.0), 1, 1.0, 0.0))
    follower.update()
    follower.close()
    gone, back, word, gone_again = published
    assert isinstance(word, LiveSnapshot)
    assert [isinstance(each, Silence) and each.since > 0 for each in (gone, back, gone_again)] == [
        True,
        False,
        True,
    ]


def test_of_many_automata_fewer_snapshots_are_passed_on(pair: Pair) -> None:
    monitor = Crowd()
    published: list[object] = []
    pair.adapter.add(monitor, "Hfsm.crowd")
    robot: Any = SimpleNamespace(read=RobotState, cameras=list)
    follower = Follower(pair.client, "crowd", robot, published.append)
    try:
        while follower.structure is None:
            follower.update()
            time.sleep(0.01)
        began, before = time.monotonic(), len(published)
        for number in range(30):
            monitor.getSnapshotPublisher.publish(msgspec.structs.replace(snapshot(1.0), time=number / 10))
            time.sleep(0.01)
        eventually(lambda: follower.log.newest is not None and follower.log.newest.component.time == 2.9)
        passed = time.monotonic() - began
    finally:
        follower.close()
    # 200 automata: at most 2,000 of them a second are passed on.
    assert 2 <= len(published) - before <= 10 * passed + 2


class Crowd(MonitorStub):
    """A component of 200 automata."""

    def getStructure(self, current: Current) -> ComponentStructure:
        structure = dance_and_follow()
        structure.automata = [
            msgspec.structs.replace(structure.automata[0], id=number + 1) for number in range(200)
        ]
        return structure


def test_the_red_button_stops_the_robot_without_any_component(robot: ServedRobot) -> None:
    async def go(opened: Page) -> None:
        with robot.client() as client:
            head = client.proxy(PoseHeadPrx, "Head")
            head.setPose(1.5, 0.0, 0.02)
            eventually(lambda: head.getPose().panSpeed > 0.1)
            report = await opened.service.emergency_stop()
            assert report.failed == {}
            assert report.stopped == ["Body", "Head", "Motors"]
            eventually(lambda: abs(head.getPose().panSpeed) < 0.01)
            assert head.getPose().pan < 1.4

    on_page(robot, go)


def test_a_stopped_robot_takes_no_command_until_it_is_reset_from_the_page(robot: ServedRobot) -> None:
    async def go(opened: Page) -> None:
        with robot.client() as client:
            head = client.proxy(PoseHeadPrx, "Head")
            await opened.service.emergency_stop()
            with pytest.raises(CommandRefusedException, match="STOP"):
                head.setPose(0.5, 0.0, 0.5)
            await opened.service.reset_robot()
        with robot.client() as another:
            another.proxy(PoseHeadPrx, "Head").setPose(0.5, 0.0, 0.5)

    on_page(robot, go)


def test_a_reset_waits_for_a_stop_that_is_still_repeated() -> None:
    robot = Coasting()

    async def go(opened: Page) -> None:
        stop = asyncio.create_task(opened.service.emergency_stop())
        await asyncio.to_thread(eventually, lambda: safety.getSafetyState().stopped)
        reset = asyncio.create_task(opened.service.reset_robot())
        since = robot.reads
        await asyncio.to_thread(eventually, lambda: robot.reads > since + 10)
        assert not stop.done()
        assert not reset.done()
        robot.coasts = False
        await asyncio.gather(stop, reset)
        assert not safety.getSafetyState().stopped

    with served(robot) as server, server.client() as client:
        safety = client.proxy(SafetyPrx, "Safety")
        on_page(server, go)


def test_joints_of_another_interface_say_why_they_are_unknown(pair: Pair) -> None:
    watch = RobotMonitor(pair.client)
    assert watch.read().trouble == ""
    pair.adapter.add(CalculatorI(), "Body")

    def is_shown() -> bool:
        watch.update()
        return "Body, a ::test::Scientific" in watch.read().trouble

    eventually(is_shown)


def test_without_a_robot_there_is_no_emergency_stop_to_reset(pair: Pair) -> None:
    pair.adapter.add(CalculatorI(), "Calculator")

    async def go() -> None:
        service = Followers(
            Pushes(),
            # What is not there is waited for a tenth of that, where something else is.
            Settings(realm=pair.server.realm, connect=(pair.endpoint,), clock="wall", timeout=5.0),
        )
        try:
            with pytest.raises(VisualHfsmError, match="Safety"):
                await service.reset_robot()
        finally:
            await service.close()

    asyncio.run(go())


def test_the_red_button_stops_the_component_too(robot: ServedRobot, running: Walker) -> None:
    async def go(opened: Page) -> None:
        await opened.attach()
        report = await opened.service.emergency_stop()
        assert set(report.stopped) | set(report.failed) >= {"Head", "Body", "walker"}

    on_page(robot, go)
    eventually(running.runtime.ended.is_set)


def test_the_robot_is_part_of_the_snapshots(robot: ServedRobot, running: Walker) -> None:
    async def go(opened: Page) -> None:
        await opened.attach()
        live = await opened.snapshot(lambda live: live.robot.joints and live.robot.health)
        assert len(live.robot.joints) == 26
        assert live.robot.pan is not None
        facts = await opened.service.facts()
        assert "Camera" in facts.cameras
        found = await opened.service.identities()
        assert "::nao::PoseHead" in found["Head"]
        assert {limit.name for limit in facts.limits} == set(live.robot.joints)

    on_page(robot, go)


def test_cameras_are_shown_as_jpeg_to_several_windows(robot: ServedRobot) -> None:
    async def frames(opened: Page, count: int) -> list[bytes]:
        found = []
        stream = opened.service.camera("Camera")
        async for frame in stream:
            if isinstance(frame, bytes):  # not the marks of what is seen
                found.append(frame)
            if len(found) == count:
                break
        await stream.aclose()
        return found

    async def go(opened: Page) -> None:
        while "Camera" not in (await opened.service.facts()).cameras:
            await asyncio.sleep(0.01)
        for each in await asyncio.gather(frames(opened, 3), frames(opened, 3)):
            with Image.open(io.BytesIO(each[0])) as image:
                assert (image.format, image.size) == ("JPEG", (320, 240))
        with pytest.raises(VisualHfsmError, match="no camera Head"):
            await anext(opened.service.camera("Head"))

    on_page(robot, go)


def test_what_is_seen_is_marked_on_the_pictures(robot: ServedRobot) -> None:
    async def go(opened: Page) -> None:
        marks: dict[str, Any] = {}
        while "Camera" not in (await opened.service.facts()).cameras:
            await asyncio.sleep(0.01)
        stream = opened.service.camera("Camera")
        async for frame in stream:
            if isinstance(frame, str):
                marks = {mark["label"]: mark for mark in json.loads(frame)}
            elif marks:
                jpeg = frame
                break
        await stream.aclose()
        with Image.open(io.BytesIO(jpeg)) as image:
            for label, (more, less) in {"red ball": (0, 1), "green ball": (1, 0)}.items():
                pixel: Any = image.getpixel((round(marks[label]["u"]), round(marks[label]["v"])))
                assert pixel[more] > pixel[less] + 60

    on_page(robot, go)


async def described_body(opened: Page, named: str) -> Any:
    """Return the robot of a name in the poses, as the page asks for it."""
    found = await opened.service.body(named)
    assert found is not None
    return json.loads(bytes(found))


def test_the_poses_begin_with_the_body_and_go_on(robot: ServedRobot) -> None:
    async def go(opened: Page) -> None:
        stream = opened.service.poses("en")
        body, state, seen = "", {}, set()
        async for frame in stream:
            content = json.loads(frame)
            if "body" in content:
                body = content["body"]
            elif "world" in content:
                seen = {(shape["object"], shape["kind"]) for shape in content["world"]}
            elif "torso" in content:
                state = content
            if (
                body
                and state
                and state["joints"]
                and state["tilt"] is not None
                and len(state["objects"]) == 2
            ):
                break
        assert seen == {("BallGreen", "sphere"), ("BallRed", "sphere")}
        described = await described_body(opened, body)
        assert described["links"][0] == {"name": "torso"}
        assert set(state["joints"]) == {link["joint"] for link in described["links"] if "joint" in link}
        assert state["tilt"] == pytest.approx(0.0, abs=0.01)
        assert state["torso"] is None
        assert math.hypot(*state["objects"]["BallGreen"][:2]) == pytest.approx(1.0, abs=0.01)
        await stream.aclose()
        with pytest.raises(VisualHfsmError, match="no simulation"):
            await opened.service.set_scene("pushRobot", {})

    on_page(robot, go)


def test_the_page_hears_what_the_robot_says_and_plays_until_it_is_silent(robot: ServedRobot) -> None:
    async def go(opened: Page) -> None:
        stream = opened.service.poses("en")

        async def heard(matches: Callable[[Any], bool]) -> Any:
            async for frame in stream:
                found = json.loads(frame).get("heard")
                if found and matches(found):
                    return found
            return None

        async def next_heard(matches: Callable[[Any], bool]) -> Any:
            return await asyncio.wait_for(heard(matches), CALL_LIMIT)

        await anext(stream)
        with robot.client() as client:
            speech, sounds = client.proxy(SpeechPrx, "Speech"), client.proxy(SoundsPrx, "Sounds")
            await asyncio.to_thread(speech.say, "Goal! " * 9)
            said = await next_heard(lambda found: found["says"])
            assert said == {"says": "Goal! " * 9, "sound": ""}
            await asyncio.to_thread(sounds.playTone, 440.0, 5.0, 0.5)
            played = await next_heard(lambda found: found["sound"])
            assert played["sound"] == "tone"
            await asyncio.to_thread(speech.stop)
            await asyncio.to_thread(sounds.stop)
            silent = await next_heard(lambda found: not found["says"] and not found["sound"])
            assert silent == {"says": "", "sound": ""}
        await stream.aclose()

    on_page(robot, go)


def test_the_page_lets_a_part_fail_sees_it_and_heals_it(robot: ServedRobot) -> None:
    async def go(opened: Page) -> None:
        stream = opened.service.poses("es")

        async def failing(fails: list[dict[str, object]]) -> Any:
            """Wait for the next news of what fails, which must be these."""
            async for frame in stream:
                if (found := json.loads(frame).get("failing")) and found["can"]:
                    assert found["now"] == fails
                    return found["can"]
            return None

        head = {"part": "HeadYaw", "kind": "offset", "amount": 0.2}
        foot = {"part": "LHandBack", "kind": "dead", "amount": 0.0}
        can = await failing([])
        (joints,) = (each for each in can if "HeadYaw" in each["parts"])
        (camera,) = (each for each in can if "Camera" in each["parts"])
        assert {"LKneePitch", "RHand"} <= {*joints["parts"]}
        assert camera["kinds"][0] == {
            "name": "black",
            "text": "sus imágenes son negras",
            "unit": "",
            "least": 0.0,
            "greatest": 0.0,
            "usual": 0.0,
        }
        await opened.service.set_faults("inject", head)
        assert await failing([head]) == can
        await opened.service.set_faults("inject", {"part": "LHandBack", "kind": "dead"})
        await failing([head, foot])
        with pytest.raises(VisualHfsmError, match=r"the amount is 9, and must be from -0\.5 to 0\.5 rad"):
            await opened.service.set_faults("inject", head | {"amount": 9.0})
        await opened.service.set_faults("heal", {"part": "HeadYaw"})
        await failing([foot])
        await opened.service.set_faults("heal", {"part": None})
        await failing([])
        await stream.aclose()

    on_page(robot, go)


def test_the_page_shows_another_robot_when_that_has_replaced_the_first(robot: ServedRobot) -> None:
    async def go(opened: Page) -> None:
        async def names(title: str) -> Any:
            async for frame in opened.service.poses("en"):
                named = json.loads(frame).get("body")
                if named and (found := await described_body(opened, named))["title"] == title:
                    return found
            return None

        assert (await names("Nao H25"))["name"] == "H25"
        robot.serving.close()
        await names("Nao H25")  # until there is another one, it is the last one
        adapter = robot.served_by.createObjectAdapter("another")
        with closing(FakeRobot(body=find_body("T1"))) as another, serve(another, adapter):
            adapter.activate()
            other = await names("Booster T1")
        assert {link["joint"] for link in other["links"] if "joint" in link} == {*find_body("T1").joint_names}
        assert await opened.service.body("unknown") is None

    on_page(robot, go)


def test_the_wheels_of_a_cart_have_no_limits_and_its_head_pans() -> None:
    async def go(opened: Page) -> None:
        while not (facts := await opened.service.facts()).limits:
            await asyncio.sleep(0.01)
        limits = {each["name"]: each for each in json.loads(msgspec.json.encode(facts))["limits"]}
        wheels = cart.groups.wheels
        assert [(limits[wheel]["lower"], limits[wheel]["upper"]) for wheel in wheels] == [(None, None)] * 2

    cart = find_body("Cart")
    with served(FakeRobot(body=cart)) as robot:
        on_page(robot, go)


class Undescribed(Description):
    """A description of which a stranger says anything."""

    def __init__(self, body: str, looks: str) -> None:
        self.body = body
        self.looks = looks

    def getBody(self, current: Current) -> str:
        return self.body

    def getLooks(self, current: Current) -> str:
        return self.looks


@pytest.mark.parametrize(
    ("body", "times"),
    [("[", 10_000), ('{"name": "X", "links": []}', 1), ("x", (8 << 20) + 1)],  # pytest keeps parameters
    ids=range(3),
)
def test_a_description_that_is_not_sound_is_said_and_nothing_is_drawn(
    pair: Pair, body: str, times: int
) -> None:
    server = pair.server.createObjectAdapter("stranger")
    server.add(Undescribed(body * times, ""), "Description")
    server.activate()
    monitor = RobotMonitor(pair.client)

    def is_refused() -> bool:
        monitor.update()
        return bool(monitor.undescribed)

    eventually(is_refused)
    assert re.search("the robot's body|bytes", monitor.undescribed)
    assert monitor.described is None


@pytest.mark.parametrize(("name", "is_drawn"), [("H21", True), ("T1", False)])
def test_a_robot_that_describes_nothing_is_drawn_if_it_is_a_nao(
    pair: Pair, name: str, is_drawn: bool
) -> None:
    with closing(FakeRobot(body=find_body(name))) as robot:
        adapter = pair.server.createObjectAdapter("undescribed")
        adapter.add(Assembly(robot, ServerOptions(), WallClock()).servants["Body"], "Body")
        adapter.activate()
        monitor = RobotMonitor(pair.client)

        def limits_are_known() -> bool:
            monitor.update()
            return bool(monitor.facts().limits)

        eventually(limits_are_known)
        assert monitor.described == (nao() if is_drawn else None)
        assert monitor.undescribed == (
            "" if is_drawn else "This robot's server does not describe its body, so that it cannot be drawn."
        )


@pytest.mark.sim
def test_the_page_shows_the_world_of_a_simulation_and_moves_things_in_it() -> None:
    from naoserver_sim.robot import SimulatedRobot
    from naoserver_sim.world import load_world

    async def go(opened: Page) -> None:
        async def change(action: str, **arguments: object) -> None:
            await opened.service.set_scene(action, arguments)

        stream = opened.service.poses("en")
        await anext(stream)
        frames = (json.loads(frame) async for frame in stream)
        async for frame in frames:
            if "world" in frame and {shape["object"] for shape in frame["world"]} >= {"Ball", "CubeBlue"}:
                break
        assert {shape["kind"] for shape in frame["world"]} == {"plane", "box", "sphere"}
        states = (frame async for frame in frames if "torso" in frame)  # others say what is heard
        async for frame in states:
            if frame["joints"] and frame["torso"] is not None:
                break
        assert frame["torso"][:2] == pytest.approx([0.0, 0.0], abs=0.05)
        assert math.hypot(*frame["torso"][3:]) == pytest.approx(1.0, abs=1e-3)

        await change("placeObject", name="Ball", position=Vector3(0.5, -1.0, 0.05))
        async for frame in states:
            if frame["objects"]["Ball"][:2] == pytest.approx([0.5, -1.0], abs=0.01):
                break
        with pytest.raises(VisualHfsmError, match="no room"):
            await change("placeObject", name="Ball", position=Vector3(1.5, 1.2, 0.1))

        await change("sayToRobot", text="hello")
        with pytest.raises(VisualHfsmError, match="there is nothing to hear"):
            await change("sayToRobot", text=" ")

        push = {"force": Vector3(90.0, 0.0, 0.0), "seconds": 0.3}
        await opened.service.emergency_stop()
        with pytest.raises(VisualHfsmError, match="STOP was pressed"):
            await change("pushRobot", **push)
        await opened.service.reset_robot()
        await change("pushRobot", **push)
        async for frame in states:
            if frame["torso"][2] < 0.2:
                break
        await stream.aclose()

    with served(SimulatedRobot(skin=False, world=load_world("room"))) as robot:
        on_page(robot, go)


def recorded_names(opened: Page) -> list[object]:
    """Return the names of the files that the page sees being written."""
    running = opened.pushes.of(Present)[-1].components
    return [each["recording"] for each in running if "recording" in each]


def topics(file: Path) -> set[str]:
    """Return the topics of a recording that is being written, as far as it is."""
    return {message.topic for message in RecordingFile(file).messages()}


def test_a_followed_component_is_recorded_with_its_robot_and_pictures(
    robot: ServedRobot, running: Walker, tmp_path: Path
) -> None:
    file = tmp_path / "walker.mcap"

    async def go(opened: Page) -> None:
        with pytest.raises(VisualHfsmError, match="not followed"):
            await opened.service.record("walker", file, "", 0)
        await opened.attach()
        first = await opened.snapshot(lambda value: value.robot.joints)
        await opened.service.record("walker", file, walker(), 10)
        with pytest.raises(VisualHfsmError, match="recorded already"):
            await opened.service.record("walker", file, "", 0)
        await opened.pushes.until(lambda: recorded_names(opened) == ["walker.mcap"] or None)
        while not {"/images/Camera", "/images/CameraBottom"} <= topics(file):
            await asyncio.sleep(0.05)
        await opened.do("sendEvent", name="ball_lost", data="")
        moved = await opened.snapshot(lambda value: value.component.automata[0].state == 2)
        await opened.snapshot(lambda value: value.component.time > moved.component.time + 0.3)
        await opened.service.end_record("walker")
        await opened.pushes.until(lambda: not recorded_names(opened) or None)
        with pytest.raises(VisualHfsmError, match="exists, and is not overwritten"):
            await opened.service.record("walker", file, "", 0)

        found = await opened.service.recording(file)
        assert (found["document"], found["shortened"]) == (walker(), "")
        assert found["structure"] is not None
        assert {automaton.name for automaton in found["structure"].structure.automata} == {"walker", "walk"}
        name, timeline = found["component"], found["timeline"]
        assert first.component.time - 0.2 <= timeline.start < timeline.end
        (change,) = timeline.changes
        assert change[1:] == (1, 1, 2, 1)
        past = await opened.service.moment(name, moved.component.time)
        then = msgspec.convert(past, LiveSnapshot)
        assert then.component.automata[0].variables == moved.component.automata[0].variables
        assert then.robot.joints == pytest.approx(moved.robot.joints, abs=0.5)
        assert found["cameras"] == ["Camera", "CameraBottom"]
        picture = await opened.service.picture(name, "Camera", then.at + 0.3)
        assert picture is not None
        with Image.open(io.BytesIO(picture)) as image:
            assert (image.format, image.size) == ("JPEG", (320, 240))

    on_page(robot, go)


def test_what_fails_when_a_recording_begins_and_until_it_is_healed_is_in_it(
    robot: ServedRobot, running: Walker, tmp_path: Path
) -> None:
    file, faults = tmp_path / "walker.mcap", robot.robot.faults
    assert faults is not None

    async def go(opened: Page) -> None:
        await opened.attach()
        faults.inject("LKneePitch", "stuck")
        began = await opened.snapshot(lambda value: value.robot.failing)
        await opened.service.record("walker", file, "", 0)
        faults.heal()
        healed = await opened.snapshot(lambda value: not value.robot.failing)
        await opened.service.end_record("walker")
        (live,) = (await opened.service.follow("walker"))["timeline"].failures
        (kept,) = (await opened.service.recording(file))["timeline"].failures
        assert live.faults == kept.faults == (Fault("LKneePitch", "stuck"),)
        assert live.start <= began.component.time <= kept.start <= kept.end
        assert kept.end == live.end <= healed.component.time

    on_page(robot, go)


def test_a_run_has_pictures_of_all_cameras_from_its_beginning_though_no_window_shows_them(
    robot: ServedRobot, running: Walker
) -> None:
    async def go(opened: Page) -> None:
        await opened.attach()
        for camera in ("Camera", "CameraBottom"):
            live = await opened.snapshot()
            while (jpeg := await opened.service.picture("walker", camera, live.at)) is None:
                live = await opened.snapshot()
            with Image.open(io.BytesIO(jpeg)) as image:
                assert image.size == (320, 240)

    on_page(robot, go)


def test_a_recording_ends_with_the_run(robot: ServedRobot, component: Component, tmp_path: Path) -> None:
    file = tmp_path / "walker.mcap"

    def is_complete() -> bool:
        recorded = RecordingFile(file)
        assert sum(1 for _ in recorded.messages()) >= 0
        return not recorded.truncated

    async def go(opened: Page) -> None:
        with start(robot, component):
            await opened.attach()
            await opened.service.record("walker", file, "", 0)  # waits until it knows the component
            await opened.pushes.until(lambda: recorded_names(opened) or None)
        await opened.pushes.until(lambda: not opened.pushes.of(Present)[-1].components or None)
        await opened.pushes.until(lambda: is_complete() or None)

    on_page(robot, go)


def test_who_follows_while_another_window_lets_go_follows(
    robot: ServedRobot, running: Walker, tmp_path: Path
) -> None:
    async def go(opened: Page) -> None:
        await opened.attach()
        await opened.snapshot()
        await opened.service.record("walker", tmp_path / "run.mcap", "", 0)
        await asyncio.gather(opened.service.unfollow("walker"), opened.service.follow("walker"))
        await opened.service.moment("walker", math.inf)
        await opened.snapshot()

    on_page(robot, go)


def test_who_followed_last_follows_and_every_recording_ends_whatever_is_asked_meanwhile(
    robot: ServedRobot, running: Walker, tmp_path: Path
) -> None:
    async def ask(opened: Page, chance: random.Random, folder: Path) -> None:
        follows = True
        folder.mkdir()
        await opened.attach()
        await opened.snapshot()

        async def attach() -> None:
            nonlocal follows
            follows = True
            await opened.service.follow("walker")

        async def detach() -> None:
            nonlocal follows
            follows = False
            await opened.service.unfollow("walker")

        def record(number: int) -> Callable[[], Awaitable[object]]:
            return partial(opened.service.record, "walker", folder / f"{number}.mcap", "", 0)

        end, show = (
            partial(opened.service.end_record, "walker"),
            partial(opened.service.moment, "walker", math.inf),
        )
        await interleave(
            chance, [attach, detach, record(1), show, end, attach, record(2), detach, show, attach, record(3)]
        )
        if follows:
            await opened.snapshot()
            await opened.service.moment("walker", math.inf)
        else:
            with pytest.raises(VisualHfsmError, match="not followed"):
                await opened.service.moment("walker", math.inf)

    async def go(seeds: range, opened: Page) -> None:
        for seed in seeds:
            await ask(opened, random.Random(seed), tmp_path / f"{seed}")

    for first in range(0, repeated(10, soak=1000), 10):
        on_page(robot, partial(go, range(first, first + 10)))
    for file in tmp_path.glob("*/*.mcap"):
        assert not str(open_recording(file).shortened)
