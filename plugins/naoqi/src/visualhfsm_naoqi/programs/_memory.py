"""ALMemory: values under keys, and signals and callbacks that send their changes; ALAutonomousLife."""

from __future__ import annotations

import logging
import math
import operator
from collections import ChainMap
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import cache
from typing import Any, Final, NamedTuple

import qi

from naoserver.errors import InvalidCommand
from visualhfsm_naoqi.programs._access import Access, Service
from visualhfsm_naoqi.programs._arguments import (
    chosen,
    keepable,
    kept,
    number_within,
    one_of,
    switch,
    text,
    texts,
)
from visualhfsm_naoqi.programs._clients import Call, Client
from visualhfsm_naoqi.programs._sensors import TOUCH, Extractor, Part, parts_of

_logger = logging.getLogger(__name__)

NOTIFYING: Final = 0.02
"""Wall seconds between two checks for changes."""
_LONGEST_CHANGE: Final = 3600.0
"""Maximum robot seconds for which a program waits for a change, unless it waits without a limit."""
MOST_KEYS: Final = 250
"""Maximum keys of a client, and maximum keys to which it listens."""
MOST_LEFT: Final = 1000
"""Maximum keys that lost clients leave behind; the oldest ones go first."""
MOST_CALLBACKS: Final = 100
"""Maximum callbacks of a client."""
_RAISED: Final = (
    "ALAnimatedSpeech/EndOfAnimatedSpeech",
    "ALTextToSpeech/CurrentSentence",
    "ALTextToSpeech/Status",
    "ALTextToSpeech/TextDone",
    "ALTextToSpeech/TextStarted",
    "ALTracker/ColorBlobDetected",
    "AutonomousLife/State",
    "FaceDetected",
    "LandmarkDetected",
    "SpeechDetected",
    "WordRecognized",
    "WordRecognizedAndGrammar",
    "redBallDetected",
)
"""The events that services raise; they take no room from the keys of clients."""


def _call(found: qi.Future, method: str, event: str, value: object, message: str = "") -> None:
    """Call back a program; log when it is gone, or has no such operation."""
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


class _Heard(NamedTuple):
    """A key to which clients listen: its signal, and the subscriber that they get."""

    signal: qi.Signal
    lent: object


class ALMemory(Service):
    """Keep what clients and services insert, and look up everything else when it is asked for."""

    def __init__(self, access: Access) -> None:
        super().__init__(access)
        self._parts = {key: part for part in parts_of(access) for key in part()}
        self._raised: dict[str, Any] = {}  # values of the services' own events
        self._inserted = self._bounded("keys", MOST_KEYS)
        self._left: dict[str, Any] = {}  # what lost clients had inserted, the oldest first
        self._written = ChainMap[str, Any](self._raised, self._inserted, self._left)
        self._heard: dict[str, _Heard] = {}
        self._listening = self._bounded("keys to which it listens", MOST_KEYS)  # by client and key
        self._callbacks = self._bounded("callbacks", MOST_CALLBACKS)  # links to signals by event and module
        self._seen: dict[str, Any] = {}
        self.extractors: Final[dict[str, Extractor]] = {}
        """The service that raises each event while it has subscribers."""
        self._unknown: set[str] = set()  # keys of which was logged that nothing raises them

    def getData(self, key: object, _lane: object = 0) -> Any:  # noqa: ANN401 - whatever stands there
        """Return the value of a key."""
        name = text(key, "key")
        found, value = self._look(name)
        if not found:
            raise InvalidCommand("key", f"there is no data under {name[:200]!r}")
        return value

    def getListData(self, keys: object) -> list[Any]:
        """Return the values of keys at one moment; None where there is none."""
        read = cache(operator.call)  # each part once
        return [self._look(key, read)[1] for key in texts(keys, "keys")]

    def getDataOnChange(self, call: Call, key: object, timeOut: object = 0) -> Any:  # noqa: ANN401
        """Return the value of a key once it has changed, or after some seconds; 0 for no limit."""
        limit = number_within(timeOut, "time-out", 0.0, _LONGEST_CHANGE) or math.inf
        before, end = self.getData(key), self._robot.clock.now() + limit
        while (value := self.getData(key)) == before and self._robot.clock.now() < end:
            if call.wait(NOTIFYING):
                break
        return value

    def insertData(self, key: object, value: object) -> None:
        """Write a value under a key without a signal; measured values stay."""
        name, kept = text(key, "key"), keepable(value, "value")
        with self._lock:
            if name in _RAISED:
                self._raised[name] = kept
            else:
                self._inserted[name] = kept
                self._left.pop(name, None)

    def raiseEvent(self, name: object, value: object) -> None:
        """Write a value under a key, and send its signal."""
        self.insertData(name, value)
        if (heard := self._heard.get(text(name, "name"))) is not None:
            heard.signal(value)

    raiseMicroEvent = raiseEvent

    def declareEvent(self, *names: object) -> None:
        """Do nothing: every name can be an event."""

    def removeData(self, key: object) -> None:
        """Remove what was written under a key."""
        name = text(key, "key")
        with self._lock:
            for values in self._written.maps:
                values.pop(name, None)

    removeEvent = removeMicroEvent = removeData

    def getDataListName(self) -> list[str]:
        """Return every key."""
        with self._lock:
            known = {*self._parts, *self._written}
        return sorted(known)

    def getEventList(self) -> list[str]:
        """Return the events that services raise here; a program may raise any other."""
        return sorted({*_RAISED, *self.extractors})

    def getDataList(self, filter: object) -> list[str]:
        """Return the keys that contain a text."""
        part = text(filter, "filter")
        return [key for key in self.getDataListName() if part in key]

    def subscriber(self, event: object) -> object:
        """Return an object whose `signal` sends the value of a key, or of a later event, at each change."""
        if len(self._access.calls.current.client.objects) >= MOST_KEYS:
            raise InvalidCommand(
                "subscribers", f"this program has {MOST_KEYS} subscribers already: let some of them go"
            )
        return self._listen(text(event, "event")).lent

    def subscribeToEvent(self, name: object, callbackModule: object, *callbackMethod: object) -> None:
        """Call a service's operation, named last, with key, value and the text before it at each change.

        A detector, and the recognition of speech, run as long as somebody is called at their events.
        """
        *message, method = (text(each, "callback") for each in callbackMethod or ("",))
        event, module = text(name, "event"), text(callbackModule, "module")
        if len(message) > 1 or not method or method.startswith("_"):
            raise InvalidCommand("callback", "give event, module and the operation to call")

        def call_back(value: object) -> None:
            self._access.find(module).addCallback(lambda found: _call(found, method, event, value, *message))

        self.unsubscribeToEvent(event, module)
        if (extractor := self.extractors.get(event)) is not None:
            extractor.subscribe(f"{module} {event}")
        signal = self._listen(event).signal
        link = signal.connect(call_back)
        try:
            with self._lock:
                self._callbacks[event, module] = signal, link
        except InvalidCommand:
            signal.disconnect(link)
            raise

    def unsubscribeToEvent(self, name: object, callbackModule: object) -> None:
        """Stop calling a program's service when a key changes."""
        event, module = text(name, "event"), text(callbackModule, "module")
        with self._lock:
            signal, link = self._callbacks.pop((event, module), (None, 0))
        if signal is not None:
            signal.disconnect(link)
        if event in self.extractors:
            with suppress(InvalidCommand):  # it may have ended the subscription itself
                self.extractors[event].unsubscribe(f"{module} {event}")

    subscribeToMicroEvent = subscribeToEvent
    unsubscribeToMicroEvent = unsubscribeToEvent

    def _notify(self) -> None:
        """Send the values that have changed since the last time to their subscribers."""
        with self._lock:
            read = cache(operator.call)  # each part once
            seen, self._seen = self._seen, {name: read(self._parts[name])[name] for name in self._seen}
            changed = {name: value for name, value in self._seen.items() if value != seen[name]}
        if TOUCH in changed:  # as on a robot, only the sensors that have changed
            changed[TOUCH] = [part for part in changed[TOUCH] if part not in seen[TOUCH]]
        for name, value in changed.items():
            if (heard := self._heard.get(name)) is not None:
                heard.signal(value)

    def _listen(self, name: str) -> _Heard:
        """Listen to a key for the current client; it is heard while one of its clients is there."""
        listener = self._access.calls.current.client, name
        value = self._look(name)[1]
        if (heard := self._heard.get(name)) is None:
            subscriber = Subscriber()
            heard = _Heard(subscriber.signal, self._access.lend(subscriber))
        with self._lock:
            self._listening[listener] = None
            if name not in self._heard:
                if name in self._parts:
                    self._seen[name] = value
                elif name not in _RAISED and name not in self._written:
                    self._warn(name)
            return self._heard.setdefault(name, heard)

    def _warn(self, name: str) -> None:
        """Log once that nothing raises an event."""
        if name not in self._unknown and len(self._unknown) < MOST_LEFT:
            self._unknown.add(name)
            _logger.warning("%r never happens here unless a program raises it", name[:200])

    def _forget(self, client: Client) -> None:
        """Keep what a lost client had inserted; end its callbacks, and subscribers that nobody else has."""
        with self._lock:
            self._left |= self._inserted.take(client)
            for name in list(self._left)[:-MOST_LEFT]:
                del self._left[name]
            callbacks = self._callbacks.take(client)
            self._listening.take(client)
            for name in self._heard.keys() - {name for _, name in self._listening}:
                del self._heard[name]
                self._seen.pop(name, None)
        for signal, link in callbacks.values():
            signal.disconnect(link)

    def _look(
        self, key: str, read: Callable[[Part], Mapping[str, Any]] = operator.call
    ) -> tuple[bool, object]:
        """Return whether there is data under a key, and its value; `read` reads a part of the keys."""
        if key in self._parts:
            return True, read(self._parts[key])[key]
        with self._lock:
            return key in self._written, self._written.get(key)


_STATES: Final = ("disabled", "solitary", "interactive", "safeguard")


_ABILITY: Final = one_of(
    "ability",
    ("AutonomousBlinking", "BackgroundMovement", "BasicAwareness", "ListeningMovement", "SpeakingMovement"),
)


class ALAutonomousLife(Service):
    """Remember the state of a life that the robot does not have: nothing moves by itself in any state."""

    setAutonomousAbilityEnabled, getAutonomousAbilityEnabled = kept(
        "whether an autonomous ability is enabled", True, autonomousAbility=_ABILITY, enabled=switch
    )

    _state = _STATES[0]

    def getState(self) -> str:
        """Return the state, at first `disabled`."""
        return self._state

    def setState(self, state: object) -> None:
        """Set the state."""
        self._state = chosen(state, "state", _STATES)
        self._access.service(ALMemory).raiseEvent("AutonomousLife/State", self._state)
