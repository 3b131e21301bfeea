"""Run the components of the editor's tabs."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

from codegen.hfsm import component_path
from visualhfsm.errors import VisualHfsmError
from visualhfsm.services import Publish, ServiceError, Source, complete
from zenoh_ice import Settings

from .origins import read_origins
from .run import Run

__all__ = ["RunningComponents"]

_CLOSE_PATIENCE = (3.0, 2.0)


class RunningComponents:
    """At most one child process for each tab. All methods raise ServiceError.

    What was begun is done to its end, also when the window that asked for it goes
    away meanwhile.
    """

    def __init__(self, publish: Publish, settings: Settings | None = None) -> None:
        self._publish = publish
        self._environment = settings.environment() if settings else {}
        self._runs: dict[int, Run] = {}

    async def generate(self, source: Source) -> object:
        """Write the component beside its document, or where the tab's component runs; return its path."""
        if source.path is None and source.tab not in self._runs:
            raise ServiceError("save the document first: its component is written beside it")
        try:
            generated = await complete(self._run_of(source.tab).generate(source))
        except VisualHfsmError as error:
            raise ServiceError(str(error)) from error
        return {"path": str(generated.component)}

    async def run(self, source: Source, arguments: Sequence[str]) -> object:
        """Generate and start; the tab's former process is stopped first."""
        try:
            await complete(self._run_of(source.tab).start(source, arguments))
        except VisualHfsmError as error:
            raise ServiceError(str(error)) from error
        return None

    async def stop(self, tab: int) -> object:
        """Stop the tab's process, if one runs."""
        run = self._runs.get(tab)
        if run is not None:
            await complete(run.stop())
        return None

    async def forget(self, tab: int) -> None:
        """Stop the process of a tab that is closed, and delete what was generated for it aside."""
        run = self._runs.pop(tab, None)
        if run is not None:
            await complete(run.close())

    async def locate(self, source: Source, text: str, automaton: int = 0, state: int = 0) -> object:
        """Return the place and the line of the code of which a line of a log or of a report speaks, or None.

        A report has the `automaton` and the `state`, which distinguish pieces that share a line.
        It may be that of a component that runs elsewhere, of the file that the document has.
        """
        run = self._runs.get(source.tab)
        origins = run.origins if run is not None else None
        if origins is None and source.path is not None:
            path = source.path
            origins = await asyncio.to_thread(read_origins, path, component_path(path, None))
        found = None if origins is None else origins.find(text, automaton=automaton, state=state)
        return None if found is None else {"place": found.place, "line": found.line}

    async def close(self) -> None:
        """Stop everything that runs."""
        runs, self._runs = list(self._runs.values()), {}
        await asyncio.gather(*(run.close(_CLOSE_PATIENCE) for run in runs))

    def _run_of(self, tab: int) -> Run:
        return self._runs.setdefault(tab, Run(tab, self._publish, self._environment))
