"""Keep the connection to a robot: poll it at a fixed rate, report its loss, and reconnect."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final

from interfaces.nao import Severity
from naoserver._event_log import EventLog
from naoserver.errors import HardwareFailure, RobotError
from naoserver.naoqi._link import CallFailed, CallTimeout, Link, LinkLost
from zenoh_ice import Clock

_logger = logging.getLogger(__name__)

_SOURCE: Final = "NAOqi"


class Reporter:
    """Pass events on to an event log, which also writes them to the log; without one, only to the log."""

    def __init__(self) -> None:
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
            _logger.log(logging.getLevelNamesMapping()[level.name.upper()], "%s: %s", _SOURCE, message)
            return
        self._events.add(level, _SOURCE, message, kind or message)
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


@dataclass(frozen=True, slots=True)
class NaoqiLimits:
    """How often a robot is asked, and how long it is waited for, in s."""

    period: float = 0.02
    """Between two polls of the robot: NAOqi's own cycle."""
    answer: float = 1.0
    """Until the next command is sent without an answer to the one before."""
    retry: float = 0.5
    """Between two attempts to find a robot that is lost."""
    silence: float = 0.7
    """Without an answer until the robot counts as lost, so that it is reported within 1 s."""
    repetition: float = 0.3
    """Until a stop that failed is sent again."""
    picture: float = 0.9
    """For a picture of a camera."""
    end: float = 2.0
    """For the commands that have still to be carried out at the end."""


_CONNECTION_LIMIT: Final = 2.0  # s
_FIRST_CONNECTION_LIMIT: Final = 5.0  # s
_END_LIMIT: Final = 5.0  # s


class Connection:
    """The connection to one robot, from `start` to `close`.

    `connect` makes a link within some seconds, or raises LinkLost. Each of `on_open` prepares a new link, and
    may refuse it with a RobotError; each of `on_tick` polls the robot at its period; each of `on_found` and
    `on_lost` is called when a link is made or lost. `start` calls the first two before
    it returns. All other calls run on one thread, so that they never overlap.
    """

    def __init__(
        self, connect: Callable[[float], Link], clock: Clock, reporter: Reporter, limits: NaoqiLimits
    ) -> None:
        self.limits: Final = limits
        self.on_open: Final[list[Callable[[Link], None]]] = []
        self.on_tick: Final[list[Callable[[Link], None]]] = []
        self.on_found: Final[list[Callable[[], None]]] = []
        self.on_lost: Final[list[Callable[[str], None]]] = []
        self._connect = connect
        self._clock = clock
        self._reporter = reporter
        self._link: Link | None = None
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="NAOqi", daemon=True)

    @property
    def link(self) -> Link | None:
        """The link to the robot; None while it is lost."""
        link = self._link
        return None if link is None or link.lost.is_set() else link

    def require(self) -> Link:
        """Return the link to the robot. Raises LinkLost."""
        link = self.link
        if link is None:
            raise LinkLost("the robot is not connected")
        return link

    def start(self) -> None:
        """Connect, and poll the robot from then on. Raises RobotError when it cannot be reached."""
        self._link = self._open(_FIRST_CONNECTION_LIMIT)
        try:
            for look in self.on_tick:
                look(self._link)
        except RobotError:
            self._link.close()
            raise
        self._thread.start()

    def close(self) -> None:
        """Disconnect, and end the thread; does nothing the second time."""
        self._closing.set()
        join(self._thread, _END_LIMIT)
        link, self._link = self._link, None
        if link is not None:
            link.close()

    def _open(self, timeout: float) -> Link:
        link = self._connect(timeout)
        try:
            for prepare in self.on_open:
                prepare(link)
        except BaseException:
            link.close()
            raise
        return link

    def _run(self) -> None:
        while not self._closing.is_set():
            link = self._link
            if link is None:
                self._closing.wait(self.limits.retry)
                self._find()
            elif (why := self._look_after(link)) and not self._closing.is_set():
                self._lose(link, why)

    def _look_after(self, link: Link) -> str:
        """Poll the robot until it is lost; return the reason."""
        due = self._clock.now()
        while not self._closing.is_set():
            try:
                for look in self.on_tick:
                    look(link)
                self._reporter.report_once("tick", "")
            except (LinkLost, CallTimeout) as error:
                return str(error)
            except CallFailed as error:
                self._reporter.report_once("tick", str(error))
            except Exception as error:
                _logger.exception("checking the robot failed")
                return f"checking it failed: {error}"
            if link.lost.is_set():
                return "the connection broke"
            now = self._clock.now()
            due = max(due + self.limits.period, now)
            self._clock.wait(self._closing, due - now)
        return ""

    def _lose(self, link: Link, why: str) -> None:
        self._link = None
        self._notify(self.on_lost, why)
        message = f"lost the robot: {why}; trying to find it again"
        self._reporter.report(Severity.Error, message, "lost", at_once=True)
        link.close()

    def _find(self) -> None:
        try:
            link = self._open(_CONNECTION_LIMIT)
        except RobotError as error:
            self._reporter.report_once("finding", f"the robot is still lost: {error}")
            return
        except Exception:
            _logger.exception("finding the robot failed")
            return
        self._link = link
        self._reporter.report_once("finding", "")
        self._notify(self.on_found)
        self._reporter.report(Severity.Info, "found the robot again", "found", at_once=True)

    def _notify(self, listeners: Iterable[Callable[..., None]], *news: str) -> None:
        for listener in listeners:
            try:
                listener(*news)
            except Exception:
                _logger.exception("a part failed to handle the loss or return of the robot")


def join(thread: threading.Thread, seconds: float) -> None:
    """Wait for the end of a thread, if it was ever started; log if it still runs."""
    if thread.ident is not None:
        thread.join(seconds)
        if thread.is_alive():
            _logger.error("%s did not end within %g s", thread.name, seconds)
