"""The one order of a client's calls to a servant, whichever route each of them takes.

A call must not overtake those of its client that were begun and are not answered. These go over the network,
and so does every other call to their target meanwhile, behind them.

A call that ended without an answer may still be on its way: in a process or a router that stood still, or in
what a broken link left behind. It would be executed after calls that its client made later, such as a stop.
So every call names those to the same target that its client gave up before, until one that named them has
returned a value: a refused one may not have been read. Servants do not begin them any more.
"""

from __future__ import annotations

import itertools
import math
import threading
import time
from collections import OrderedDict
from typing import TYPE_CHECKING, Final

from zenoh_ice.data.wire import MOST_GIVEN_UP, Attachment, encode_attachment

if TYPE_CHECKING:
    from zenoh_ice.data.keys import Target

_MOST_CLIENTS: Final = 1024
_MOST_NUMBERS: Final = 4 * MOST_GIVEN_UP  # of a client


class OwnCalls:
    """The calls of one client: gives them their numbers and attachments; thread-safe."""

    def __init__(self, client: str) -> None:
        self.client: Final = client
        self.numbers: Final = itertools.count(1)
        self.unanswered: Final[dict[Target, set[int]]] = {}
        """Calls that were begun, by target; none without any."""
        self._lock: Final = threading.Lock()
        self._given_up: Final[dict[Target, tuple[int, ...]]] = {}

    def attach(
        self, target: Target, number: int, fingerprint: str | None, timeout: float
    ) -> tuple[bytes, tuple[int, ...]]:
        """Return the attachment of a call, and the numbers of the calls that it names as given up.

        It is made when the route of the call is known: calls that took another one count as given up by then.
        Without a fingerprint, it names these alone, and is empty where there are none.
        """
        given_up = self._given_up.get(target, ())
        if fingerprint is None and not given_up:
            return b"", ()
        # A tuple rather than the struct: it saves a microsecond in every call.
        members = (fingerprint or "", number, math.nan, time.time(), f"{self.client}/{number}", timeout)
        return encode_attachment((*members, given_up) if given_up else members), given_up

    def begin(self, target: Target, number: int) -> None:
        """Let no later call overtake one that is begun over the network, until `end`."""
        with self._lock:
            self.unanswered.setdefault(target, set()).add(number)

    def end(self, target: Target, number: int) -> None:
        """Note that a call that was begun was answered, or given up before."""
        with self._lock:
            begun = self.unanswered[target]
            begun.discard(number)
            if not begun:
                del self.unanswered[target]

    def give_up(self, target: Target, number: int) -> None:
        """Note that a call ended without an answer, or that nobody wants it any more."""
        with self._lock:
            known = self._given_up.get(target, ())
            if number not in known:
                self._given_up[target] = (*known, number)[-MOST_GIVEN_UP:]

    def heard(self, target: Target, named: tuple[int, ...]) -> None:
        """Note that a call has returned a value that named some calls as given up."""
        with self._lock:
            left = tuple(each for each in self._given_up.get(target, ()) if each not in named)
            if left:
                self._given_up[target] = left
            else:
                self._given_up.pop(target, None)


class GivenUpCalls:
    """The calls that clients gave up, as far as a server remembers them; thread-safe."""

    def __init__(self) -> None:
        self.numbers: Final[OrderedDict[str, dict[int, None]]] = OrderedDict()
        """Their numbers, by client."""
        self._lock: Final = threading.Lock()

    def hear(self, about: Attachment) -> None:
        """Note the calls that the attachment of another one names."""
        with self._lock:
            numbers = self.numbers.setdefault(about.client, {})
            self.numbers.move_to_end(about.client)
            numbers.update(dict.fromkeys(about.given_up))
            for number in [*itertools.islice(numbers, max(0, len(numbers) - _MOST_NUMBERS))]:
                del numbers[number]
            if len(self.numbers) > _MOST_CLIENTS:
                self.numbers.popitem(last=False)
