"""Reach the component that a command steers."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final

from interfaces.hfsm import (
    ComponentSnapshot,
    ComponentStructure,
    HfsmMonitorPrx,
    InvalidValue,
    NoSuchElement,
    ReloadRefused,
)
from visualhfsm.errors import VisualHfsmError
from visualhfsm.steer.addresses import Addresses, did_you_mean
from visualhfsm.watch.automata import Automata, printable
from visualhfsm.watch.discovery import MONITOR_PREFIX, components
from zenoh_ice import Communicator, ObjectNotExistException, Settings, initialize

__all__ = ["Target", "steered"]

_SETTLING: Final = 1.0
"""Seconds in which other components become known, to name one that was meant."""
_PERIOD: Final = 0.05


@dataclass(frozen=True, slots=True)
class Target:
    """A running component."""

    name: str
    monitor: HfsmMonitorPrx
    structure: ComponentStructure

    @property
    def addresses(self) -> Addresses:
        """What its automata, states and transitions are called."""
        return Addresses(self.structure)

    def states(self, snapshot: ComponentSnapshot) -> str:
        """Return the path of current states, such as `followBall > green > follow`."""
        return " > ".join(Automata(self.structure).current_path(snapshot))


@contextmanager
def steered(settings: Settings, name: str) -> Iterator[Target]:
    """Connect to a component for the time of a `with` block, and tell in one line what it refuses.

    Raises VisualHfsmError, and ConnectFailedException when there is no server at all.
    """
    with initialize(settings) as communicator:
        identity = f"{MONITOR_PREFIX}{name}"
        try:
            monitor = HfsmMonitorPrx.checkedCast(communicator.stringToProxy(identity))
        except ObjectNotExistException as error:
            raise VisualHfsmError(_absent(communicator, name)) from error
        try:
            yield Target(name, monitor, monitor.getStructure())
        except (NoSuchElement, InvalidValue) as error:
            raise VisualHfsmError(printable(error.what)) from error
        except ReloadRefused as error:
            raise VisualHfsmError(
                f"not reloaded, {name} runs on as it was: {printable(error.reason)}"
            ) from error


def _absent(communicator: Communicator, name: str) -> str:
    deadline = time.monotonic() + _SETTLING
    while not (found := components(communicator)) and time.monotonic() < deadline:
        time.sleep(_PERIOD)
    hint = did_you_mean(name, found) if found else f"; start it, such as: python {printable(name)}.py"
    return f"no component {printable(name)} runs in realm {communicator.realm}{hint}"
