"""The failures of a robot as they are injected, healed and over."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final

from naoserver.bodies.faults import RESTARTED, SERVER, Fault, FaultKind, Present, kinds_of
from naoserver.body import Body
from naoserver.errors import InvalidCommand
from zenoh_ice import Clock

_LONGEST: Final = 86_400.0
"""Most seconds of a failure that ends by itself."""
_HANG: Final = 5.0
"""Seconds for which a server hangs where none are given."""
_LONGEST_HANG: Final = 600.0
"""Most seconds of it: nobody can heal it meanwhile."""
_QUOTED: Final = 64
_MOST_NAMES: Final = 80
"""Parts that a refusal lists."""


class Faults:
    """Keep the failures of a robot. Thread-safe; they end by the robot's time."""

    def __init__(self, body: Body, clock: Clock, *, physics: bool = False, seed: int = 0) -> None:
        """With `physics` forces matter: it can be held, loaded and weak, too; a link loses by `seed`."""
        self.kinds: Final[Mapping[str, tuple[FaultKind, ...]]] = kinds_of(body, physics=physics)
        """How each part can fail."""
        self.now: Final = clock.now
        """Robot time in s."""
        self.seed: Final = seed
        self.watchers: Final[list[Callable[[], object]]] = []
        """Called when something begins to fail or is healed."""
        self.restart: Callable[[], object] | None = None
        """Starts the server again, where its process is its own."""
        self._lock: Final = threading.Lock()
        self._present: Present = MappingProxyType({})
        self._next_end = math.inf

    def inject(
        self, part: str, kind: str, amount: float | None = None, seconds: float | None = None
    ) -> Fault:
        """Let a part fail from now on, for some robot seconds if they are given. Raises as `check` does."""
        amount = self.check(part, kind, amount, seconds)
        now = self.now()
        if (part, kind) == (SERVER, RESTARTED):
            assert self.restart is not None  # it is checked
            self.restart()
            return Fault(part, kind, amount, now, now)
        if (part, kind) == (SERVER, "hung"):
            seconds = seconds or _HANG
        fault = Fault(part, kind, amount, now, math.inf if seconds is None else now + seconds)
        with self._lock:
            self._become({**self._present, (part, kind): fault})
        self._tell()
        return fault

    def check(self, part: str, kind: str, amount: float | None = None, seconds: float | None = None) -> float:
        """Return the amount of a failure that is to be.

        Raises InvalidCommand for what cannot fail so, with what can, and for an amount out of its range.
        """
        known = self._known(part)
        found = next((each for each in known if each.name == kind), None)
        if found is None:
            names = ", ".join(each.name for each in known)
            raise InvalidCommand("kind", f"{part} cannot be {kind[:_QUOTED]!r}: it can be {names}")
        if amount is None or not found.unit:
            amount = found.usual
        if not found.least <= amount <= found.greatest:
            least, greatest, unit = found.least, found.greatest, found.unit
            raise InvalidCommand(
                "amount",
                f"{part} {kind}: the amount is {amount:g}, and must be from {least:g} to {greatest:g} {unit}",
            )
        longest = _LONGEST_HANG if (part, kind) == (SERVER, "hung") else _LONGEST
        if seconds is not None and not 0.0 < seconds <= longest:
            raise InvalidCommand(
                "seconds", f"seconds is {seconds:g}: it must be above 0 and at most {longest:g}"
            )
        if (part, kind) == (SERVER, RESTARTED) and self.restart is None:
            raise InvalidCommand(
                "kind", f"{part} cannot be {kind}: its process is not its own, but that of a test or a trial"
            )
        return amount

    def heal(self, part: str | None = None) -> None:
        """End the failures of a part, or all. Raises InvalidCommand for a part that there is not."""
        if part is not None:
            self._known(part)
        with self._lock:
            if self._present:
                self._become({of: fault for of, fault in self._present.items() if part not in {None, of[0]}})
        self._tell()

    def current(self) -> Present:
        """Return the failures of now: the same object until they change."""
        present = self._present
        if not present or self.now() < self._next_end:
            return present
        with self._lock:
            now = self.now()
            self._become({of: fault for of, fault in self._present.items() if now < fault.end})
            return self._present

    def of(self, part: str, kind: str) -> Fault | None:
        """Return the failure of a part and kind of now, if there is one."""
        return self.current().get((part, kind))

    def _tell(self) -> None:
        for watch in self.watchers:
            watch()

    def _become(self, present: dict[tuple[str, str], Fault]) -> None:
        self._next_end = min((fault.end for fault in present.values()), default=math.inf)
        self._present = MappingProxyType(present)

    def _known(self, part: str) -> tuple[FaultKind, ...]:
        if known := self.kinds.get(part):
            return known
        names = ", ".join([name for name, kinds in self.kinds.items() if kinds][:_MOST_NAMES])
        raise InvalidCommand("part", f"there is no part {part[:_QUOTED]!r} that can fail; there are {names}")
