"""The right to command the robot: a lease, and an emergency stop that latches."""

from __future__ import annotations

import logging
import secrets
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from interfaces.nao import SafetyState, Severity
from naoserver.errors import CommandRefused, InvalidCommand
from naoserver.safety._commanders import Commanders
from naoserver.safety._event_log import EventLog
from naoserver.safety.latch import Latch
from zenoh_ice.application.kept_stop import KeptLease
from zenoh_ice.data.text import printable, sentence

_logger = logging.getLogger(__name__)

LONGEST_LEASE: Final = 60.0
"""Wall seconds for which a lease may be held without being renewed."""
_LONGEST_HOLDER: Final = 64
_LONGEST_REASON: Final = 200


@dataclass(frozen=True, slots=True)
class _Lease:
    client: str
    holder: str
    end: float
    """In steady wall time."""


@dataclass(frozen=True, slots=True)
class _Loss:
    why: str
    since: float
    """In steady wall time."""


class Gate:
    """Accept or refuse commands. Thread-safe.

    Code that commands the robot calls `require` under the same lock under which it stops, so that no command
    follows an emergency stop. A stop is never refused.

    A reset starts nothing: a client that commanded before or beside the stop is refused until a person lets
    it go on.

    With a `latch`, which is open, stop and lease are as the former server left them, and are kept for the
    next one. With `resumes`, all that a stop paused or refused goes on after each reset, not only when a
    person lets it.
    """

    def __init__(self, events: EventLog, latch: Latch | None = None, *, resumes: bool = False) -> None:
        self.events: Final = events
        """Events for the operator."""
        self.is_lost: Callable[[str], bool] = lambda _client: False
        """Return whether a client is gone: its commands that wait in the server are refused."""
        self._lock = threading.Lock()
        self._keeping = threading.Lock()  # of the latch, which the disk may delay
        self._latch = latch
        self._session = secrets.token_hex(8)
        self._was_reset = False
        self._resume_always: Final = resumes
        self._resumes = False
        self._stopped_times = 0
        self._stops: list[Callable[[], None]] = []
        self._resets: list[Callable[[], None]] = []
        self._commanders = Commanders()
        self._stop_reason: str | None = None
        self._lost: _Loss | None = None
        self._lease: _Lease | None = None
        if latch is not None:
            self._take_over(latch)

    def on_stop(self, stop: Callable[[], None]) -> None:
        """Call `stop` at every emergency stop, as soon as commands are refused."""
        self._stops.append(stop)

    def on_reset(self, end: Callable[[], None]) -> None:
        """Call `end` before each reset: it ends what would wait for it, though nobody has been refused."""
        self._resets.append(end)

    def require(self, client: str, *, begun: bool = False) -> None:
        """Raise CommandRefused unless a client may command the robot now.

        An empty client represents a caller that cannot hold a lease. What was `begun` before goes on when its
        client is gone, until the server has ended it; it is no command of the client.
        """
        if client and not begun and self.is_lost(client):
            self._report(Severity.Warning, sentence("refused a command: its client is gone"), "gone")
            raise CommandRefused("the client of this command is gone: its link to the robot broke")
        holder, kind = "", "refused"
        with self._lock:
            stopped = self._stop_reason is not None
            ended = not begun and self._commanders.note(client, stopped=stopped)
            if self._lost is not None:
                why = sentence(f"the robot is unreachable: {self._lost.why}")
                what = sentence("wait until it is found again")
            elif stopped:
                why = sentence(f"the robot is stopped: {self._stop_reason}")
                what = sentence("reset the emergency stop first")
            elif (lease := self._held()) and lease.client != client:
                holder = lease.holder
                why = sentence(f"the robot is held by {holder}")
                what = sentence("wait until the lease is given back")
            elif ended:
                kind, name = "ended", printable(client, _LONGEST_HOLDER) or sentence("callers without a name")
                why = sentence(f"the emergency stop ended the commands of {name}")
                what = sentence("start its program again, or let all go on: nao stop --reset --resume")
            else:
                return
        self._report(Severity.Warning, sentence(f"refused a command: {why}"), kind)
        raise CommandRefused("; ".join((why, what)), holder)

    def stop(self, reason: str) -> None:
        """Refuse every command until `reset`, and stop everything that moves.

        Every stop is tried, even if another one fails; the first failure is raised at the end. It lasts until
        `reset`, in the next server of the robot, too.
        """
        reason = "".join(each if each.isprintable() else " " for each in reason[:_LONGEST_REASON])
        reason = reason.strip() or sentence("emergency stop")
        with self._lock:
            self._stop_reason = reason
            self._stopped_times += 1
            self._resumes = False
            self._commanders.stop()
        failure = self._stop_all()
        # Not earlier: a log may block.
        self._report(Severity.Error, sentence(f"emergency stop: {reason}"), "stop")
        self._keep()
        if failure is not None:
            raise failure

    def stop_again(self) -> None:
        """If the robot is stopped, stop all that moves once more: it may have missed that."""
        if self._stop_reason is not None:
            self._stop_all()

    def reset(self, *, resume: bool = False) -> None:
        """Accept commands again after an emergency stop; with `resume`, what it paused or refused may go on.

        ISO 13850:2015, 4.1.4: the reset alone does not start the machine again.
        """
        for end in self._resets:
            end()
        with self._lock:
            was_stopped, self._stop_reason = self._stop_reason is not None, None
            self._was_reset = True
            self._resumes = resume or self._resume_always
            if self._resumes:
                self._commanders.let_go_on()
        if was_stopped:
            self._keep()
            self._report(Severity.Info, sentence("the emergency stop was reset"), "reset")

    def let_go_on(self, client: str) -> None:
        """Accept the commands of a client again that a stop ended: after the reset a person lets it go on."""
        with self._lock:
            if self._stop_reason is None:
                self._commanders.let_go_on(client)

    def lose(self, why: str) -> None:
        """Refuse every command until `find`, because no command reaches the robot."""
        with self._lock:
            since = self.events.wall_time() if self._lost is None else self._lost.since
            self._lost = _Loss(why or "its server does not reach it", since)

    def find(self) -> None:
        """Accept commands again, unless the robot is stopped: they reach it."""
        with self._lock:
            self._lost = None
        self.stop_again()

    def acquire(self, client: str, holder: str, seconds: float) -> None:
        """Hold the robot for a client, called `holder`, or renew its lease.

        Raises InvalidCommand, and CommandRefused while another client holds it, and of a caller without name.
        """
        if not 0.0 < seconds <= LONGEST_LEASE:
            message = sentence(
                f"seconds is {seconds:g}: a lease lasts more than 0 s and at most {LONGEST_LEASE:g} s"
            )
            raise InvalidCommand("seconds", message)
        if not holder.isprintable() or not holder.strip() or len(holder) > _LONGEST_HOLDER:
            message = sentence(f"holder must be a name of 1 to {_LONGEST_HOLDER} printable characters")
            raise InvalidCommand("holder", message)
        if not client:  # nobody would notice its end, and all that say as little would hold it together
            raise CommandRefused("a lease is for a client that keeps a link: this call names none")
        with self._lock:
            if (lease := self._held()) and lease.client != client:
                message = sentence(f"the robot is held by {lease.holder}; wait until it is given back")
                raise CommandRefused(message, lease.holder)
            new = lease is None
            self._lease = _Lease(client, holder, self.events.wall_time() + seconds)
        self._keep()
        if new:
            self._report(Severity.Info, sentence(f"{holder} holds the robot"), "lease")

    def release(self, client: str) -> bool:
        """Give back the lease of a client, which may be lost; return whether it held one."""
        with self._lock:
            lease = self._lease
            if lease is None or lease.client != client:
                return False
            self._lease = None
        self._keep()
        self._report(Severity.Info, sentence(f"{lease.holder} no longer holds the robot"), "lease")
        return True

    @property
    def stops(self) -> int:
        """How often the robot was stopped: what began before a stop does not go on after its reset."""
        return self._stopped_times

    @property
    def is_stopped(self) -> bool:
        """Whether the emergency stop is latched."""
        return self._stop_reason is not None

    @property
    def is_robot_lost(self) -> bool:
        """Whether no command reaches the robot."""
        return self._lost is not None

    def state(self) -> SafetyState:
        """Return who may command the robot now."""
        with self._lock:
            lease = self._held()
            return SafetyState(
                time=self.events.robot_time(),
                stopped=self._stop_reason is not None,
                reason=self._stop_reason or "",
                holder=lease.holder if lease else "",
                remaining=lease.end - self.events.wall_time() if lease else 0.0,
                session=self._session,
                wasReset=self._was_reset,
                stops=self._stopped_times,
                resumes=self._resumes,
                lost=self._lost.why if self._lost else "",
                lostFor=self.events.wall_time() - self._lost.since if self._lost else 0.0,
            )

    def _stop_all(self) -> BaseException | None:
        """Stop every part, whatever fails; return the first failure. A driver may even call `sys.exit`."""
        failure: BaseException | None = None
        for stop in self._stops:
            try:
                stop()
            except BaseException as error:
                _logger.exception("a part of the robot could not be stopped")
                failure = failure or error
        return failure

    def _take_over(self, latch: Latch) -> None:
        """Begin with the stop and the lease that the former server left."""
        kept = latch.found
        if kept.stop:
            self._stop_reason = kept.stop
            self._stopped_times = 1
            message = sentence(
                f"still stopped: {kept.stop}; reset the emergency stop before the robot may move"
            )
            self._report(Severity.Error, message, "stop")
        if kept.lease:
            left = min(kept.lease.until - time.time(), LONGEST_LEASE)  # below 0 when it has ended
            self._lease = _Lease(kept.lease.client, kept.lease.holder, self.events.wall_time() + left)

    def _keep(self) -> None:
        """Keep stop and lease for the next server."""
        if self._latch is None:
            return
        with self._keeping:  # one after the other, so that the newest is left
            with self._lock:
                stop, lease = self._stop_reason or "", self._lease
            kept = None
            if lease:
                until = time.time() + lease.end - self.events.wall_time()
                kept = KeptLease(lease.client, lease.holder, until)
            try:
                self._latch.keep(stop, kept)
            except OSError as error:
                what = sentence(f"the emergency stop cannot be kept in {self._latch.path}: {error.strerror}")
                then = sentence("after a restart the robot is stopped in any case")
                self._report(Severity.Error, f"{what}; {then}", "latch")

    def _report(self, level: Severity, message: str, kind: str) -> None:
        self.events.add(level, "Safety", message, kind)

    def _held(self) -> _Lease | None:
        """Return the lease that somebody has now."""
        if self._lease is not None and self.events.wall_time() >= self._lease.end:
            self._lease = None
        return self._lease
