"""How long the parts of a node wait."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, kw_only=True)
class NodeLimits:
    """The limits of a node that no user sets."""

    first_link: float = 5.0
    """s after which it is worth a warning that there is no link: on a busy machine links take long."""
    announcement: float = 1.0
    """s in which a node announces all its ends: another subscription of it may hear what one does not."""
    query_delay: float = 2.0
    """s after which tokens are asked for again when there were too many; each time twice as long."""
    longest_query_delay: float = 30.0
    """s that this takes at most."""


LIMITS: Final = NodeLimits()
"""Those of every node that gets no others."""
