"""Recordings on the timeline: a recorded run is shown like a followed one."""

from __future__ import annotations

import asyncio
import io
import random
import re
import threading
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path

import msgspec
import PIL.Image
import pytest

from codegen import messages
from hfsm_runtime._recording.run import RecordedRuntime, recording
from hfsm_runtime.debugger.snapshot import structure_of, take_snapshot
from hfsm_runtime.loading import load_module
from hfsm_runtime.recording_file.messages import (
    Change,
    Description,
    Failing,
    Fault,
    Image,
    Message,
    RobotPose,
    Shape,
    Snapshot,
    Stamp,
    World,
)
from hfsm_runtime.recording_file.writer import Entry, RecordingWriter
from naoserver.bodies import find_body
from naoserver.bodies.description import write_looks
from naoserver.bodies.parts import Axis
from naoserver.body import write_body
from tests.support.component import short_snapshot
from tests.support.documents import compile_to, document, state, sub, transition
from tests.support.limits import CALL_LIMIT, RUN_LIMIT
from tests.support.processes import free_endpoint
from tests.support.pushes import Pushes
from tests.support.soak import repeated
from tests.support.waiting import until
from tests.support.watching import content
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._document.serialization import parse
from visualhfsm._monitor import open_recordings
from visualhfsm._monitor.followers import Followers
from visualhfsm._monitor.open_recordings import OpenRecordings
from visualhfsm._monitor.realm.description import nao
from visualhfsm._monitor.realm.robot import RobotState
from visualhfsm._monitor.realm.run_log import LiveSnapshot, RunLog
from visualhfsm._monitor.recordings import RecordedRun, open_recording
from zenoh_ice import Settings, VirtualClock

DOCUMENT = document(
    sub(
        1, 0, state(1, "walk", "beats += 1\nself.mark('Camera', beats, 7, 'step')", initial=True, child=2), state(2, "stand"),
        transition(1, 1, 2, "200", type="time", name="enough"), transition(2, 2, 1, "beats < 0"),
        variables="beats = 0", period="10",
    ),
    sub(2, 1, state(1, "step", "if beats > 3:\n    raise ValueError('tripped')", initial=True),
        variables="beats = 0", period="10"),
    head="<onerror>continue</onerror>",
)  # fmt: skip

CYCLES = 120
"""Of the root, of 10 ms each."""
START = 1_700_000_000_000_000_000


class HandClock(VirtualClock):
    """A clock that moves only with `advance`, for threads, which look again and again whether it has."""

    def __init__(self) -> None:
        super().__init__()
        self.looks: Counter[str] = Counter()
        """How often each thread has begun to wait, by its name."""

    def wait(self, event: threading.Event, timeout: float) -> bool:
        self.looks[threading.current_thread().name] += 1
        return event.wait(0.001)

    def until_waiting(self, thread: str) -> None:
        """Return when a thread waits for a later time than now, which it may do twice before it sees a new one."""
        seen = self.looks[thread]
        until(lambda: self.looks[thread] >= seen + 2)


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the recording of a run without a missed cycle: it walks for 0.2 s, then stands for 1 s."""
    folder = tmp_path_factory.mktemp("recorded")
    path, clock = folder / "run.mcap", HandClock()
    walker = load_module("recorded_walker", compile_to(folder, DOCUMENT, "walker")).Walker()
    with recording(walker, path) as recorder:
        runtime = RecordedRuntime(walker, clock, recorder)
        recorder.action("structure", **msgspec.to_builtins(structure_of(runtime)))
        root = f"automaton {runtime.actor(1).automaton.name}"
        runtime.start()
        try:
            for cycle in range(1, CYCLES + 1):
                until(partial(lambda number: runtime.actor(1).cycle.count == number, cycle))
                clock.until_waiting(root)  # its cycle is counted before its time is taken
                if cycle % 10 == 0:  # as often as a monitor does
                    recorder.snapshot(take_snapshot(runtime, START / 1e9))
                clock.advance(0.01)
        finally:
            runtime.stop()
    return path


@pytest.fixture(scope="module")
def run(file: Path) -> RecordedRun:
    return open_recording(file)


def at(history: RunLog, time: float) -> LiveSnapshot:
    raw = history.at(time)
    assert raw is not None
    return msgspec.json.decode(raw, type=LiveSnapshot)


def test_the_structure_is_that_of_the_recorded_document(run: RecordedRun) -> None:
    assert run.name == "walker"
    assert run.document == DOCUMENT
    assert [automaton.name for automaton in run.structure.automata] == ["walker", "walk"]
    assert [t.name for t in run.structure.automata[0].transitions] == ["enough", ""]
    assert not str(run.shortened)


def test_changes_are_where_they_happened(run: RecordedRun) -> None:
    (change,) = run.log.timeline().changes
    assert change[0] == 0.2
    assert change[1:] == (1, 1, 2, 1)


def test_each_moment_shows_states_ghosts_timers_and_variables(run: RecordedRun) -> None:
    early = at(run.log, 0.19).component
    root, child = early.automata
    assert (root.state, root.ghost, child.state, child.ghost) == (1, False, 1, False)
    (timer,) = root.timers
    assert timer.transition == 1
    assert timer.remaining == pytest.approx(root.enteredAt + 0.2 - early.time, abs=0.002)
    root, child = at(run.log, 9.0).component.automata
    assert (root.state, root.lastTransition, child.ghost) == (2, 1, True)
    assert root.timers == []
    assert [(guard.transition, guard.value) for guard in root.guards] == [(2, False)]
    assert int(root.variables["beats"]) == 20
    assert root.cycles == CYCLES
    assert root.longestCycle >= root.lastCycle >= 0


def test_marks_are_shown_while_they_are_new(run: RecordedRun) -> None:
    early = at(run.log, 0.19).component
    assert [(mark.camera, mark.v, mark.label) for mark in early.marks] == [("Camera", 7.0, "step")]
    assert early.marks[0].u == float(early.automata[0].variables["beats"])
    assert at(run.log, 9.0).component.marks == []


def test_numbers_can_be_plotted(run: RecordedRun) -> None:
    series = run.log.series(["1.beats"], 0, 10, 100)
    beats = [value for value in series["values"]["1.beats"] if value is not None]
    assert beats == sorted(beats)
    assert beats[-1] > beats[0]


def recorded(path: Path, *entries: tuple[str, Message | Callable[[float], Message]]) -> RecordedRun:
    """Return a run of some messages, 0.2 s apart, or what makes them for a component time."""
    metadata = {"name": "test", "start": str(START), "proxies": '{"Eye": "CameraBottom"}'}
    writer = RecordingWriter(path, metadata, {}, START)
    for number, (topic, message) in enumerate(entries):
        made = message(number / 5) if callable(message) else message
        writer.put(Entry(topic, START + number * 200_000_000, made))
    writer.close()
    return open_recording(path)


def moment(time: float) -> Snapshot:
    return Snapshot.of(short_snapshot(time))


MOMENT = ("/snapshots", moment)


def test_one_of_an_older_version_says_what_it_lacks(tmp_path: Path) -> None:
    change = ("/automata/walk", Change(1, "walk", 1, "go", "entered", 0))
    with pytest.raises(VisualHfsmError, match="has no snapshots of test: an older version made it"):
        recorded(tmp_path / "run.mcap", change, change)


def test_the_robot_and_its_world_are_those_of_the_moment(tmp_path: Path) -> None:
    upright = [0.0, 0.0, 0.0, 1.0]
    ball = Shape("Ball", "sphere", [0.05, 0.0, 0.0], [0.0, 0.0, 0.0, *upright], [1.0, 0.5, 0.0])
    run = recorded(
        tmp_path / "run.mcap",
        MOMENT,
        ("/world", World([ball, Shape("", "teapot", [1.0, 1.0, 1.0], ball.at, ball.color)])),
        (
            "/robot",
            RobotPose({"HeadYaw": 0.1}, [1.0, 0.0, 0.3, *upright], {"Ball": [2.0, 0.0, 0.0, *upright]}),
        ),
        MOMENT,
        ("/robot", RobotPose({"HeadYaw": 0.7}, [9e9, 0.0, 0.3, *upright], {"Ball": [2.0, 0.0]})),
        MOMENT,
    )
    assert [(shape.object, shape.kind) for shape in run.world] == [("Ball", "sphere")]
    assert at(run.log, 0.1).robot == RobotState()
    then = at(run.log, 0.7).robot
    assert (then.joints, then.pan, then.torso) == ({"HeadYaw": 0.1}, 0.1, (1.0, 0.0, 0.3, *upright))
    assert then.objects == {"Ball": (2.0, 0.0, 0.0, *upright)}
    later = at(run.log, 1.1).robot
    assert (later.joints, later.torso, later.objects) == ({"HeadYaw": 0.7}, None, {})


def test_what_the_robot_says_and_plays_is_that_of_the_moment(tmp_path: Path) -> None:
    run = recorded(
        tmp_path / "run.mcap",
        MOMENT,
        ("/robot", RobotPose({}, says="Goal!\n" + "x" * 9000, sound="cheer")),
        MOMENT,
        ("/robot", RobotPose({})),
        MOMENT,
    )
    then, later = at(run.log, 0.5).robot, at(run.log, 0.9).robot
    assert then.says.startswith("Goal! x")
    assert (len(then.says), then.sound) == (2000, "cheer")
    assert (later.says, later.sound) == ("", "")


def test_what_failed_is_that_of_the_moment_and_on_the_timeline(tmp_path: Path) -> None:
    knee, camera = Fault("LKneePitch", "stuck"), Fault("Camera", "late", 0.5)
    run = recorded(
        tmp_path / "run.mcap",
        MOMENT,
        ("/faults", Failing((knee,))),
        MOMENT,
        ("/robot", RobotPose({"HeadYaw": 0.1})),
        MOMENT,
        ("/faults", Failing((knee, camera, Fault("\x1b[2J", "odd")))),
        MOMENT,
        ("/faults", Failing(())),
        MOMENT,
    )
    assert [at(run.log, time).robot.failing for time in (0.1, 0.9, 1.3, 1.7)] == [
        (),
        (knee,),
        (knee, camera),
        (),
    ]
    spans = [(span.faults, span.start, span.end) for span in run.log.timeline().failures]
    assert spans == [((knee,), 0.4, 1.2), ((knee, camera), 1.2, 1.6)]


def test_the_robot_is_the_one_that_was_recorded(tmp_path: Path) -> None:
    body = find_body("T1")
    pan = body.hinges["Neck"][Axis.PAN].joint
    run = recorded(
        tmp_path / "run.mcap",
        ("/description", Description.of(write_body(body), write_looks(body))),
        MOMENT,
        ("/robot", RobotPose({pan: 0.2})),
        MOMENT,
    )
    assert run.described.title == "Booster T1"
    assert run.exported(None).body == run.described.page
    assert at(run.log, 0.9).robot.pan == 0.2


@pytest.mark.parametrize("body", ["", "[]", '{"name": "X", "links": []}'])
def test_a_recording_without_a_sound_description_shows_a_nao(tmp_path: Path, body: str) -> None:
    run = recorded(tmp_path / "run.mcap", MOMENT, ("/description", Description(body, "{}")), MOMENT)
    assert run.described == nao()
    assert recorded(tmp_path / "old.mcap", MOMENT, MOMENT).described == nao()


def test_looks_that_are_too_large_for_a_recording_are_left_out() -> None:
    large = " " * (4 << 20)
    assert Description.of("{}", large) == Description("{}", "")
    assert Description.of("{}", "{}") == Description("{}", "{}")


def test_pictures_are_those_that_the_component_saw(tmp_path: Path) -> None:
    def image(red: int, hash: str, encoding: str = "rgb8") -> tuple[str, Message]:
        pixels = bytes([red, 0, 0]) * 64
        return "/images/Eye", Image(Stamp.of(0), "Eye", 8, 8, encoding, 24, pixels, hash)

    run = recorded(
        tmp_path / "run.mcap",
        MOMENT,
        image(250, "a" * 24),
        image(20, "b" * 24),
        MOMENT,
        image(9, "c" * 24, "mono"),
    )
    pictures, start = run.pictures, START / 1e9
    assert pictures.cameras == ["CameraBottom"]

    def red(seconds: float) -> int | None:
        jpeg = pictures.at("CameraBottom", start + seconds)
        if jpeg is None:
            return None
        with PIL.Image.open(io.BytesIO(jpeg)) as shown:
            pixel = shown.getpixel((4, 4))
        assert isinstance(pixel, tuple)
        return int(pixel[0])

    assert red(0.1) is None
    assert red(0.3) == pytest.approx(250, abs=5)
    assert red(0.5) == pytest.approx(20, abs=5)
    assert red(0.8) is None  # of a format that is not shown
    assert red(60.0) is None  # too old by then
    assert pictures.at("Camera", start + 0.3) is None
    spread = pictures.spread(10)["CameraBottom"]  # without that of a format that is not shown
    assert [at - start for at, _ in spread] == pytest.approx([0.2, 0.4], abs=1e-3)
    assert pictures.spread(1)["CameraBottom"] == spread[:1]


def test_one_that_was_cut_off_is_shown_as_far_as_it_goes(file: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    content = file.read_bytes()
    cut.write_bytes(content[: len(content) * 3 // 4])
    assert open_recording(cut).log.newest is not None


def test_the_page_opens_one_and_asks_for_its_past(file: Path, tmp_path: Path) -> None:
    async def go() -> None:
        service = Followers(
            Pushes(), Settings(realm="test-recording", connect=(free_endpoint(),), timeout=CALL_LIMIT)
        )
        try:
            opened = await service.recording(file)
            name = opened["component"]
            assert opened["document"] == DOCUMENT
            moment = await service.moment(name, 0.1)
            assert msgspec.convert(moment, LiveSnapshot).component.automata[0].state == 1
            explained = await service.explanation(name, 1, 0.15)
            assert explained is not None
            (why,) = explained.transitions
            assert re.fullmatch(r"its time comes after 0\.\d\d s more in the state", why.reason)
            assert await service.explanation(name, 99, 0.15) is None
            timeline = opened["timeline"]
            assert len(timeline.changes) == 1
            page, _ = content(
                await service.exported(name, parse(DOCUMENT, messages.Message("Cannot read")), [])
            )
            assert page["timeline"]["changes"] == [list(change) for change in timeline.changes]
            assert page["document"]["automata"][0]["states"][0]["name"] == "walk"
            with pytest.raises(VisualHfsmError, match="cannot be read"):
                await service.recording(tmp_path / "missing.mcap")
            await service.unfollow(name)
            with pytest.raises(VisualHfsmError, match="not followed"):
                await service.moment(name, 0.1)
            with pytest.raises(VisualHfsmError, match="not followed"):
                await service.exported(name, None, [])
        finally:
            await service.close()

    asyncio.run(asyncio.wait_for(go(), RUN_LIMIT))


def test_many_open_recordings_stay_open_and_those_asked_for_last_in_memory(
    file: Path, tmp_path: Path
) -> None:
    """The fifth window that looked at a recording took it away from the first."""

    async def go() -> None:
        service = Followers(
            Pushes(), Settings(realm="test-recording", connect=(free_endpoint(),), timeout=CALL_LIMIT)
        )
        try:
            opened = [await service.recording(file) for _ in range(7)]
            names = [each["component"] for each in opened]
            past = [each["timeline"].changes for each in opened]
            assert past == [past[0]] * 7
            assert (
                await asyncio.gather(*(service.moment(name, 0.1) for name in names))
                == [await service.moment(names[0], 0.1)] * 7
            )
            file.rename(tmp_path / "away.mcap")
            asked = (service.moment(name, 0.1) for name in names)
            answers = await asyncio.gather(*asked, return_exceptions=True)
            gone = [str(answer) for answer in answers if isinstance(answer, VisualHfsmError)]
            assert ["cannot be read" in each for each in gone] == [True] * 3  # the others are in memory
        finally:
            await service.close()

    asyncio.run(asyncio.wait_for(go(), RUN_LIMIT))


def test_windows_that_open_ask_and_close_at_random_get_their_own_recording(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Whatever comes between looking and acting: an answer is of the recording that is asked for."""
    chance = random.Random()

    async def later(function: Callable[..., object], *arguments: object) -> object:
        for _ in range(chance.randrange(4)):
            await asyncio.sleep(0)
        return function(*arguments)

    async def window(opened: OpenRecordings, number: int) -> None:
        for _ in range(chance.randrange(1, 6)):
            name, run = await opened.open(Path(f"{number}.mcap"))
            for _ in range(chance.randrange(4)):
                other = await opened.get(name)
                assert other is not None
                assert other.name == run.name == f"{number}.mcap"
                await asyncio.sleep(0)
            asking = asyncio.create_task(opened.get(name))
            for _ in range(chance.randrange(3)):
                await asyncio.sleep(0)
            opened.close(name)
            late = await asking
            assert late is None or late.name == run.name
            assert await opened.get(name) is None

    async def go() -> None:
        opened = OpenRecordings()
        monkeypatch.setattr(asyncio, "to_thread", later)
        await asyncio.gather(*(window(opened, number) for number in range(7)))
        assert not list(opened.described())

    def read(path: Path) -> RecordedRun:
        return RecordedRun(path.name, None, None, "", True, (), None, nao())  # type: ignore[arg-type]

    monkeypatch.setattr(open_recordings, "open_recording", read)
    for seed in range(repeated(50, 10_000)):
        chance.seed(seed)
        asyncio.run(asyncio.wait_for(go(), RUN_LIMIT))
