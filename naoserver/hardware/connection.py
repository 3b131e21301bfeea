"""Keep the connection to hardware: poll it at a fixed rate, report its loss, and reconnect.

Words about the hardware go into the health report.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final, Generic, Protocol, TypeVar

from interfaces.nao import Severity
from naoserver.errors import HardwareFailure, RobotError
from naoserver.safety._event_log import EventLog
from zenoh_ice import Clock
from zenoh_ice.data.text import sentence


class CallFailed(HardwareFailure):
    """The hardware refused a call, or does not know it; the message says why, behind the call."""


class LinkLost(HardwareFailure):
    """There is no link to the hardware, or it broke during the call."""


class Link(Protocol):
    """A link to hardware, such as an open serial line."""

    @property
    def lost(self) -> threading.Event:
        """Set as soon as the link is known to be gone."""

    def close(self) -> None:
        """Close the link; running calls end with LinkLost. Does nothing the second time."""


_logger = logging.getLogger(__name__)


class Reporter:
    """Pass events of `source` on to an event log, which also writes them to the log; else only to the log."""

    def __init__(self, source: str) -> None:
        self.source: Final = source
        self._events: EventLog | None = None
        self._publish: Callable[[], None] = lambda: None
        self._lock = threading.Lock()
        self._reported: dict[str, str] = {}

    def report_to(self, events: EventLog, publish: Callable[[], None]) -> None:
        """Report to `events` from now on; `publish` sends the health report that contains them."""
        self._events, self._publish = events, publish

    def report(self, level: Severity, message: str, kind: str = "", *, at_once: bool = False) -> None:
        """Report an event, with `at_once` without waiting for the next health report.

        At most one event a second of each kind is kept.
        """
        if self._events is None:
            _logger.log(logging.getLevelNamesMapping()[level.name.upper()], "%s: %s", self.source, message)
            return
        self._events.add(level, self.source, message, kind or message)
        if at_once:
            try:
                self._publish()
            except Exception:
                _logger.exception("the health report could not be sent")

    def report_once(self, kind: str, message: str) -> None:
        """Warn, unless the newest warning of this kind was the same; an empty message ends the problem."""
        with self._lock:
            if self._reported.get(kind, "") == message:
                return
            self._reported[kind] = message
        if message:
            self.report(Severity.Warning, message, kind)

    @contextmanager
    def failures_of(self, kind: str) -> Iterator[None]:
        """Report a failure in a `with` block once, until it succeeds; the connection reports a lost link."""
        try:
            yield
        except LinkLost:
            return
        except HardwareFailure as error:
            self.report_once(kind, str(error))
        else:
            self.report_once(kind, "")


L = TypeVar("L", bound=Link)


@dataclass(frozen=True, slots=True)
class HardwareLimits:
    """How often hardware is asked, and how long it is waited for, in s; by default a NAOqi."""

    period: float = 0.02
    """Between two polls: NAOqi's own cycle."""
    answer: float = 1.0
    """Until the next command is sent without an answer to the one before."""
    retry: float = 0.5
    """Between two attempts to find what is lost."""
    silence: float = 0.7
    """Without an answer until it counts as lost, so that this is reported within 1 s."""
    hang: float = 3.0
    """For a poll, until the robot counts as lost, as when a driver waits without a limit."""
    repetition: float = 0.3
    """Until a stop that failed is sent again."""
    picture: float = 0.9
    """For a picture of a camera."""
    start: float = 30.0
    """Until a robot that is lost at its start has to be found again."""
    end: float = 2.0
    """For the commands that have still to be carried out at the end."""


_CONNECTION_LIMIT: Final = 2.0  # s
_FIRST_CONNECTION_LIMIT: Final = 5.0  # s
_END_LIMIT: Final = 5.0  # s


class Connection(Generic[L]):
    """The connection to the hardware of a robot, from `start` to `close`.

    `connect` makes a link within some seconds, or raises HardwareFailure or OSError. Each of `on_open`
    prepares a new link, and may refuse it in the same way; each of `on_tick` polls the robot at its period:
    after CallFailed it goes on, after any other error, or when it hangs, the robot is lost. Each of
    `on_found` and `on_lost` is called when a link is made or lost, each of `on_close` at the end. `start`
    calls the first two before it returns. All other calls run on one thread, so that they never overlap,
    except `on_lost` while a poll hangs.
    """

    def __init__(
        self, connect: Callable[[float], L], clock: Clock, reporter: Reporter, limits: HardwareLimits
    ) -> None:
        self.limits: Final = limits
        self.on_open: Final[list[Callable[[L], None]]] = []
        self.on_tick: Final[list[Callable[[L], None]]] = []
        self.on_found: Final[list[Callable[[], None]]] = []
        self.on_lost: Final[list[Callable[[str], None]]] = []
        self.on_close: Final[list[Callable[[], None]]] = []
        self._connect = connect
        self._clock = clock
        self._reporter = reporter
        self._link: L | None = None
        self._polled: float | None = None  # when the poll that runs began, by the monotonic clock
        self._losing = threading.Lock()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name=reporter.source, daemon=True)
        self._watch = threading.Thread(target=self._watch_polls, name=f"{reporter.source} watch", daemon=True)

    @property
    def link(self) -> L | None:
        """The link to the robot; None while it is lost."""
        link = self._link
        return None if link is None or link.lost.is_set() else link

    def require(self) -> L:
        """Return the link to the robot. Raises LinkLost."""
        link = self.link
        if link is None:
            raise LinkLost("the robot is not connected")
        return link

    def start(self) -> None:
        """Connect, and poll the robot from then on. Raises RobotError when it cannot be reached."""
        self._link = self._open(_FIRST_CONNECTION_LIMIT)
        try:
            for poll in self.on_tick:
                poll(self._link)
        except BaseException as error:
            _close(self._link)
            if isinstance(error, OSError):
                raise LinkLost(f"there is no link to the robot: {_reason(error)}") from error
            raise
        self._thread.start()
        self._watch.start()

    def close(self) -> None:
        """Disconnect, and end the thread; does nothing the second time."""
        self._closing.set()
        join(self._thread, _END_LIMIT)
        join(self._watch, _END_LIMIT)
        link, self._link = self._link, None
        if link is not None:
            _close(link)

    def _open(self, timeout: float) -> L:
        try:
            link = self._connect(timeout)
            try:
                for prepare in self.on_open:
                    prepare(link)
            except BaseException:
                _close(link)
                raise
        except OSError as error:
            raise LinkLost(f"there is no link to the robot: {_reason(error)}") from error
        return link

    def _run(self) -> None:
        while not self._closing.is_set():
            link = self._link
            if link is None:
                if not self._closing.wait(self.limits.retry):
                    self._find()
            elif (why := self._poll_until_lost(link)) and not self._closing.is_set():
                self._lose(link, why)
        self._notify(self.on_close)

    def _poll_until_lost(self, link: L) -> str:
        """Poll the robot until it is lost; return the reason."""
        due = self._clock.now()
        while not self._closing.is_set():
            try:
                self._polled = time.monotonic()
                for poll in self.on_tick:
                    poll(link)
                self._reporter.report_once("tick", "")
            except CallFailed as error:
                self._reporter.report_once("tick", str(error))
            except (HardwareFailure, OSError) as error:
                return _reason(error)
            except BaseException as error:  # on this thread only the driver's own
                _logger.exception("checking the robot failed")
                return sentence(f"checking it failed: {error!r}")
            finally:
                self._polled = None
            if link.lost.is_set():
                return sentence("the connection broke")
            now = self._clock.now()
            due = max(due + self.limits.period, now)
            self._clock.wait(self._closing, due - now)
        return ""

    def _watch_polls(self) -> None:
        while not self._closing.wait(self.limits.retry):
            link, begun = self._link, self._polled
            if (
                link is not None
                and begun is not None
                and (took := time.monotonic() - begun) > self.limits.hang
            ):
                self._lose(link, f"asking it has hung for {took:.1f} s")

    def _lose(self, link: L, why: str) -> None:
        with self._losing:
            if self._link is not link:
                return
            self._link = None
        self._notify(self.on_lost, why)
        message = sentence(f"lost the robot: {why}; trying to find it again")
        self._reporter.report(Severity.Error, message, "lost", at_once=True)
        _close(link)

    def _find(self) -> None:
        try:
            link = self._open(_CONNECTION_LIMIT)
        except RobotError as error:
            self._reporter.report_once("finding", sentence(f"the robot is still lost: {error}"))
            return
        except BaseException as error:
            _logger.exception("finding the robot failed")
            self._reporter.report_once("finding", f"the robot is still lost: finding it failed: {error!r}")
            return
        self._link = link
        self._reporter.report_once("finding", "")
        self._notify(self.on_found)
        self._reporter.report(Severity.Info, sentence("found the robot again"), "found", at_once=True)

    def _notify(self, listeners: Iterable[Callable[..., None]], *news: str) -> None:
        for listener in listeners:
            try:
                listener(*news)
            except (Exception, SystemExit):
                _logger.exception("a part failed to handle the loss, the return or the end of the robot")


def _close(link: Link) -> None:
    """Close a link; that this fails hides nothing, and keeps nobody from opening it again."""
    try:
        link.close()
    except (Exception, SystemExit):
        _logger.exception("closing the link failed")


def _reason(error: Exception) -> str:
    """Return why a link failed, without the number of the system's error."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return str(error)


def join(thread: threading.Thread, seconds: float) -> None:
    """Wait for the end of a thread, if it was ever started; log if it still runs."""
    if thread.ident is not None:
        thread.join(seconds)
        if thread.is_alive():
            _logger.error("%s did not end within %g s", thread.name, seconds)
