"""ALMemory: values under keys, and signals that send their changes."""

from __future__ import annotations

import threading
from typing import Any, Final

import qi

from naoserver.errors import InvalidCommand
from naoserver_qi.access import Access
from naoserver_qi.arguments import keepable, text, texts
from naoserver_qi.faults import Faults
from naoserver_qi.sensors import ALSonar, Moment, keys_of

__all__ = ["NOTIFYING", "ALMemory"]

MOST: Final = 1000
"""Keys that clients may write, and keys that they may listen to."""
NOTIFYING: Final = 0.02
"""Wall seconds between two checks for changes."""


class Subscriber:
    """What ALMemory.subscriber returns: the signal of a key."""

    def __init__(self) -> None:
        self.signal = qi.Signal("(m)")


class ALMemory:
    """Keep what clients and services insert, and look up everything else when it is asked for."""

    def __init__(self, access: Access, sonar: ALSonar, faults: Faults | None = None) -> None:
        self._access = access
        self._looks = keys_of(access, sonar)
        self._faults = faults or Faults()
        self._lock = threading.Lock()
        self._inserted: dict[str, Any] = {}
        self._subscribers: dict[str, Subscriber] = {}
        self._seen: dict[str, object] = {}

    def getData(self, key: object, _lane: object = 0) -> Any:  # noqa: ANN401 - whatever stands there
        """Return the value of a key."""
        name = text(key, "key")
        found, value = self._look(name, Moment(self._access))
        if not found:
            raise InvalidCommand("key", f"there is no data under {name[:200]!r}")
        return value

    def getListData(self, keys: object) -> list[Any]:
        """Return the values of keys at one moment; None where there is none."""
        moment = Moment(self._access)
        return [self._look(key, moment)[1] for key in texts(keys, "keys")]

    def insertData(self, key: object, value: object) -> None:
        """Write a value under a key without a signal; what is measured stays as it is."""
        name, kept = text(key, "key"), keepable(value, "value")
        with self._lock:
            if name not in self._inserted and len(self._inserted) >= MOST:
                raise InvalidCommand("key", f"there are {MOST} keys already: remove some")
            self._inserted[name] = kept

    def raiseEvent(self, name: object, value: object) -> None:
        """Write a value under a key, and send its signal."""
        self.insertData(name, value)
        subscriber = self._subscribers.get(text(name, "name"))
        if subscriber is not None:
            subscriber.signal(value)

    def raiseMicroEvent(self, name: object, value: object) -> None:
        """Write a value under a key, and send its signal."""
        self.raiseEvent(name, value)

    def removeData(self, key: object) -> None:
        """Remove what was written under a key."""
        with self._lock:
            self._inserted.pop(text(key, "key"), None)

    def getDataListName(self) -> list[str]:
        """Return every key."""
        with self._lock:
            return sorted(filter(self._faults.knows, {*self._looks, *self._inserted}))

    def getDataList(self, filter: object) -> list[str]:
        """Return the keys that contain a text."""
        part = text(filter, "filter")
        return [key for key in self.getDataListName() if part in key]

    def subscriber(self, event: object) -> Subscriber:
        """Return an object whose `signal` sends the value of a key whenever it changes."""
        name = text(event, "event")
        with self._lock:
            if name not in self._subscribers:
                if len(self._subscribers) >= MOST:
                    raise InvalidCommand("event", f"{MOST} keys are listened to already")
                if name in self._looks:
                    self._seen[name] = self._look(name, Moment(self._access))[1]
                self._subscribers[name] = Subscriber()
            return self._subscribers[name]

    def _notify(self) -> None:
        """Send the values that have changed since the last time to their subscribers."""
        with self._lock:
            moment = Moment(self._access)
            changed = [
                (self._subscribers[name], value)
                for name, before in self._seen.items()
                if (value := self._looks[name](moment)) != before
            ]
            self._seen = {name: self._looks[name](moment) for name in self._seen}
        for subscriber, value in changed:
            subscriber.signal(value)

    def _look(self, key: str, moment: Moment) -> tuple[bool, object]:
        look = self._looks.get(key)
        if not self._faults.knows(key):
            return False, None
        if look is not None:
            return True, look(moment)
        return key in self._inserted, self._inserted.get(key)
