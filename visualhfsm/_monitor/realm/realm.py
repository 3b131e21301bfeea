"""Find the servants of a realm, and call them without waiting."""

from __future__ import annotations

import difflib
import logging
import math
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from datetime import UTC, datetime
from typing import Final, Generic, TypeVar

from codegen.messages import Message, any_of
from interfaces.hfsm import InvalidValue, NoSuchElement, ReloadRefused
from interfaces.jderobot import JderobotException
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._base.recognition import recognized
from zenoh_ice import Communicator, MarshalException, Sample, ZenohIceError
from zenoh_ice.data.keys import Target
from zenoh_ice.data.text import printable

MONITOR_PREFIX: Final = "Hfsm."
"""Prefix of the identities of monitors of components."""
DRY_RUN_PREFIX: Final = "DryRun."
"""Prefix of the identities that describe the robots of dry runs."""
RELOAD_PATIENCE: Final = 30_000
"""Milliseconds that a component may take to reload its file, with its libraries."""
_PERIOD: Final = 0.05
_DISCOVERY_TIME: Final = 0.3
"""Seconds in which others are discovered after the first: each process has a separate link."""
_RETRY_DELAY: Final = 0.5
"""Seconds between two attempts of a call."""
_STATUS_LIMIT: Final = 1.0
"""Seconds in which a process has to say what it is."""
_SHOWN: Final = 12
"""Names that an error lists at most."""

T = TypeVar("T")

_logger = logging.getLogger(__name__)


def find_component(communicator: Communicator, wait: float) -> str:
    """Return the name of the component that runs in the realm, waiting at most `wait` s for one.

    Raises VisualHfsmError when there is none or more than one.
    """
    deadline = time.monotonic() + wait
    while not (found := components(communicator)):
        if time.monotonic() >= deadline:
            endpoints = ", ".join(communicator.settings.connect)
            raise VisualHfsmError.because(
                "no component runs in realm {realm} at {endpoints}; start one, such as: python "
                "behaviors/follow_ball.py; naoserver-sim starts the robot for it",
                realm=communicator.realm,
                endpoints=endpoints,
            )
        time.sleep(_PERIOD)
    time.sleep(_DISCOVERY_TIME)
    found = components(communicator) or found
    if len(found) > 1:
        raise VisualHfsmError.because("several components run; name one of {found}", found=", ".join(found))
    return found[0]


def components(communicator: Communicator) -> list[str]:
    """Return the names of the components that are known to run in the realm."""
    identities = communicator.identities()
    names = (name.removeprefix(MONITOR_PREFIX) for name in identities if name.startswith(MONITOR_PREFIX))
    return [printable(name) for name in names]


def describe_component(communicator: Communicator, name: str) -> Message:
    """Return the name of a component with its process, and since when it serves, as far as known."""
    identity = f"{MONITOR_PREFIX}{name}"
    served = next((each for each in communicator.servants() if printable(each.identity) == identity), None)
    try:
        status = None if served is None else communicator.processStatus(served.server, timeout=_STATUS_LIMIT)
    except ZenohIceError as error:
        _logger.debug("the process of %s is unknown: %s", name, error)
        status = None
    if status is None:
        return Message.verbatim(name)
    began, now = (datetime.fromtimestamp(each, UTC).astimezone() for each in (status.since, time.time()))
    return Message(
        "{name} ({program} on {host}, process {pid}, since {time})",
        name=name,
        program=printable(status.program),
        host=printable(status.host),
        pid=status.pid,
        time=f"{began:%H:%M}" if began.date() == now.date() else f"{began:%Y-%m-%d %H:%M}",
    )


def missing_component(communicator: Communicator, name: str, wait: float = 0.0) -> VisualHfsmError | None:
    """Return the error for a component that is not known to run, or None for one that is.

    It names those that run, and waits at most `wait` s to find them.
    """
    deadline = time.monotonic() + wait
    while not (found := components(communicator)) and time.monotonic() < deadline:
        time.sleep(_PERIOD)
    if name in found:
        return None
    shown = printable(name)[:100]
    hint = Message("start it, such as: python {name}.py", name=shown)
    return VisualHfsmError.because(
        "no component {name} runs in realm {realm}; {hint}",
        name=shown,
        realm=communicator.realm,
        hint=did_you_mean(name, found) if found else hint,
    )


@contextmanager
def refusals(component: str) -> Iterator[None]:
    """Convert the refusal of a component to a VisualHfsmError, which says why in one line."""
    try:
        yield
    except (NoSuchElement, InvalidValue, JderobotException) as error:
        raise VisualHfsmError(recognized(printable(error.what))) from error
    except ReloadRefused as error:
        reason = recognized(printable(error.reason))
        raise VisualHfsmError.because(
            "not reloaded, {component} runs on as it was: {reason}", component=component, reason=reason
        ) from error


def has_interface(communicator: Communicator, identity: str, type_id: str) -> bool:
    """Return whether a servant that is present has an interface."""
    return type_id in communicator.presence.interfaces(Target(communicator.realm, identity))


def did_you_mean(text: str, known: Iterable[str]) -> Message:
    """Return `did you mean ...?`, or the list of those that exist."""
    names = sorted(set(known))
    close = difflib.get_close_matches(text[:200], names, 3)
    close = [name for name in close if not any(name.endswith(f"/{other}") for other in close)]
    if close:
        return Message("did you mean {names}?", names=any_of(close))
    if not names:
        return Message("there are none")
    shown = ", ".join(names[:_SHOWN])
    if len(names) > _SHOWN:
        return Message("there are {names} and {more} more", names=shown, more=len(names) - _SHOWN)
    return Message("there are {names}", names=shown)


class PolledValue(Generic[T]):
    """The answer to a call, which is repeated until it succeeds; `poll` it regularly."""

    def __init__(self, ask: Callable[[], Future[T]]) -> None:
        self.value: T | None = None
        self.trouble = ""
        self._ask = ask
        self._pending: Future[T] | None = None
        self._next = 0.0

    def forget(self) -> None:
        """Forget the answer, or the call, and call again at once: the server has changed."""
        if self.value is not None or self._pending is not None:
            self._next = 0.0
        self.value = None
        self._pending = None

    def poll(self) -> T | None:
        """Call if a call is due, read its answer if that has arrived, and return the known answer."""
        if self._pending is not None and self._pending.done():
            pending, self._pending = self._pending, None
            try:
                self.value = pending.result()
                self.trouble = ""
            except ZenohIceError as error:
                _logger.debug("no answer yet: %s", error)
                self.trouble = str(error)
        if self.value is None and self._pending is None and time.monotonic() >= self._next:
            self._next = time.monotonic() + _RETRY_DELAY
            self._pending = self._ask()
        return self.value


class Newest(Generic[T]):
    """The newest sample of a stream, or None when it is older than `oldest` s or does not fit the interface.

    Only the first sample of a series that does not fit is logged, since this is read many times a second.
    """

    def __init__(self, read: Callable[[], Sample[T] | None], oldest: float = math.inf) -> None:
        self._read = read
        self._oldest = oldest
        self._since = -math.inf
        self.trouble = ""
        """Why the last sample does not fit."""

    def __call__(self) -> Sample[T] | None:
        """Return the sample without waiting."""
        try:
            sample = self._read()
        except MarshalException as error:
            if not self.trouble:
                _logger.warning("%s", error)
            self.trouble = str(error)
            return None
        self.trouble = ""
        oldest = min(self._oldest, time.monotonic() - self._since)
        return sample if sample is not None and sample.age <= oldest else None

    def forget(self) -> None:
        """Return no sample from before: another server may appear."""
        self._since = time.monotonic()
