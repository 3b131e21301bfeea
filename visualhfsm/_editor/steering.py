"""Requests that run and steer components and tests, and make and connect robots.

Everything raises VisualHfsmError.
"""

from __future__ import annotations

from functools import partial
from typing import Any

from visualhfsm._processes.bodies import find_bodies
from visualhfsm.project._version import stem

from . import answers as a
from . import protocol as p
from .questions import imported_by
from .window import Window
from .workspace import Workspace


async def start(workspace: Workspace, window: Window, request: p.Start) -> a.StartedRun:
    """Generate and start the component of a document."""
    tab = workspace.tabs.get(request.tab)
    dry_run = request.body if request.dry_run else None
    if dry_run is None:
        await workspace.components.require_accepted(tab, request.beside)
    return await workspace.components.start(
        window, tab, request.arguments, record=request.record, dry_run=dry_run
    )


async def steer(workspace: Workspace, _: Window, request: p.Steering) -> object:
    """Call an operation of a component's monitor, which has the name of the request."""
    operation, arguments = _operation(request)
    return await workspace.components.steer(arguments.pop("component"), operation, arguments)


async def set_scene(workspace: Workspace, _: Window, request: p.SceneRequest) -> object:
    """Call an operation of the world of a simulation, which has the name of the request."""
    return await workspace.parts.followers.set_scene(*_operation(request))


async def set_faults(workspace: Workspace, _: Window, request: p.FaultRequest) -> None:
    """Call an operation of the failures of a robot, which has the name of the request."""
    await workspace.parts.followers.set_faults(*_operation(request))


def _operation(request: p.Request) -> tuple[str, dict[str, Any]]:
    """Return the name of a request and its fields."""
    arguments = {name: getattr(request, name) for name in request.__struct_fields__ if name != "id"}
    return str(request.__struct_config__.tag), arguments


async def export_run(workspace: Workspace, _: Window, request: p.ExportRun) -> a.Download:
    """Return the page of a run with the document of a tab, if there is one, and a name for the file."""
    tab = workspace.tabs.get(request.tab) if request.tab else None
    document = None if tab is None else tab.shown.document
    content = [] if tab is None else await imported_by(workspace, tab)
    text = await workspace.parts.followers.exported(request.component, document, content)
    return {"name": f"{stem(request.component.rpartition(':')[2])}.html", "text": text}


async def save_robot(workspace: Workspace, _: Window, request: p.SaveRobot) -> a.SavedRobot:
    """Write the file of a robot."""
    save = partial(workspace.own_robots.save, request.name, request.text, overwrite=request.overwrite)
    path = await workspace.threads.do(save)
    bodies = await workspace.threads.do(partial(find_bodies, workspace.project.root.directory))
    return {"path": path, "bodies": bodies}


async def connect_robot(workspace: Workspace, _: Window, request: p.ConnectRobot) -> None:
    """Connect to a real robot."""
    workspace.components.require_rest()
    await workspace.parts.robot.connect(request.address, request.start, workspace.components.require_rest)


async def start_tests(workspace: Workspace, _: Window, request: p.StartTests) -> None:
    """Begin to run the tests of the document as it was saved."""
    tab = workspace.tabs.get(request.tab)
    source = tab.source
    await workspace.parts.tests.start(source, request.names)
    tab.tests.of = source.document
