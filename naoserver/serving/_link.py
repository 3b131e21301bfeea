"""The failures of a robot's server and of the link to it."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from typing import Final

from naoserver.bodies.faults import LINK, SERVER
from naoserver.protocol.faults import Faults
from zenoh_ice import Clock
from zenoh_ice.routes.failing import SOUND, FailingLink, LinkState

_LOOK: Final = 0.05
"""Seconds between two looks whether what fails has ended."""
_HEALING: Final = frozenset({"Faults"})
"""What a failing link leaves alone, so that it can be healed; a server that hangs answers nothing."""


class LinkFailures:
    """Let what passes between servants and clients fail as is injected. Implements Job.

    `clock` is that of the limits of calls, whatever the robot's: by it messages are late. `wake` is called
    when it is due earlier.
    """

    name: Final = "link"
    thread: Final = "reports"

    def __init__(
        self, faults: Faults, identities: Collection[str], clock: Clock, wake: Callable[[], object]
    ) -> None:
        self.clock: Final = clock
        self.impair: Callable[[FailingLink | None, Collection[str]], object] = lambda _link, _whose: None
        """Lets calls and samples of some servants pass a link, or pass freely; who serves them sets it."""
        self._faults: Final = faults
        self._identities: Final = identities
        self._link: Final = FailingLink(clock, faults.seed, wake)
        self._wake: Final = wake
        self._look_at = math.inf
        faults.watchers.append(self.look)

    @property
    def loses_calls(self) -> bool:
        """Whether a call may have no answer because of the link."""
        return self._link.state._replace(hung=False) != SOUND

    def due(self, now: float) -> float:
        """Return when a message arrives, or an end is to be looked for; infinity while nothing fails."""
        return min(self._link.due, self._look_at)

    def run(self) -> None:
        """Let messages arrive."""
        self.look()
        self._link.deliver()

    def look(self) -> None:
        """Fail as is injected now."""
        present = self._faults.current()
        link = {kind: fault.amount for (part, kind), fault in present.items() if part == LINK}
        state = LinkState(
            late=link.get("late", 0.0),
            lossy=link.get("lossy", 0.0),
            deaf="deaf" in link,
            mute="mute" in link,
            hung=(SERVER, "hung") in present,
        )
        self._look_at = math.inf if state == SOUND else self.clock.now() + _LOOK
        if state == self._link.state:
            return
        if state == SOUND:
            self.impair(None, ())
        else:
            self.impair(self._link, {*self._identities} - (set() if state.hung else _HEALING))
        self._link.become(state)
        self._wake()
