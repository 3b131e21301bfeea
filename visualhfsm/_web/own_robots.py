"""Requests that make a robot of the user's own from a model. Everything raises VisualHfsmError."""

from __future__ import annotations

from functools import partial
from typing import Any, Final

from visualhfsm._bodies import find_bodies
from visualhfsm._own_robots import OwnRobot

from . import protocol as p
from .window import Window
from .workspace import Workspace

LIMIT: Final = 150.0
"""Longest time in s to read a model: in two processes, and perhaps after others."""


async def guess(workspace: Workspace, _: Window, request: p.GuessRobot) -> OwnRobot:
    """Take a model for what it seems to be."""
    return await workspace.own_robots.guess(request.path)


async def check(workspace: Workspace, _: Window, request: p.CheckRobot) -> OwnRobot:
    """Read the text of a robot's file."""
    return await workspace.own_robots.look(request.name, request.text)


async def save(workspace: Workspace, _: Window, request: p.SaveRobot) -> dict[str, Any]:
    """Write the file of a robot."""
    write = partial(workspace.own_robots.save, request.name, request.text, overwrite=request.overwrite)
    path = await workspace.threads.do(write)
    return {
        "path": path,
        "bodies": await workspace.threads.do(partial(find_bodies, workspace.project.root.directory)),
    }
