"""How a proxy calls: whether it waits, for how long, and whom of several that serve one identity."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

__all__ = ["Manner", "Mode", "Replicas"]


class Mode(Enum):
    """Whether a call has an answer; the value is the letter in a proxy's text."""

    TWOWAY = "t"
    """The caller waits for the answer."""
    ONEWAY = "o"
    """There is none: the caller goes on as soon as the call was sent."""
    BATCH_ONEWAY = "O"
    """As oneway, and calls are sent only when the batch is flushed."""


class Replicas(Enum):
    """Which of several servants of one identity a call is for."""

    NEAREST = "nearest"
    """One, which Zenoh chooses: the same as long as it is there."""
    FIRST = "first"
    """All, and the first good answer counts; only for idempotent operations, others go to the nearest."""
    SPREAD = "spread"
    """One after the other, call by call."""


class Manner(NamedTuple):
    """How a proxy calls."""

    timeout: float
    """Limit of a call in s."""
    mode: Mode = Mode.TWOWAY
    replicas: Replicas = Replicas.NEAREST
