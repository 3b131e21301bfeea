"""Requests that generate, run, follow and steer components, make robots, and start and end one.

Everything raises VisualHfsmError.
"""

from __future__ import annotations

from functools import partial
from typing import Any, Final

from visualhfsm._editor.own_robots import OwnRobot
from visualhfsm._monitor.messages import Simulation
from visualhfsm._processes.bodies import find_bodies
from visualhfsm.project._titles import stem

from . import protocol as p
from .questions import imported_by
from .window import Window
from .workspace import Workspace

READING_LIMIT: Final = 150.0
"""Longest time in s to read a model: by two processes, and perhaps after others."""


async def generate(workspace: Workspace, _: Window, request: p.Generate) -> object:
    """Generate the component of a document."""
    return await workspace.runs.generate(workspace.tabs.get(request.tab))


async def run(workspace: Workspace, _: Window, request: p.Run) -> dict[str, Any]:
    """Generate and start the component of a document."""
    tab = workspace.tabs.get(request.tab)
    dry_run = request.body if request.dry_run else None
    if dry_run is None:
        await workspace.runs.require_accepted(tab, request.beside)
    return await workspace.runs.run(tab, request.arguments, record=request.record, dry_run=dry_run)


async def stop_run(workspace: Workspace, window: Window, request: p.StopRun) -> None:
    """Stop the process of a component."""
    await workspace.services.running.stop(request.tab, window.kind)


async def attach(workspace: Workspace, window: Window, request: p.Attach) -> object:
    """Follow a running component."""
    return await workspace.runs.follow(window, request.component)


async def detach(workspace: Workspace, window: Window, request: p.Detach) -> None:
    """Stop following a component."""
    await workspace.runs.unfollow(window, request.component)


async def control(workspace: Workspace, window: Window, request: p.Control) -> object:
    """Steer a running component, or stop everything."""
    if request.action == p.EMERGENCY_STOP:
        return await workspace.runs.emergency_stop(window.kind)
    return await workspace.runs.control(request.component, request.action, request.arguments)


async def record(workspace: Workspace, _: Window, request: p.Record) -> dict[str, str] | None:
    """Record a followed component, or end that."""
    return await workspace.runs.record(request.component, request.pictures)


async def export_run(workspace: Workspace, _: Window, request: p.ExportRun) -> dict[str, str]:
    """Return the page of a run with the document of a tab, if there is one, and a name for the file."""
    tab = workspace.tabs.get(request.tab) if request.tab else None
    document = None if tab is None else tab.shown.document
    content = [] if tab is None else await imported_by(workspace, tab)
    text = await workspace.services.live.exported(request.component, document, content)
    return {"name": f"{stem(request.component.rpartition(':')[2])}.html", "text": text}


async def simulate(workspace: Workspace, _: Window, request: p.Simulate) -> None:
    """Start a simulated robot."""
    simulation = Simulation(world=request.world, speed=request.speed, balls=request.balls, body=request.body)
    await workspace.services.robots.simulate(simulation)


async def guess_robot(workspace: Workspace, _: Window, request: p.GuessRobot) -> OwnRobot:
    """Take a model for what it seems to be."""
    return await workspace.own_robots.guess(request.path)


async def check_robot(workspace: Workspace, _: Window, request: p.CheckRobot) -> OwnRobot:
    """Read the text of a robot's file."""
    return await workspace.own_robots.look(request.name, request.text)


async def save_robot(workspace: Workspace, _: Window, request: p.SaveRobot) -> dict[str, Any]:
    """Write the file of a robot."""
    save = partial(workspace.own_robots.save, request.name, request.text, overwrite=request.overwrite)
    path = await workspace.threads.do(save)
    bodies = await workspace.threads.do(partial(find_bodies, workspace.project.root.directory))
    return {"path": path, "bodies": bodies}


async def connect_robot(workspace: Workspace, _: Window, request: p.ConnectRobot) -> None:
    """Connect to a real robot."""
    workspace.runs.require_rest()
    await workspace.services.robots.connect(request.address, request.start)


async def move_balls(workspace: Workspace, _: Window, request: p.MoveBalls) -> None:
    """Move the balls of the simulation, or leave them where they are."""
    await workspace.services.robots.move_balls(moving=request.moving)


async def end_robot(workspace: Workspace, _: Window, _request: p.EndRobot) -> None:
    """End the robot that was started here."""
    await workspace.services.robots.end()
