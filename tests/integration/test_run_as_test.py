"""What somebody did to a run is in its test: a real component on the fake robot, and pytest as the editor runs it."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document
from interfaces.hfsm import NoSuchElement
from naoserver.fake import FakeRobot
from tests.support.component import MonitorStub
from tests.support.documents import document, state, sub, transition
from tests.support.limits import CALL_LIMIT, RUN_LIMIT
from tests.support.pushes import Pushes
from tests.support.robot_server import served
from tests.support.soak import SOAKS
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._editor.parts import Parts, make_parts
from visualhfsm._monitor.messages import Present, Snapshot, Source, StartedPush
from visualhfsm._monitor.realm.run_log import LiveSnapshot
from visualhfsm._monitor.recordings import open_recording
from visualhfsm._processes.test_from_run import run_as_test
from visualhfsm._processes.test_results import TestsPush, TestView
from zenoh_ice import Current, Settings

GIVE_UP = transition(4, 1, 2, "False", name="give up")
TEXT = document(
    sub(
        1,
        0,
        state(1, "look", "self.head.setSpeed(0.1, 0.0)", initial=True),
        state(2, "lost"),
        state(3, "found"),
        GIVE_UP,
        transition(5, 2, 3, "x == ['it', \"it's\"] and self.bold"),
        variables="x = []",
        period="20",
    ),
    config=(
        "<iceinterface><nameinterface>head</nameinterface><nameproxy>Head</nameproxy>"
        "<interface>PoseHead</interface></iceinterface>"
    ),
    head="<parameters><parameter><name>bold</name><type>bool</type><default>False</default></parameter></parameters>",
)
AT_ITS_START = ["--breakpoint", "1.1"]
"""The options of a component whose time stands still until it is followed."""


@dataclass
class Editor:
    """The parts of an editor, and what they published."""

    parts: Parts
    pushes: Pushes
    path: Path

    @property
    def source(self) -> Source:
        found = read_document(self.path, Diagnostics())
        assert found is not None
        return Source(1, 1, found, self.path, False)

    async def do(self, action: str, **arguments: object) -> None:
        await self.parts.followers.steer("waits", action, arguments)

    async def until(self, matches: Callable[[LiveSnapshot], object]) -> None:
        def find() -> object:
            newest = next(reversed(self.pushes.of(Snapshot)), None)
            return newest is not None and isinstance(newest.value, LiveSnapshot) and matches(newest.value)

        await self.pushes.until(lambda: find() or None)

    async def run(self, by_component: Path, by_editor: Path) -> None:
        """Run the document, and do to it what makes it reach its last state; both record it into files."""
        await self.parts.started.start(self.source, [*AT_ITS_START, "--record", str(by_component)])
        await self.pushes.until(lambda: any(push.components for push in self.pushes.of(Present)) or None)
        await self.parts.followers.follow("waits")
        await self.until(lambda live: live.component.stoppedAt)
        await self.parts.followers.record("waits", by_editor, TEXT, 0)
        await self.do("resume")
        await self.until(lambda live: live.component.time > 0.2)
        await self.do("forceTransition", automaton=1, transition=4)
        await self.until(lambda live: live.component.automata[0].state == 2)
        await self.do("setVariable", automaton=1, name="x", value='["it", "it\'s"]')
        with pytest.raises(VisualHfsmError, match="uses no variable 'y'"):
            await self.do("setVariable", automaton=1, name="y", value="1")
        await self.do("setVariable", automaton=0, name="bold", value="true")
        await self.until(lambda live: live.component.automata[0].state == 3)

    async def results(self, *names: str) -> list[TestView]:
        """Run tests as the page does, and return how they went."""
        seen = len(self.pushes.of(TestsPush))
        await self.parts.tests.start(self.source, names)
        end = await self.pushes.until(
            lambda: next((p for p in self.pushes.of(TestsPush)[seen:] if p.status == "idle"), None)
        )
        assert not end.error
        found = {f"{each.file}::{each.name}": each for each in end.tests}
        return [found[name] for name in names]


def edit(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    go: Callable[[Editor], Awaitable[None]],
    monitor: MonitorStub | None = None,
) -> None:
    """Open an editor beside a fake robot, and beside a component if its monitor is given."""
    monkeypatch.setenv("VISUALHFSM_CLOCK", "wall")
    path = tmp_path / "waits.xml"
    path.write_text(TEXT, encoding="utf-8")

    async def work(settings: Settings) -> None:
        pushes = Pushes()
        parts = make_parts(settings, folder=tmp_path)(pushes)
        try:
            async with asyncio.timeout(RUN_LIMIT):
                await go(Editor(parts, pushes, path))
        finally:
            await parts.tests.close()
            await parts.started.close()
            await parts.followers.close()

    with served(FakeRobot()) as robot, robot.client() as client:
        if monitor is not None:
            adapter = client.communicator.createObjectAdapter("Test")
            adapter.add(monitor, "Hfsm.waits")
            adapter.activate()
        asyncio.run(
            work(Settings(realm=robot.realm, connect=(robot.endpoint,), clock="wall", timeout=CALL_LIMIT))
        )


def test_a_run_that_was_forced_and_set_passes_as_a_test_and_fails_without_the_transition(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whether the page saw the run, the component recorded it, or the editor."""

    async def go(editor: Editor) -> None:
        by_component, by_editor = tmp_path / "component.mcap", tmp_path / "editor.mcap"
        await editor.run(by_component, by_editor)
        past = await editor.parts.followers.past("waits")
        tests = {
            "seen": run_as_test(
                editor.source.document, past.timeline, "fake", past.parameters, past.interventions
            )
        }
        await editor.do("stop")
        await editor.pushes.until(
            lambda: next((p for p in editor.pushes.of(StartedPush) if p.status == "ended"), None)
        )
        await editor.parts.followers.end_record("waits")
        for file in by_component, by_editor:
            run = open_recording(file)
            assert run.interventions is not None
            # What was refused is not among what was done.
            assert [each.name for each in run.interventions.kept] == ["", "x", "bold"], file.name
            tests[file.stem] = run_as_test(
                editor.source.document, run.log.timeline(), "fake", run.parameters, run.interventions
            )
        for name, test in tests.items():
            assert not test.left_out, name
            assert test.options == ', robot="fake"', name  # the parameter had its default at first
            done = [line for line in test.lines if line.startswith(("b.force", "b.set"))]
            assert done == ["b.force(1, 4)", 'b.set(1, x=["it", "it\'s"])', "b.set(0, bold=True)"], name
        names = [await editor.parts.tests.add(editor.source, test.text) for test in tests.values()]
        passed = await editor.results(*names)
        assert [each.outcome for each in passed] == ["passed"] * 3, passed
        if SOAKS:  # `test_a_document_without_the_forced_transition_fails_the_test` needs no further process
            editor.path.write_text(TEXT.replace(GIVE_UP, ""))
            (failed,) = await editor.results(names[0])
            assert failed.outcome == "failed"
            assert "no transition 4 leaves look; there are none" in failed.reason

    edit(tmp_path, monkeypatch, go)


class Deaf(MonitorStub):
    """A monitor that refuses to step, and whose answers to other commands do not arrive."""

    def step(self, automaton: int, current: Current) -> None:
        raise NoSuchElement("there is no automaton 9: there are none")

    def setVariable(self, automaton: int, name: str, value: str, current: Current) -> None:
        raise RuntimeError("it has set it, and then failed")


def test_what_was_refused_is_forgotten_and_what_was_not_answered_is_not_sure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def go(editor: Editor) -> None:
        await editor.pushes.until(lambda: any(push.components for push in editor.pushes.of(Present)) or None)
        await editor.parts.followers.follow("waits")
        for action, arguments in (
            ("step", {"automaton": 9}),
            ("setVariable", {"automaton": 1, "name": "x", "value": "1"}),
        ):
            with pytest.raises(VisualHfsmError):
                await editor.do(action, **arguments)
        await editor.do("forceTransition", automaton=1, transition=4)
        await editor.do("pause")
        await editor.do("reload")
        done = (await editor.parts.followers.past("waits")).interventions
        assert done is not None
        assert [(each.action, each.confirmed) for each in done.kept] == [
            ("setVariable", False),
            ("forceTransition", True),
            ("reload", True),
        ]

    edit(tmp_path, monkeypatch, go, Deaf())
