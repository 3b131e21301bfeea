"""Stop robots from a new process, over a network that may lose, delay or crowd out its messages.

Making a link takes five round trips, and a lost packet costs a second of waiting; a robot's server gives up
a link that is not made within two. So several links are tried, one shortly after the other, and each repeats
the message until it is answered. The first answer counts.
"""

from __future__ import annotations

import atexit
import logging
import os
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, TypeVar

import msgspec

from zenoh_ice import ConnectFailedException, ZenohIceError
from zenoh_ice.application import emergency_stop
from zenoh_ice.carriers.zenoh.messenger import Messenger
from zenoh_ice.data import typed
from zenoh_ice.data.text import printable
from zenoh_ice.settings import Settings

OWN_SWITCH: Final = "use the robot's own switch"
_LINKS: Final = 6  # tried for each endpoint; the firewall of a lab lets an address have sixteen
_STAGGER: Final = 0.5  # s between their beginnings: on a good network the first has done it by then
_LINK_LIMIT: Final = 6.0  # s for making a link; more would not help, since servers give up after two
_REPORT_PERIOD: Final = 3.0  # s between reports of what is missing
_MESSAGE_PERIOD: Final = 0.1  # s between messages that nobody serves, and between links
_LAST: Final = 0.1  # s for links that are still being made when the robots have stopped
_LONGEST_TROUBLE: Final = 300  # characters
_NO_ARGUMENTS: Final = b"\x80"  # an empty map

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class StopLimits:
    """How long a stop waits for the robots, in s."""

    answer: float = 2.0
    """A stop that was not answered is sent again."""
    state: float = 1.0
    """A robot says how fast its joints move."""
    standstill: float = emergency_stop.STILL_LIMIT
    """The joints are still after a confirmed stop, or the robot has said nothing of them."""
    realms: float = 0.6
    """All robots behind a link are known if none was found for so long; gossip takes less."""


STOP_LIMITS: Final = StopLimits()
"""The limits of a stop that gets no others."""


@dataclass
class Route:
    """A way to robots: an endpoint, or all that a peer finds."""

    name: str
    settings: Settings
    required: bool
    """True if the robots behind it count as unstopped while it makes no link."""
    reached: bool = False
    settled: bool = False
    """True once the realms that it leads to are known."""
    trouble: str = ""


@dataclass
class Realm(emergency_stop.RobotStop):
    """What is known about the stop of the robot of a realm."""

    name: str
    required: bool = True
    """False for a robot that may not be there."""
    trouble: str = ""
    """Why it did not stop, last."""
    lost_for: float = 0.0
    """Seconds for which no command has reached it."""

    def note(self, answers: list[tuple[bool, bytes]]) -> None:
        """Note the answers to a stop; without any, nothing is known."""
        failures = [failure for answer in answers if (failure := emergency_stop.refusal(*answer)) is not None]
        if failures:
            self.trouble = printable(str(failures[0]), _LONGEST_TROUBLE)
        elif answers:
            self.confirm()


class Stopping:
    """Stop the robot of a realm, or of all realms that can be reached: `run` does it, once."""

    def __init__(
        self,
        settings: Settings,
        reason: str,
        *,
        limit: float,
        every_realm: bool = False,
        limits: StopLimits = STOP_LIMITS,
    ) -> None:
        self._limit: Final = limit
        self._limits: Final = limits
        self.routes: Final = _routes(settings, min(limit, _LINK_LIMIT))
        own = Realm(settings.realm, required=not every_realm)
        self.realms: Final = {own.name: own}
        self._payload: Final = emergency_stop.stop_payload(reason)
        self._every_realm: Final = every_realm
        self._changed: Final = threading.Condition()
        self._ended: Final = threading.Event()
        self._threads: Final[list[threading.Thread]] = []
        self._fault: ZenohIceError | None = None

    @property
    def concerned(self) -> list[Realm]:
        """The robots that were to be stopped, by name."""
        return [realm for _, realm in sorted(self.realms.items()) if realm.required or realm.confirmed]

    @property
    def unreached(self) -> list[Route]:
        """The endpoints to which no link was made."""
        return [route for route in self.routes if route.required and not route.reached]

    @property
    def succeeded(self) -> bool:
        """Whether every robot has stopped and, as far as it says, is still."""
        found, missed = self.concerned, self._every_realm and self.unreached
        return bool(found) and not missed and all(each.still for each in found)

    def run(self, say: Callable[[str], object]) -> None:
        """Try until everything has stopped, or until the limit; `say` gets what is still missing.

        Raises ConfigurationException, or EndpointInUseException, for settings that allow no link.
        """
        deadline = time.monotonic() + self._limit
        said = ""
        try:
            self._start()
            while (left := deadline - time.monotonic()) > 0:
                with self._changed:
                    if self._changed.wait_for(self._complete, min(left, _REPORT_PERIOD)):
                        break
                    missing = self._missing()
                if missing != said:
                    said = missing
                    say(f"not stopped yet: {missing}; trying again; {OWN_SWITCH}")
        finally:
            self._close()
        if self._fault is not None:
            raise self._fault

    def _start(self) -> None:
        for number in range(_LINKS):
            for route in self.routes:
                # What peers find by themselves is rarely needed for one robot.
                late = not route.required and not self._every_realm
                delay = (number + late) * _STAGGER
                thread = threading.Thread(
                    target=self._work, args=(route, delay), name=f"stop by {route.name}", daemon=True
                )
                try:
                    thread.start()
                except RuntimeError as error:  # at a limit of threads or memory: those that run must do
                    route.trouble = str(error)
                else:
                    self._threads.append(thread)

    def _complete(self) -> bool:
        """Return whether nothing is left to do."""
        if self._fault is not None:
            return True
        if not all(realm.over for realm in self.concerned):
            return False
        return all(route.settled for route in self.routes) if self._every_realm else True

    def _missing(self) -> str:
        waiting = [realm for realm in self.concerned if not realm.confirmed]
        moving = [f"{realm.name}: its joints move" for realm in self.concerned if realm.moving]
        moving += [f"{realm.name}: no command reaches it" for realm in self.concerned if realm.lost]
        troubles = [f"{realm.name}: {realm.trouble}" for realm in waiting if realm.trouble]
        troubles += [route.trouble for route in self.unreached if route.trouble]
        silent = "no robot has answered" if len(self.unreached) < len(self.routes) else "no link was made yet"
        return "; ".join([*troubles, *moving]) or silent

    def _close(self) -> None:
        """End the threads; those that are still making a link end with the process."""
        self._ended.set()
        deadline = time.monotonic() + _LAST
        for thread in self._threads:
            thread.join(max(0.0, deadline - time.monotonic()))
        if any(thread.is_alive() for thread in self._threads):
            atexit.register(self._end_process)

    def _end_process(self) -> None:
        """Exit without the threads that wait for a link: the robot has stopped, and nobody waits for them."""
        if any(thread.is_alive() for thread in self._threads):
            sys.stdout.flush()
            sys.stderr.flush()
            logging.shutdown()
            os._exit(0 if self.succeeded else 1)

    # On the threads of the links.

    def _work(self, route: Route, delay: float) -> None:
        """Make a link and use it, again and again, until the end."""
        if self._ended.wait(delay):
            return
        try:
            while not self._ended.is_set():
                try:
                    with Messenger(route.settings) as messenger:
                        self._use(messenger, route)
                except ConnectFailedException as error:
                    route.trouble = str(error)
                self._ended.wait(_MESSAGE_PERIOD)
        except ZenohIceError as error:
            with self._changed:
                self._fault = error
                self._changed.notify_all()

    def _use(self, messenger: Messenger, route: Route) -> None:
        """Stop robots over a link, until the end or until the link is lost."""
        quiet_since = time.monotonic()
        while not self._ended.is_set():
            if messenger.linked:
                route.reached = True
            elif route.settings.mode == "client":
                return
            if self._every_realm and self._discover(messenger):
                quiet_since = time.monotonic()
            self._stop_over(messenger)
            with self._changed:
                route.settled = route.settled or time.monotonic() - quiet_since >= self._limits.realms
                self._changed.notify_all()
            self._ended.wait(_MESSAGE_PERIOD)

    def _discover(self, messenger: Messenger) -> bool:
        """Look for robots of other realms; return whether there are new ones."""
        tokens = messenger.tokens(f"@servant/*/{emergency_stop.SAFETY}/**", self._limits.answer)
        with self._changed:
            found = {token.split("/")[1] for token in tokens}
            new = [name for name in found if name not in self.realms or not self.realms[name].required]
            for name in new:
                self.realms.setdefault(name, Realm(name)).required = True
        return bool(new)

    def _stop_over(self, messenger: Messenger) -> None:
        """Stop every robot that is not known to be still, and look whether it is."""
        with self._changed:
            pending = [realm for realm in self.realms.values() if not realm.over]
        stops = {emergency_stop.stop_key(realm.name): self._payload for realm in pending}
        answers = messenger.ask(stops, self._limits.answer)
        with self._changed:
            for realm in pending:
                realm.note(answers[emergency_stop.stop_key(realm.name)])
            stopped = [
                realm for realm in pending if answers[emergency_stop.stop_key(realm.name)] and realm.confirmed
            ]
        joints = {realm.name: f"{realm.name}/Body/getJointState" for realm in stopped}
        safeties = {realm.name: f"{realm.name}/{emergency_stop.SAFETY}/getSafetyState" for realm in stopped}
        questions = [*joints.values(), *safeties.values()]
        states = messenger.ask(dict.fromkeys(questions, _NO_ARGUMENTS), self._limits.state)
        with self._changed:
            for realm in stopped:
                moves, may = states[joints[realm.name]], states[safeties[realm.name]]
                state, safety = _result(moves, _JointState), _result(may, _SafetyAnswer)
                if safety is not None:
                    realm.lost_for = safety.returnValue.lostFor
                realm.observe(
                    None if state is None else state.returnValue.velocities,
                    None if safety is None else safety.returnValue.lost,
                    self._limits.standstill,
                    answered=bool(moves and may),
                )


def _routes(settings: Settings, limit: float) -> list[Route]:
    """Return a route for each endpoint and, for a peer, one for what it finds by itself.

    `limit` is that of making a link, in s.
    """
    limits: Any = {"timeout": limit, "lease": limit}
    routes = [
        Route(
            endpoint, settings.override(mode="client", connect=[endpoint], listen=[], **limits), required=True
        )
        for endpoint in settings.connect
    ]
    if settings.mode == "peer":
        routes.append(Route("peers", settings.override(**limits), required=not routes))
    return routes


def _result(answers: list[tuple[bool, bytes]], kind: type[T]) -> T | None:
    """Return a robot's only answer; None where it is not as our releases give it."""
    if len(answers) != 1 or not answers[0][0]:
        return None
    try:
        return typed.from_msgpack(answers[0][1], kind)
    except (msgspec.DecodeError, ValueError, RecursionError):
        return None


class _Velocities(msgspec.Struct):
    velocities: list[float]


class _JointState(msgspec.Struct):
    returnValue: _Velocities


class _SafetyState(msgspec.Struct):
    lost: str = ""
    lostFor: float = 0.0


class _SafetyAnswer(msgspec.Struct):
    returnValue: _SafetyState
