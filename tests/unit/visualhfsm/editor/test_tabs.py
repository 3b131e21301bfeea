"""Tabs by their numbers, documents, files and components."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from visualhfsm import EditError, MissingError, OpenDocument, Project
from visualhfsm._editor.tab import Tab, Threads
from visualhfsm._editor.tabs import Tabs
from visualhfsm._monitor.messages import RecentLines, StartedPush


def test_a_tab_is_found_by_what_is_known_of_it(tmp_path: Path) -> None:
    async def go() -> None:
        threads = Threads(1)
        tabs = Tabs()

        def shown(document: OpenDocument, recording: Path | None = None) -> Tab:
            tab = Tab(
                tabs.next_number(),
                document,
                threads,
                changed=lambda _: None,
                output=RecentLines(1, 100),
                recording=recording,
            )
            tabs.add(tab)
            return tab

        with Project(tmp_path, journals=tmp_path / "journals") as project:
            first, second = shown(project.new()), shown(project.new(), tmp_path / "run.mcap")
            assert [tab.id for tab in tabs] == [1, 2]
            assert tabs.get(2) is tabs.of_document(second.document) is second
            assert tabs.editable(1) is first
            with pytest.raises(EditError, match="cannot be changed: a recording contains it"):
                tabs.editable(2)
            file = first.document.save("ball.xml")
            await threads.do(lambda: None)
            assert tabs.of_file(file) is first
            assert tabs.of_file(tmp_path / "no.xml") is None
            second.started = StartedPush(tab=2, component="ball", status="started")
            assert tabs.of_component("ball") is second
            tabs.remove(first)
            assert (len(tabs), 1 in tabs) == (1, False)
            with pytest.raises(MissingError, match="tab 1 is not open"):
                tabs.get(1)
        await threads.close()

    asyncio.run(go())
