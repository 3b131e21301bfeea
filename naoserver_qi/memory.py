"""ALMemory: values under keys, and signals and callbacks that send their changes."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import Any, Final

import qi

from naoserver.errors import InvalidCommand
from naoserver_qi.access import Access
from naoserver_qi.arguments import keepable, text, texts
from naoserver_qi.calls import Faults
from naoserver_qi.keys import TOUCH, Distances, Moment, keys_of

_logger = logging.getLogger(__name__)

MOST: Final = 1000
"""Keys that clients may write, and keys that they may listen to."""
NOTIFYING: Final = 0.02
"""Wall seconds between two checks for changes."""
_RAISED: Final = (
    "ALTextToSpeech/CurrentSentence",
    "ALTextToSpeech/TextDone",
    "ALTextToSpeech/TextStarted",
    "ALTracker/ColorBlobDetected",
    "AutonomousLife/State",
    "FaceDetected",
    "LandmarkDetected",
    "redBallDetected",
)
"""The events that services raise."""


def _nobody(name: str) -> qi.Future:
    """Find no service."""
    promise = qi.Promise()
    promise.setError(f"there is no service {name}")
    return promise.future()


def _call(found: qi.Future, method: str, event: str, value: object, message: str = "") -> None:
    """Call back a program; one that is gone, or has no such operation, is logged."""
    try:
        called = getattr(found.value(), method)(event, value, message, _async=True)
        called.addCallback(lambda done: _report(event, done.error()) if done.hasError() else None)
    except (AttributeError, RuntimeError) as error:
        _report(event, str(error))


def _report(event: str, error: str) -> None:
    _logger.warning("nobody was called back when %s changed: %s", event[:200], error[:500])


class Subscriber:
    """The result of ALMemory.subscriber: the signal of a key."""

    def __init__(self) -> None:
        self.signal = qi.Signal("(m)")


class ALMemory:
    """Keep what clients and services insert, and look up everything else when it is asked for."""

    def __init__(
        self,
        access: Access,
        distances: Distances,
        faults: Faults | None = None,
        *,
        find: Callable[[str], qi.Future] = _nobody,
    ) -> None:
        """Show what a robot measures; `find` begins to look up the service of a program by its name."""
        self._access = access
        self._looks = keys_of(access, distances)
        self._faults = faults or Faults()
        self._find = find
        self._callbacks: dict[tuple[str, str], int] = {}  # links to signals by event and module
        self._lock = threading.Lock()
        self._inserted: dict[str, Any] = {}
        self._subscribers: dict[str, Subscriber] = {}
        self._seen: dict[str, Any] = {}

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
        """Write a value under a key without a signal; measured values stay."""
        name, kept = text(key, "key"), keepable(value, "value")
        with self._lock:
            if name not in self._inserted and len(self._inserted) >= MOST:
                raise InvalidCommand("key", f"there are {MOST} keys already: remove some")
            self._inserted[name] = kept

    def raiseEvent(self, name: object, value: object) -> None:
        """Write a value under a key, and send its signal."""
        self.insertData(name, value)
        if (subscriber := self._subscribers.get(text(name, "name"))) is not None:
            subscriber.signal(value)

    raiseMicroEvent = raiseEvent

    def removeData(self, key: object) -> None:
        """Remove what was written under a key."""
        with self._lock:
            self._inserted.pop(text(key, "key"), None)

    def getDataListName(self) -> list[str]:
        """Return every key."""
        with self._lock:
            return sorted(filter(self._faults._knows, {*self._looks, *self._inserted}))

    def getDataList(self, filter: object) -> list[str]:
        """Return the keys that contain a text."""
        part = text(filter, "filter")
        return [key for key in self.getDataListName() if part in key]

    def subscriber(self, event: object) -> Subscriber:
        """Return an object whose `signal` sends the value of a key whenever it changes.

        As with NAOqi it may be any name, since another program may raise that event later; the log says when
        nothing here does.
        """
        name = text(event, "event")
        with self._lock:
            if name not in self._subscribers:
                if len(self._subscribers) >= MOST:
                    raise InvalidCommand("event", f"{MOST} keys already have listeners")
                if name in self._looks:
                    self._seen[name] = self._look(name, Moment(self._access))[1]
                elif name not in self._inserted and name not in _RAISED:
                    _logger.warning("%r never happens here unless a program raises it", name[:200])
                self._subscribers[name] = Subscriber()
            return self._subscribers[name]

    def subscribeToEvent(self, name: object, callbackModule: object, *callbackMethod: object) -> None:
        """Call an operation of a program's service, with key, value and a text, whenever a key changes.

        Before the operation may stand that text, which is empty otherwise.
        """
        *message, method = (text(each, "callback") for each in callbackMethod or ("",))
        event, module = text(name, "event"), text(callbackModule, "module")
        if len(message) > 1 or not method or method.startswith("_"):
            raise InvalidCommand("callback", "give event, module and the operation to call")
        self.unsubscribeToEvent(event, module)

        def call(value: object) -> None:
            self._find(module).addCallback(lambda found: _call(found, method, event, value, *message))

        self._callbacks[event, module] = self.subscriber(event).signal.connect(call)

    def unsubscribeToEvent(self, name: object, callbackModule: object) -> None:
        """Call a program's service no more when a key changes."""
        event = text(name, "event")
        if (link := self._callbacks.pop((event, text(callbackModule, "module")), None)) is not None:
            self.subscriber(event).signal.disconnect(link)

    subscribeToMicroEvent = subscribeToEvent
    unsubscribeToMicroEvent = unsubscribeToEvent

    def _notify(self) -> None:
        """Send the values that have changed since the last time to their subscribers."""
        with self._lock:
            moment = Moment(self._access)
            seen, self._seen = self._seen, {name: self._looks[name](moment) for name in self._seen}
            changed = {name: value for name, value in self._seen.items() if value != seen[name]}
        if TOUCH in changed:  # as a robot does, only what has changed
            changed[TOUCH] = [part for part in changed[TOUCH] if part not in seen[TOUCH]]
        for name, value in changed.items():
            self._subscribers[name].signal(value)

    def _look(self, key: str, moment: Moment) -> tuple[bool, object]:
        if not self._faults._knows(key):
            return False, None
        if key in self._looks:
            return True, self._looks[key](moment)
        return key in self._inserted, self._inserted.get(key)
