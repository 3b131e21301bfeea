"""Find the components that run."""

from __future__ import annotations

import time
from typing import Final

from visualhfsm.errors import VisualHfsmError
from visualhfsm.watch.automata import printable
from zenoh_ice import Communicator

__all__ = ["MONITOR_PREFIX", "components", "find_component"]

MONITOR_PREFIX: Final = "Hfsm."
"""Begins the identity of every component's monitor."""
_PERIOD: Final = 0.05
_SETTLING: Final = 0.3
"""Seconds in which others become known once there is one: each process is met on a link of its own."""


def find_component(communicator: Communicator, wait: float) -> str:
    """Return the name of the component that runs in the realm, waiting at most `wait` s for one.

    Raises VisualHfsmError when there is none or more than one.
    """
    deadline = time.monotonic() + wait
    while not (found := components(communicator)):
        if time.monotonic() >= deadline:
            endpoints = ", ".join(communicator.settings.connect)
            raise VisualHfsmError(
                f"no component runs in realm {communicator.realm} at {endpoints}; start one, such as: "
                "python -m behaviors.follow_ball; naoserver-sim starts the robot for it"
            )
        time.sleep(_PERIOD)
    time.sleep(_SETTLING)
    found = components(communicator) or found
    if len(found) > 1:
        raise VisualHfsmError(f"several components run; name one of {', '.join(found)}")
    return found[0]


def components(communicator: Communicator) -> list[str]:
    """Return the names of the components that are known to run in the realm."""
    identities = communicator.identities()
    names = (name.removeprefix(MONITOR_PREFIX) for name in identities if name.startswith(MONITOR_PREFIX))
    return [printable(name) for name in names]
