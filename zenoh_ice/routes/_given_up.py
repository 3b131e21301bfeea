"""The calls that clients gave up, as a server remembers them: its servants do not begin them any more."""

from __future__ import annotations

import itertools
import threading
from collections import OrderedDict
from typing import Final

from zenoh_ice.data.wire import MOST_GIVEN_UP, Attachment

_MOST_CLIENTS: Final = 1024
_MOST_NUMBERS: Final = 4 * MOST_GIVEN_UP  # of a client


class GivenUpCalls:
    """The calls that clients gave up, as far as a server remembers them; thread-safe."""

    def __init__(self) -> None:
        self.numbers: Final[OrderedDict[str, dict[int, None]]] = OrderedDict()
        """Their numbers, by client."""
        self._lock: Final = threading.Lock()

    def add(self, about: Attachment) -> None:
        """Note the calls that the attachment of another one names."""
        with self._lock:
            numbers = self.numbers.setdefault(about.client, {})
            self.numbers.move_to_end(about.client)
            numbers.update(dict.fromkeys(about.given_up))
            for number in [*itertools.islice(numbers, max(0, len(numbers) - _MOST_NUMBERS))]:
                del numbers[number]
            if len(self.numbers) > _MOST_CLIENTS:
                self.numbers.popitem(last=False)
