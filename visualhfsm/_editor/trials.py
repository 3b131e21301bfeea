"""Requests about the trials and the tests of a document.

Everything raises VisualHfsmError.
"""

from __future__ import annotations

import asyncio

from visualhfsm._processes.test_from_run import run_as_test
from visualhfsm.trials._messages import Choices

from . import protocol as p
from .window import Window
from .workspace import Workspace


async def look(workspace: Workspace, _: Window, request: p.LookAtTrials) -> None:
    """Read the plan and the outcomes that are there."""
    tab = workspace.tabs.get(request.tab)
    source = tab.source
    if await workspace.services.trials.look(source):
        tab.trials.of = source.document


async def run(workspace: Workspace, _: Window, request: p.RunTrials) -> None:
    """Begin to run the trials that are missing."""
    tab = workspace.tabs.get(request.tab)
    source = tab.source
    choices = Choices(runs=request.runs, state=request.state, robot=request.robot, limit=request.limit)
    await workspace.services.trials.run(source, choices, again=request.again)
    tab.trials.of = source.document


async def stop(workspace: Workspace, _: Window, request: p.StopTrials) -> None:
    """End the trials."""
    await workspace.services.trials.stop(request.tab)


async def record(workspace: Workspace, _: Window, request: p.RecordTrial) -> None:
    """Begin to run a trial again, recorded."""
    workspace.tabs.get(request.tab)
    folder = await workspace.runs.recordings()
    await workspace.services.trials.record(request.tab, request.number, folder, workspace.project.root.name)


async def look_at_tests(workspace: Workspace, _: Window, request: p.LookAtTests) -> None:
    """Find the tests."""
    await workspace.services.tests.look(workspace.tabs.get(request.tab).source)


async def run_tests(workspace: Workspace, _: Window, request: p.RunTests) -> None:
    """Begin to run the tests of the document as it was saved."""
    tab = workspace.tabs.get(request.tab)
    source = tab.source
    await workspace.services.tests.run(source, request.names)
    tab.tests.of = source.document


async def save_test(workspace: Workspace, _: Window, request: p.SaveTest) -> dict[str, object]:
    """Write a test of what a component, or that of a recording, did."""
    source = workspace.tabs.get(request.tab).source
    past = await workspace.services.live.past(request.component)
    test = await asyncio.to_thread(
        run_as_test,
        source.document,
        past.timeline,
        "fake" if source.document.interfaces else None,
        past.parameters,
        past.interventions,
    )
    name = await workspace.services.tests.add(source, test.text)
    return {"name": name, "complete": not test.left_out}


async def stop_tests(workspace: Workspace, _: Window, request: p.StopTests) -> None:
    """End the tests."""
    await workspace.services.tests.stop(request.tab)
