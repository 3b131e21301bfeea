"""The state that all windows share: what each window gets, and that everything ends with it."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import pytest

from tests.support.coroutines import Loop
from tests.support.documents import document, state, sub
from tests.support.editor import NoPart, parts
from tests.support.limits import FOREVER
from tests.support.sent import sent
from visualhfsm import AddState, OpenDocument, Project
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._editor import documents
from visualhfsm._editor import protocol as p
from visualhfsm._editor.limits import Limits
from visualhfsm._editor.parts import Parts
from visualhfsm._editor.views import ViewPush
from visualhfsm._editor.window import Window
from visualhfsm._editor.workspace import Workspace
from visualhfsm._monitor.messages import OutputLine, RecentLines, Robot

LIMITS: Final = Limits(quiet_seconds=FOREVER, file_check_seconds=0.01)
QUIET: Final = Limits(quiet_seconds=FOREVER, file_check_seconds=FOREVER)
WALK: Final = document(sub(1, 0, state(1, "walk", initial=True)))


class Closing(NoPart):
    """A part that says when it is closed, and fails then."""

    def __init__(self) -> None:
        self.closed = 0

    async def close(self) -> None:
        self.closed += 1
        raise VisualHfsmError.because("the robot does not crouch")


class Broken(Project):
    """A project whose processes cannot be ended, or whose shelf cannot be read."""

    def __init__(self, folder: Path, *, shelf: bool = True) -> None:
        super().__init__(folder, journals=folder / "journals")
        self._readable = shelf

    def shelf(self) -> Any:
        if not self._readable:
            raise VisualHfsmError.because("the shelf is on fire")
        return super().shelf()

    def end_processes(self) -> None:
        super().end_processes()
        raise OSError("stuck in the kernel")


@asynccontextmanager
async def running(
    folder: Path,
    *,
    limits: Limits = QUIET,
    project: Project | None = None,
    made: Parts | None = None,
    **options: Any,
) -> AsyncIterator[Workspace]:
    opened = project or Project(folder, journals=folder / "journals")
    async with Workspace(limits, lambda _: made or parts(), lambda _: opened, **options) as workspace:
        yield workspace


@pytest.fixture
def limits() -> Limits:
    return QUIET


@pytest.fixture
def workspace(tmp_path: Path, limits: Limits, loop: Loop) -> Workspace:
    return loop.enter(running(tmp_path, limits=limits))


def opened(workspace: Workspace) -> Window:
    window = Window(partial(RecentLines, 5, 100))
    workspace.greet(window, "en")
    return window


def kinds(messages: list[dict[str, Any]]) -> list[str]:
    return [message["push"] for message in messages]


async def until(condition: Callable[[], object]) -> None:
    while not condition():
        await asyncio.sleep(0.005)


class TestWindows:
    async def test_a_window_that_comes_gets_everything_and_a_tab_before_its_document(
        self, workspace: Workspace
    ) -> None:
        tab = workspace.show(workspace.project.open_text("walk", WALK))
        tab.output.add([OutputLine(text="one step", stream="out")], 0)
        pushes = await sent(opened(workspace))
        assert kinds(pushes)[:4] == ["workspace", "shelf", "robot", "document"]
        assert [each["title"] for each in pushes[0]["tabs"]] == ["walk"]
        (output,) = (each for each in pushes if each["push"] == "output")
        assert ([line["text"] for line in output["lines"]], output["whole"]) == (["one step"], True)

    async def test_every_window_gets_what_changes(self, workspace: Workspace) -> None:
        windows = [opened(workspace), opened(workspace)]
        for window in windows:
            await sent(window)
        tab = workspace.show(workspace.project.open_text("walk", WALK))
        await tab.edit(lambda document: document.apply(AddState(automaton=1, x=0, y=0)))
        for window in windows:
            found = kinds(await sent(window))
            assert found[0] == "workspace"
            assert "document" in found

    async def test_a_state_that_is_as_it_was_is_sent_to_nobody(self, workspace: Workspace) -> None:
        window = opened(workspace)
        workspace.publish_state()
        await sent(window)
        workspace.publish_state()
        assert await sent(window) == []

    async def test_a_window_that_has_left_gets_nothing(self, workspace: Workspace) -> None:
        window = opened(workspace)
        await sent(window)
        await workspace.leave(window)
        workspace.show(workspace.project.open_text("walk", WALK))
        assert await sent(window) == []


class TestDocuments:
    async def test_one_has_one_tab(self, workspace: Workspace) -> None:
        walk = workspace.project.open_text("walk", WALK)
        tab = workspace.show(walk)
        assert workspace.show(walk) is tab
        assert workspace.show(workspace.project.open_text("run", WALK)) is not tab
        assert len(workspace.tabs) == 2

    async def test_a_tab_that_is_removed_is_closed_in_every_window(self, workspace: Workspace) -> None:
        tab = workspace.show(workspace.project.open_text("walk", WALK))
        window = opened(workspace)
        await sent(window)
        workspace.remove(tab)
        pushes = await sent(window)
        assert {"push": "closed", "tab": tab.id} in pushes
        assert [each["tabs"] for each in pushes if each["push"] == "workspace"] == [[]]

    async def test_those_with_unsaved_changes_are_named(self, tmp_path: Path, workspace: Workspace) -> None:
        (tmp_path / "saved.xml").write_text(WALK)
        workspace.show(workspace.project.open("saved.xml"))
        assert workspace.unsaved() == []
        tab = workspace.show(workspace.project.open_text("walk", WALK))
        await tab.edit(lambda document: document.apply(AddState(automaton=1, x=0, y=0)))
        assert workspace.unsaved() == ["walk"]

    async def test_unsaved_changes_are_offered_when_it_is_opened_again(
        self, tmp_path: Path, loop: Loop
    ) -> None:
        async with running(tmp_path) as workspace:
            tab = workspace.show(workspace.project.open_text("walk", WALK))
            await tab.edit(lambda document: document.apply(AddState(automaton=1, x=0, y=0)))
        async with running(tmp_path) as workspace:
            (state,) = [each for each in await sent(opened(workspace)) if each["push"] == "workspace"]
            assert [each["name"] for each in state["recoverable"]] == ["walk"]


class TestFiles:
    @pytest.mark.parametrize("limits", [LIMITS])
    async def test_a_file_that_another_program_changes_is_read(
        self, tmp_path: Path, workspace: Workspace
    ) -> None:
        file = tmp_path / "walk.xml"
        file.write_text(WALK)
        tab = workspace.show(workspace.project.open("walk.xml"))
        file.write_text(WALK.replace("walk", "strut"))
        await until(lambda: tab.shown.document.automata[0].states[0].name == "strut")

    @pytest.mark.parametrize("limits", [LIMITS])
    async def test_what_comes_to_the_shelf_is_sent(self, tmp_path: Path, workspace: Workspace) -> None:
        window = opened(workspace)
        await sent(window)
        (tmp_path / "shelf").mkdir()
        (tmp_path / "shelf" / "strut.xml").write_text(WALK)
        found: list[dict[str, Any]] = []
        while not found:
            found = [each for each in await sent(window) if each["push"] == "shelf"]
            await asyncio.sleep(0.005)
        assert "own/strut.xml" in [each["id"] for each in found[-1]["states"]]

    @pytest.mark.parametrize("limits", [LIMITS])
    async def test_one_that_cannot_be_watched_keeps_no_other_from_it(
        self,
        workspace: Workspace,
        tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch,
        caplog: pytest.LogCaptureFixture,
    ) -> None:
        for name in ("bad", "good"):
            (tmp_path / f"{name}.xml").write_text(WALK)
        bad, good = (workspace.show(workspace.project.open(f"{each}.xml")) for each in ("bad", "good"))
        refresh = OpenDocument.refresh

        def fail(document: OpenDocument) -> None:
            if document is bad.document:
                raise OSError("the disk is gone")
            refresh(document)

        monkeypatch.setattr(OpenDocument, "refresh", fail)
        (tmp_path / "good.xml").write_text(WALK.replace("walk", "strut"))
        await until(lambda: good.shown.document.automata[0].states[0].name == "strut")
        assert "the files of bad cannot be watched" in caplog.text


class TestBeginning:
    async def test_the_demo_is_for_the_first_window_where_nothing_is_there_yet(
        self, tmp_path: Path, loop: Loop
    ) -> None:
        async with running(tmp_path, demo=True) as workspace:
            assert [workspace.begin_demo(), workspace.begin_demo()] == [True, False]
        async with running(tmp_path, demo=True) as workspace:
            workspace.show(workspace.project.open_text("walk", WALK))
            assert not workspace.begin_demo()
        async with running(tmp_path, demo=True) as workspace:
            workspace.news.robot = Robot(status="present")
            assert not workspace.begin_demo()

    async def test_a_recording_is_shown_by_the_first_window_alone(self, workspace: Workspace) -> None:
        workspace.offer_recording("run.mcap")
        assert [workspace.begin_recording(), workspace.begin_recording()] == ["run.mcap", ""]

    async def test_what_cannot_begin_closes_its_parts(self, tmp_path: Path, loop: Loop) -> None:
        followers = Closing()
        with pytest.raises(VisualHfsmError, match="the shelf is on fire"):
            async with running(
                tmp_path, made=parts(followers=followers), project=Broken(tmp_path, shelf=False)
            ):
                raise AssertionError("it has begun")
        assert followers.closed == 1


class TestEnd:
    async def test_what_does_not_close_keeps_nothing_else_open(
        self, tmp_path: Path, loop: Loop, caplog: pytest.LogCaptureFixture
    ) -> None:
        caplog.set_level(logging.ERROR)
        started, robot, followers = Closing(), Closing(), Closing()
        made = parts(started=started, robot=robot, followers=followers)
        async with running(tmp_path, made=made, project=Broken(tmp_path)) as workspace:
            workspace.show(workspace.project.open_text("walk", WALK))
        assert (started.closed, robot.closed, followers.closed) == (1, 1, 1)
        assert caplog.text.count("Closing did not close") == 3
        assert "the robot does not crouch" in caplog.text

    async def test_an_error_of_who_uses_it_closes_it_too(self, tmp_path: Path, loop: Loop) -> None:
        followers = Closing()
        with pytest.raises(VisualHfsmError, match="no such file"):
            async with running(tmp_path, made=parts(followers=followers)):
                raise VisualHfsmError.because("no such file")
        assert followers.closed == 1


class Work:
    """What a view does for documents: it says what is to end."""

    def __init__(self) -> None:
        self.ended: list[object] = []

    async def forget(self, tab: int) -> None:
        self.ended.append(tab)

    async def close(self) -> None:
        self.ended.append("all")


class TestViews:
    async def test_what_a_view_says_is_outdated_by_another_version_and_reaches_later_windows(
        self, workspace: Workspace
    ) -> None:
        tab = workspace.show(workspace.project.open_text("walk", WALK))
        window = opened(workspace)
        await sent(window)
        tab.of_views["chess"].of = tab.shown.document
        workspace.news.publish(ViewPush(name="chess", tab=tab.id))
        workspace.news.publish(ViewPush(name="chess", tab=tab.id + 1))  # which is closed
        await asyncio.sleep(0)
        (push,) = await sent(window)
        assert push == {"push": "view", "name": "chess", "tab": tab.id, "outdated": False}
        await tab.edit(lambda document: document.apply(AddState(automaton=1, x=0, y=0)))
        for each in (window, opened(workspace)):
            (push,) = (each for each in await sent(each) if each["push"] == "view")
            assert push["outdated"]

    async def test_what_a_view_does_ends_with_the_document_and_with_the_editor(
        self, tmp_path: Path, loop: Loop
    ) -> None:
        work = Work()
        made = replace(parts(), views={"chess": work})
        async with running(tmp_path, made=made) as workspace:
            tab = workspace.show(workspace.project.open_text("walk", WALK))
            assert not work.ended
            await documents.close(workspace, opened(workspace), p.Close(id=1, tab=tab.id, discard=True))
            assert work.ended == [tab.id]
        assert work.ended == [tab.id, "all"]
