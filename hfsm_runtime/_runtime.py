"""A component that runs on threads: started, watched, steered and stopped here."""

from __future__ import annotations

import time
from collections.abc import Callable
from types import FrameType

from zenoh_ice.clock import Clock

from ._automaton import Automaton
from ._component_run import ComponentRun
from ._limits import LIMITS, RuntimeLimits
from ._supervision import Refusal
from ._threads import Threads
from ._timeline import Timeline
from .component import Component
from .errors import ComponentStoppedError, OnError, OnRefused
from .tree import Replaced, Run, Tree


class Runtime(ComponentRun):
    """A component whose automata run on threads, by its clock."""

    def __init__(
        self,
        component: Component,
        clock: Clock,
        on_error: OnError | None = None,
        servers_present: Callable[[], bool] = lambda: True,
        *,
        on_refused: OnRefused | None = None,
        timeline: Timeline | None = None,
        tree: Callable[[Automaton], Tree] = Tree,
        limits: RuntimeLimits = LIMITS,
    ) -> None:
        self._asked: Refusal | None = None
        self._ask_at = 0.0
        super().__init__(
            component,
            clock,
            on_error,
            on_refused,
            servers_present=servers_present,
            timeline=timeline,
            tree=tree,
            limits=limits,
        )
        self._threads = Threads(self.tree, self.component_time, self._supervision, self._crashed, limits)

    def start(self) -> None:
        """Start the automata."""
        self._threads.start()

    def stop(self) -> None:
        """End the automata: running cycles end, or are logged as errors after 2 s."""
        self.request_stop()
        for run in self._threads.stop(self._limits.stop):
            self._abandon(run, self._limits.stop)

    def retry(self, commands_accepted: Callable[[str], bool]) -> None:
        """Resume after a refused command if commands are accepted again; call it often.

        `commands_accepted` is called with the reported holder of the robot: at once, to see why commands are
        refused, and then at most once a second. If commands are refused again, the component pauses again.
        """
        refusal = self.refusal
        if refusal is None:
            return
        first = self._asked is not refusal
        if not first and time.monotonic() < self._ask_at:
            return
        self._asked, self._ask_at = refusal, time.monotonic() + self._limits.retry
        if commands_accepted(refusal.holder) and not first:
            self.resume(refusal)

    def replace(self, component: Component, runs: tuple[Run, ...], apply: Callable[[int], Replaced]) -> float:
        """Replace the component with another version of it, see `ComponentRun`.

        Raises ReloadRefusedError also when there are no threads for new automata.
        """
        leaving = joining = tuple(run for run in runs if self.tree.run(run.automaton.id) is None)

        def apply_it(now: int) -> Replaced:
            nonlocal leaving
            replaced = apply(now)
            leaving = replaced.gone
            return replaced

        try:
            self._threads.add(joining)
            return super().replace(component, runs, apply_it)
        finally:
            self._threads.remove(leaving)
            self._wake()

    def _step(self, runs: tuple[Run, ...]) -> None:
        self._threads.step(runs)

    def _frame(self, run: Run) -> FrameType | None:
        return self._threads.frame(run)

    def _wake(self) -> None:
        self._threads.wake()

    def _sleep(self, seconds: float) -> None:
        if not self._threads.sleep(self.clock, seconds, self.ended):
            self.clock.wait(self.ended, max(0.0, seconds))
        if self.ended.is_set():
            raise ComponentStoppedError
