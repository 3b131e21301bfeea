"""What takes the calls of a target in place of a servant, and does with each what a test wants."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import NamedTuple

from zenoh_ice.data.codec import Buffer
from zenoh_ice.threads.pool import Job, JobKind
from zenoh_ice.transport import Ended, Reply

__all__ = ["Taken", "Taker"]


class Taken(NamedTuple):
    """A call that has arrived."""

    name: str
    payload: bytes | None
    attachment: bytes | None
    gone: bool
    """Its caller had ended."""


class Taker(ABC):
    """A receiver; each of its jobs may take long unless it has a kind of its own."""

    runs_here = False
    kind: JobKind | None = None

    @abstractmethod
    def take(self, call: Taken, reply: Reply) -> Callable[[], object]:
        """Return what executes a call."""

    def admit(
        self,
        name: str,
        payload: Buffer | None,
        attachment: Buffer | None,
        reply: Reply,
        *,
        gone: bool = False,
        ended: Ended | None = None,
    ) -> Job:
        data, about = (None if each is None else bytes(each) for each in (payload, attachment))
        return self.kind or JobKind(), self.take(Taken(name, data, about, gone), reply)
