"""A process that is started ahead of the component that it will be."""

from __future__ import annotations

import asyncio
import json
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress

from hfsm_runtime import waiting
from zenoh_ice.application.child import ChildProcess


class StartedAhead:
    """At most one process that has imported what components import, and waits to be one, once.

    `environment` returns that of components, without those variables that only one has. Used on the
    event loop; `close` ends it.
    """

    def __init__(self, environment: Callable[[], Mapping[str, str]], delay: float) -> None:
        self._environment = environment
        self._delay = delay
        self._begun_with: Mapping[str, str] = {}
        self._written: list[tuple[int, bytes]] = []
        self._process = ChildProcess(lambda *output: self._written.append(output))
        self._preparing: asyncio.Task[None] | None = None
        self._closing = asyncio.Event()

    def prepare(self) -> None:
        """Start one in `delay` s, unless one waits: not at once, where a component starts or a page opens."""
        if self._preparing is None or self._preparing.done():
            self._preparing = asyncio.create_task(self._prepare())

    async def start(
        self, fresh: ChildProcess, runner: Sequence[str], command: Sequence[str], own: Mapping[str, str]
    ) -> ChildProcess:
        """Start a component: its file with its arguments, and its own variables. Return its process.

        That is the one that waits, if its environment is still right, or `fresh`, and always this one if
        something else is the `runner` of the file. Raises OSError as `fresh` does.
        """
        environment, message = self._environment(), json.dumps([command, own]).encode()
        if not runner:
            self.prepare()  # for the next one
        if not runner and self._begun_with == environment and self._process.give(message, in_place_of=fresh):
            begun, self._process = self._process, ChildProcess(lambda *output: self._written.append(output))
            for each in self._written:
                fresh.receive(*each)
            return begun
        line = [sys.executable, *runner, *command]
        await fresh.start(line, {**environment, **own}, at_once=not runner)
        return fresh

    async def close(self) -> None:
        """End the process, for good."""
        self._closing.set()
        if self._preparing is not None:
            await asyncio.wait({self._preparing})
        await self._process.stop((0.0, 0.0))  # it has nothing to clean up

    async def _prepare(self) -> None:
        with suppress(TimeoutError):
            await asyncio.wait_for(self._closing.wait(), self._delay)
        environment = self._environment()
        if self._closing.is_set() or (self._process.is_running and self._begun_with == environment):
            return
        await self._process.stop((0.0, 0.0))
        self._written, self._begun_with = [], environment
        command = [sys.executable, waiting.__file__]
        await self._process.start(command, environment, at_once=True, waits=True)
