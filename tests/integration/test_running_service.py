"""Run documents from the editor: real components, generated and started as child processes."""

from __future__ import annotations

import asyncio
import random
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

import psutil
import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document
from codegen.hfsm.code.names import component_name
from tests.support.documents import document, state, sub, transition
from tests.support.interleaving import interleave
from tests.support.limits import CALL_LIMIT, SHORT_RUN
from tests.support.processes import children, free_endpoint
from tests.support.pushes import Pushes
from tests.support.soak import repeated
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._document.commands.text import SetText
from visualhfsm._document.places import Place
from visualhfsm._monitor.messages import Output, OutputLine, Source, StartedPush
from visualhfsm._processes.components import StartedComponents
from zenoh_ice import Settings


@pytest.fixture(autouse=True)
def wall_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let components not look for a robot whose clock they could follow."""
    monkeypatch.setenv("VISUALHFSM_CLOCK", "wall")


def text(code: str, head: str = "") -> str:
    return document(
        sub(1, 0, state(1, "go", code, initial=True), state(2, "end"), transition(1, 1, 2, "False"), period="20"),
        head=head,
    )  # fmt: skip


class ReceivedPushes(Pushes):
    """What the service published."""

    @property
    def lines(self) -> list[OutputLine]:
        return [line for push in self.of(Output) for line in push.lines]

    @property
    def changes(self) -> list[StartedPush]:
        return self.of(StartedPush)

    async def line(self, wanted: str) -> OutputLine:
        return await self.until(lambda: next((each for each in self.lines if wanted in each.text), None))

    async def end(self) -> StartedPush:
        return await self.until(lambda: next((c for c in self.changes if c.status == "ended"), None))


@asynccontextmanager
async def running(pushes: ReceivedPushes) -> AsyncIterator[StartedComponents]:
    service = StartedComponents(
        pushes, Settings(realm="test-run", connect=(free_endpoint(),), timeout=CALL_LIMIT)
    )
    try:
        yield service
    finally:
        await service.close()


def source(path: Path, content: str, *, dirty: bool = False, saved: bool = True) -> Source:
    path.write_text(content, encoding="utf-8")
    found = read_document(path, Diagnostics())
    assert found is not None
    if not saved:
        path.unlink()
    return Source(1, 1, found, path if saved else None, dirty)


def edited(before: Source, code: str) -> Source:
    changed = SetText(place=Place(kind="state", automaton=1, id=1, part="code"), text=code).apply(
        before.document
    )
    return Source(before.tab, before.revision + 1, changed, before.path, True)


def test_a_saved_document_runs_beside_its_file_and_running_again_stops_the_former_process(
    tmp_path: Path,
) -> None:
    async def go() -> None:
        pushes = ReceivedPushes()
        async with running(pushes) as service:
            document = source(tmp_path / "walk.xml", text("import os; print('pid', os.getpid())"))
            await service.start(document, [])
            first = (await pushes.line("pid")).text
            assert (tmp_path / "walk.py").is_file()
            await service.start(document, [])
            await pushes.until(
                lambda: [line for line in pushes.lines if "pid" in line.text and line.text != first]
            )
            statuses = [change.status for change in pushes.changes]
            assert statuses.count("ended") == 1
            again = statuses.index("ended") + 1
            assert again < len(statuses) - 2
            await service.stop(1)
            end = await pushes.until(
                lambda: next((each for each in pushes.changes[again:] if each.status == "ended"), None)
            )
        assert (end.exit_code, end.message) == (130, "it was stopped")
        statuses = [change.status for change in pushes.changes[again:]]
        assert statuses == ["generating", "starting", "started", "stopping", "ended"]

    asyncio.run(go())


def test_an_unsaved_document_runs_aside_under_its_title_and_leaves_nothing(tmp_path: Path) -> None:
    async def go() -> str:
        pushes = ReceivedPushes()
        async with running(pushes) as service:
            shown = source(tmp_path / "new.xml", text("print('at', __file__)"), saved=False)
            await service.start(replace(shown, title="untitled 2"), [])
            return (await pushes.line("at /")).text.removeprefix("at ")

    component = Path(asyncio.run(go()))
    assert component.name == "untitled_2.py"
    assert not component.parent.exists()
    assert not list(tmp_path.iterdir())


def test_what_runs_aside_is_generated_again_there_and_closing_its_tab_leaves_neither_process_nor_file(
    tmp_path: Path,
) -> None:
    async def go() -> None:
        pushes = ReceivedPushes()
        async with running(pushes) as service:
            code = text("import os; print('at', __file__); print('pid', os.getpid())")
            document = replace(source(tmp_path / "new.xml", code, saved=False), title="walk_2")
            await service.start(document, [])
            component = Path((await pushes.line("at /")).text.removeprefix("at "))
            assert component.name == "walk_2.py"
            await service.generate(replace(edited(document, "print('edited')"), title="walk_2"))
            assert "print('edited')" in component.read_text()

            process = psutil.Process(int((await pushes.line("pid")).text.removeprefix("pid ")))
            await service.forget(1)
            assert not process.is_running()
            assert not component.parent.exists()
            await service.forget(1)
        assert not list(tmp_path.iterdir())

    asyncio.run(go())


def test_nothing_runs_for_a_tab_that_is_closed_whatever_is_asked_meanwhile(tmp_path: Path) -> None:
    walk = source(tmp_path / "walk.xml", text("pass"))

    async def go(seed: int) -> None:
        chance = random.Random(seed)
        async with running(ReceivedPushes()) as service:
            runs = partial(service.start, walk, [])
            await interleave(
                chance,
                [
                    runs,
                    partial(service.stop, 1),
                    partial(service.generate, walk),
                    runs,
                    partial(service.forget, 1),
                    runs,
                ],
            )
            assert not children(str(tmp_path / "walk.py"))
            with pytest.raises(VisualHfsmError, match="the document was closed"):
                await service.start(walk, [])
        assert not children(str(tmp_path / "walk.py"))

    for seed in range(repeated(12, soak=1000)):
        asyncio.run(go(seed))


@pytest.mark.parametrize(
    ("file", "name"),
    [
        ("follow me", "follow_me"),
        ("follow-ball", "follow_ball"),
        ("2dance", "component_2dance"),
        ("baile_español", "baile_espanol"),
        ("球", "component"),
    ],
)
def test_a_component_is_announced_under_a_name_of_letters_digits_and_underscores(
    file: str, name: str
) -> None:
    assert component_name(file) == name


def test_a_component_is_announced_under_the_name_that_it_serves(tmp_path: Path) -> None:
    async def go() -> None:
        pushes = ReceivedPushes()
        async with running(pushes) as service:
            shown = source(tmp_path / "2 baile-español.xml", text("print('I am', self.automaton().name)"))
            assert await service.start(shown, []) == "component_2_baile_espanol"
            await pushes.line("I am component_2_baile_espanol")
        assert {push.component for push in pushes.changes} == {"component_2_baile_espanol"}

    asyncio.run(go())


def test_a_second_component_of_a_name_is_refused_in_words(tmp_path: Path) -> None:
    async def go() -> None:
        pushes = ReceivedPushes()
        async with running(pushes) as service:
            first = source(tmp_path / "walk.xml", text("print('walking')"))
            await service.start(first, [])
            await pushes.line("walking")
            (tmp_path / "other").mkdir()
            second = replace(source(tmp_path / "other" / "walk.xml", text("pass")), tab=2)
            with pytest.raises(VisualHfsmError, match="another document runs as walk: stop it first"):
                await service.start(second, [])
            await service.stop_all()
            assert (await pushes.end()).tab == 1
            await service.start(second, [])

    asyncio.run(go())


def test_an_error_of_the_code_is_led_back_to_the_document(tmp_path: Path) -> None:
    async def go() -> None:
        pushes = ReceivedPushes()
        async with running(pushes) as service:
            await service.start(source(tmp_path / "walk.xml", text("\nx = 1\nx / 0\n")), [])
            end = await pushes.end()
            found = await pushes.until(lambda: [line for line in pushes.lines if line.place is not None])
        assert end.exit_code == 1
        assert {(line.place, line.line) for line in found} == {
            (Place(kind="state", part="code", automaton=1, id=1), 3)
        }
        assert any(line.text.startswith("  File ") for line in found)

    asyncio.run(go())


def test_arguments_and_parameters_reach_the_component(tmp_path: Path) -> None:
    head = (
        "<parameters><parameter><name>speed</name><type>float</type><default>0.3</default></parameter>"
        "</parameters>"
    )

    async def go() -> None:
        pushes = ReceivedPushes()
        async with running(pushes) as service:
            document = source(tmp_path / "walk.xml", text("print('speed', self.speed)", head))
            await service.start(document, ["--speed", "0.75", "--seconds", str(SHORT_RUN)])
            assert (await pushes.end()).exit_code == 0
            assert (await pushes.line("speed")).text == "speed 0.75"

    asyncio.run(go())


def test_a_document_with_errors_is_refused_and_says_why(tmp_path: Path) -> None:
    async def go() -> None:
        pushes = ReceivedPushes()
        async with running(pushes) as service:
            with pytest.raises(VisualHfsmError, match="not valid Python"):
                await service.start(source(tmp_path / "walk.xml", text("x = = 1")), [])
            assert pushes.changes[-1].status == "ended"
            assert not (tmp_path / "walk.py").exists()

    asyncio.run(go())


def test_what_runs_goes_on_when_the_next_one_cannot_be_generated(tmp_path: Path) -> None:
    async def go() -> None:
        pushes = ReceivedPushes()
        async with running(pushes) as service:
            saved = source(tmp_path / "walk.xml", text("print('on')"))
            await service.start(saved, [])
            await pushes.line("on")
            with pytest.raises(VisualHfsmError, match="not valid Python"):
                await service.start(edited(saved, "x = = 1"), [])
            component = tmp_path / "walk.py"
            changed = component.read_text().replace("print('on')", "print('by hand')")
            component.write_text(changed)
            for again in (service.start(saved, []), service.generate(saved)):
                with pytest.raises(
                    VisualHfsmError, match=r"walk\.py was changed since it was generated here"
                ):
                    await again
            assert component.read_text() == changed
            assert [each.status for each in pushes.changes] == ["generating", "starting", "started"]
            component.unlink()
            await service.start(saved, [])
            assert "print('on')" in component.read_text()

    asyncio.run(go())


def test_generating_writes_beside_the_document_and_needs_a_file(tmp_path: Path) -> None:
    async def go() -> None:
        async with running(ReceivedPushes()) as service:
            saved = source(tmp_path / "walk.xml", text("print('old')"))
            written = await service.generate(edited(saved, "print('edited')"))
            assert written == tmp_path / "walk.py"
            assert "print('edited')" in (tmp_path / "walk.py").read_text()
            with pytest.raises(VisualHfsmError, match="save the document first"):
                await service.generate(Source(2, 1, saved.document, None, True))

    asyncio.run(go())


def test_changes_that_are_not_saved_run_aside_and_saving_leaves_them_there_until_the_next_run(
    tmp_path: Path,
) -> None:
    async def go() -> None:
        pushes = ReceivedPushes()
        beside = tmp_path / "walk.py"
        (tmp_path / "walk_ext.py").write_text("class WalkExtension:\n    greeting = 'from the extension'\n")
        async with running(pushes) as service:
            saved = source(tmp_path / "walk.xml", text("print('at', __file__)"))
            await service.start(
                edited(saved, "print('new', self.greeting); print('edited at', __file__)"), []
            )
            await pushes.line("new from the extension")
            component = Path((await pushes.line("edited at /")).text.removeprefix("edited at "))
            assert not beside.exists()
            await service.generate(saved)
            assert not beside.exists()
            assert "print('at', __file__)" in component.read_text()
            await service.start(saved, [])
            assert (await pushes.line(f"at {beside}")).stream == "out"
            assert not component.exists()

    asyncio.run(go())


def test_a_report_of_a_component_that_runs_elsewhere_is_located_in_its_document(tmp_path: Path) -> None:
    async def scenario() -> None:
        async with running(ReceivedPushes()) as service:
            known = source(tmp_path / "walk.xml", text("x = 1\nx / 0"))
            assert known.path is not None
            lines = known.path.read_text().split("\n")
            line = next(number for number, content in enumerate(lines, 1) if "x / 0" in content)
            found = await service.locate(known, f"walk.py:57 (walk.xml:{line})")
            assert found is not None
            assert (found.place, found.line) == (Place(kind="state", automaton=1, id=1, part="code"), 2)
            assert await service.locate(known, "walk.py:57 (other.xml:3)") is None
            assert await service.locate(replace(known, path=None), "walk.py:57 (walk.xml:3)") is None

    asyncio.run(scenario())


def test_a_start_goes_on_when_the_window_that_asked_for_it_goes_away(tmp_path: Path) -> None:
    async def go() -> None:
        pushes = ReceivedPushes()
        async with running(pushes) as service:
            window = asyncio.create_task(
                service.start(source(tmp_path / "walk.xml", text("print('walking')")), [])
            )
            await pushes.until(lambda: pushes.changes)
            window.cancel()
            await asyncio.wait({window})
            assert window.cancelled()
            await pushes.line("walking")
            await service.stop(1)
            assert (await pushes.end()).message == "it was stopped"

    asyncio.run(go())
