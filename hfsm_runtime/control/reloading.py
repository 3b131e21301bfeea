"""Replace a running component by what its file holds now, without stopping it.

Whatever may fail or take long comes first: the file is loaded, its automata are made and its new proxies
connected. Only then the old ones are exchanged for them, between two cycles.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass

from zenoh_ice.exceptions import ZenohIceError

from ..component import Component, parameters_of
from ..errors import ComponentError, ReloadRefusedError
from ..runtime import Runtime
from .carrying import take_attributes
from .loading import forget, load_again
from .replacement import Replacement, first_values_of

__all__ = ["Reloaded", "Reloading"]


@dataclass(frozen=True, slots=True)
class Reloaded:
    """What became of a component that was reloaded.

    `held` are the wall seconds in which no cycle could begin; `not_kept` says what the new version could not
    keep, for people.
    """

    generation: int
    held: float
    not_kept: tuple[str, ...]


class Reloading:
    """Reload one component, as often as asked; make it before the component starts.

    `connect` connects the proxies of a component that are not connected yet.
    """

    def __init__(self, runtime: Runtime, connect: Callable[[Component], None]) -> None:
        self._runtime = runtime
        self._connect = connect
        self._busy = threading.Lock()
        self._first = first_values_of(runtime.tree.runs)

    def reload(self) -> Reloaded:
        """Go on in what the component's file holds now, with all states, timers and variables it still has.

        Raises ReloadRefusedError; the component then runs on as it was.
        """
        if not self._busy.acquire(blocking=False):
            raise ReloadRefusedError("another reload is under way")
        try:
            return self._reload()
        finally:
            self._busy.release()

    def _reload(self) -> Reloaded:
        runtime = self._runtime
        if runtime.tree.root.entered is None or runtime.ended.is_set():
            raise ReloadRefusedError("the component does not run")
        former, loaded = type(runtime.component), load_again(runtime.component)
        try:
            replacement = self._make(loaded)
            name = replacement.runs[0].automaton.name
            if name != runtime.name:
                raise ReloadRefusedError(f"the file is that of {name} now, not of {runtime.name}")
            held = runtime.replace(replacement, self._first)
        except ReloadRefusedError:
            forget(loaded)
            raise
        forget(former)
        self._first = replacement.first
        with runtime.tree.lock:  # as for those who set breakpoints
            dropped = runtime.breakpoints.renew(runtime.tree, parameters_of(replacement.component))
        return Reloaded(runtime.generation, held, (*replacement.not_kept, *dropped))

    def _make(self, loaded: type[Component]) -> Replacement:
        former = self._runtime.component
        try:
            component = loaded()
            told = take_attributes(former, component)
            self._connect(component)
            return Replacement(component, tuple(told))
        except (ComponentError, ZenohIceError) as error:
            raise ReloadRefusedError(str(error)) from error
        except (Exception, SystemExit) as error:  # a document may define what makes its component
            raise ReloadRefusedError(
                f"the component cannot be made: {type(error).__name__}: {error}"
            ) from error
