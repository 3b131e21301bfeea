"""What a trial came to, and what computed it."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from typing import Final

import msgspec

from codegen.messages import Message
from codegen.reasons import known_text
from visualhfsm._base.recognition import recognized
from zenoh_ice.data.status import version_of

from ._quantities import Value

_REASONS: Final = (
    Message("fell"),
    Message("judged not good"),
    Message("ended before {state}", state=""),
    Message("not in {state} after {time} s", state="", time=""),
    Message("took more than {time} s", time=""),
    Message("ended its process"),
    Message("its process was killed {times} times, perhaps for want of memory", times=""),
    Message("needs more than {memory} MB of memory", memory=""),
)
"""Why trials fail, as `_trial.py` and `_processes.py` write it into outcomes."""
_PACKAGES: Final = ("visualhfsm", "mujoco", "numpy")
"""The packages that compute the outcome of a trial, besides Python."""


class StateChange(msgspec.Struct, frozen=True, array_like=True):
    """The states of a trial from a time on."""

    time: float
    """In s."""
    states: str
    """The path of current states; those of all branches, separated by commas."""


class Outcome(msgspec.Struct, frozen=True, kw_only=True):
    """What a trial came to: the same each time and everywhere."""

    number: int
    """From 1 on."""
    values: Mapping[str, Value]
    """The values of its quantities."""
    success: bool
    reason: str = ""
    """Why it failed, in words."""
    time: float = 0.0
    """When it ended, in s of the trial."""
    states: str = ""
    """The path of current states at its end."""
    numbers: Mapping[str, float] = {}
    """The numbers that were noted, by name."""
    groups: Mapping[str, str] = {}
    """The groups of this trial, by the name of what trials are distinguished by."""
    changes: tuple[StateChange, ...] = ()
    """Its changes of state."""
    left_out: int = 0
    """Changes that are left out before the newest ones."""
    error: str = ""
    """The error of the behavior's code with its place, and the timeline."""


def failure_said(text: str) -> Message:
    """Return why a trial failed as a message: what trials say, or what the behavior or its robot does."""
    found = known_text(text, _REASONS)
    return recognized(text) if "" in found.values else found


def versions() -> dict[str, str]:
    """Return the versions of what computes the outcome of a trial, in this process."""
    return {
        "python": platform.python_version(),
        **{name: version_of(name, "is missing") for name in _PACKAGES},
    }
