"""Stop the robot: at once, or at a key from a terminal that holds its link open.

A new process has to connect before it can stop anything, which fails first on a network that is
busy or under attack. The emergency stop of a person who watches is therefore a terminal that connected
in advance.
"""

from __future__ import annotations

import os
import select
import sys
import termios
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Final

import typer

from nao_tools import NaoError
from nao_tools._connection import loss, wait_for_servant
from nao_tools._output import lost_text, print_json
from nao_tools._stopping import OWN_SWITCH, STOP_LIMITS, Realm, StopLimits, Stopping
from nao_tools._values import Json
from zenoh_ice import Communicator, ZenohIceError, initialize
from zenoh_ice.application import emergency_stop
from zenoh_ice.application.emergency_stop import SAFETY, begin_stop
from zenoh_ice.settings import Settings

_STOPPED: Final = "the robot refuses commands until `nao stop --reset`"
_LATER: Final = "it is stopped once its server finds it"
_NO_LINK: Final = "no link was made"
_CHECK_PERIOD: Final = 0.1  # s between two checks of the link
_STOP_PERIOD: Final = 0.2  # s until a stop that failed is sent again
_STOP_KEYS: Final = b"\r\n "
_CTRL_C: Final = b"\x03"
_LEAVE: Final = b"q"


def stop(
    settings: Settings, reason: str, seconds: float, *, as_json: bool, limits: StopLimits = STOP_LIMITS
) -> None:
    """Stop the robot of a realm.

    Raises NaoError when it has not confirmed within some seconds that it has stopped, goes on moving, or is
    out of its server's reach.
    """
    stopping = Stopping(settings, reason, limit=seconds, limits=limits)
    stopping.run(_report)
    realm = stopping.realms[settings.realm]
    if not realm.confirmed:
        _stop_by_a_call(settings, reason, stopping)
    if as_json:
        print_json(_result(stopping))
    elif stopping.succeeded:
        typer.echo(_outcome(realm))
    if not realm.confirmed:
        raise NaoError(f"the robot was NOT stopped: {realm.trouble}; {OWN_SWITCH}")
    if not realm.still:
        raise NaoError(_outcome(realm))


def stop_all(
    settings: Settings, reason: str, seconds: float, *, as_json: bool, limits: StopLimits = STOP_LIMITS
) -> None:
    """Stop the robots of all realms that can be reached, and list each with its result.

    Raises NaoError when one of them, or an endpoint, has not confirmed within some seconds.
    """
    stopping = Stopping(settings, reason, limit=seconds, every_realm=True, limits=limits)
    stopping.run(_report)
    if as_json:
        print_json(_result(stopping))
    else:
        for realm in stopping.concerned:
            typer.echo(f"{realm.name}: {_outcome(realm)}")
        for route in stopping.unreached:
            typer.echo(f"{route.name}: NOT reached: {route.trouble or _NO_LINK}")
    if not stopping.concerned and not stopping.unreached:
        raise NaoError("no robot was found, so none was stopped")
    if not stopping.succeeded:
        raise NaoError(f"not every robot was stopped, see above; {OWN_SWITCH}")


def reset(settings: Settings, *, resume: bool, as_json: bool) -> None:
    """Let the robot accept commands again, and with `resume` all go on; raises what a call raises."""
    with initialize(settings) as communicator:
        wait_for_servant(communicator, SAFETY)
        emergency_stop.reset(communicator, resume=resume)
    if as_json:
        print_json({"robots": [{"realm": settings.realm, "stopped": False}]})
    else:
        go_on = (
            "paused behaviors go on, and programs that commanded on"
            if resume
            else "behaviors go on when a person lets them (Run, F8), programs that commanded on after a pause"
        )
        typer.echo(f"reset: the robot accepts commands again; {go_on}")


def _result(stopping: Stopping) -> Json:
    """Return for programs which robots have stopped, and which endpoints were not reached."""
    return {
        "robots": [
            {
                "realm": realm.name,
                "stopped": realm.confirmed,
                "still": realm.still,
                "fastestJoint": realm.speed,
                "lost": realm.lost or "",
                "lostFor": realm.lost_for,
                "trouble": "" if realm.confirmed else realm.trouble,
            }
            for realm in stopping.concerned
        ],
        "unreached": [
            {"endpoint": route.name, "trouble": route.trouble or _NO_LINK} for route in stopping.unreached
        ],
    }


def _report(text: str) -> None:
    with suppress(OSError):  # nobody reads it any more, and the stop goes on
        typer.echo(text, err=True)


def _outcome(realm: Realm) -> str:
    if not realm.confirmed:
        return f"NOT stopped: {realm.trouble or 'no answer'}"
    if realm.lost:
        return f"stopped, but the robot is {lost_text(realm.lost, realm.lost_for)}: look at it; {_LATER}"
    if realm.moving:
        return (
            f"stopped, but its joints still move, the fastest at {realm.speed:.1f} rad/s: look at the robot"
        )
    known = realm.speed is not None and realm.lost is not None
    return f"stopped: {_STOPPED}{'; its joints are still' if known else ''}"


def _stop_by_a_call(settings: Settings, reason: str, stopping: Stopping) -> None:
    """Try once more, in a way that finds out why nothing answers; note the result."""
    realm = stopping.realms[settings.realm]
    if not realm.trouble and len(stopping.unreached) == len(stopping.routes):
        realm.trouble = "; ".join(route.trouble for route in stopping.unreached if route.trouble)
    if realm.trouble:
        return
    try:
        with initialize(settings) as communicator:
            wait_for_servant(communicator, SAFETY)
            begin_stop(communicator, reason, settings.timeout).result()
    except ZenohIceError as error:
        realm.trouble = str(error)
    else:
        realm.confirm()


def hold(settings: Settings, reason: str) -> None:
    """Hold a link open and stop the robot at a key, until the person at the terminal leaves.

    Raises NaoError without a terminal, and NaoError after a failed stop.
    """
    if not sys.stdin.isatty():
        raise NaoError("--ready waits for a key, so it needs a terminal; without it nao stop stops at once")
    with _single_keys(sys.stdin.fileno()) as terminal, initialize(settings) as communicator:
        _StopButton(communicator, reason).serve(terminal)


class _StopButton:
    """A stop that is ready to be sent: it follows the robot's link, and sends until the robot has stopped."""

    def __init__(self, communicator: Communicator, reason: str) -> None:
        self._communicator: Final = communicator
        self._reason: Final = reason
        self._ready = False
        self._searched = False
        self._was_ready = False
        self._pressed_at: float | None = None  # until the robot has stopped
        self._failure = ""
        self._said = ""

    def serve(self, terminal: int) -> None:
        """Follow the link and the keys; raises NaoError at the end when a stop has failed."""
        leaving = False
        while True:
            self._follow()
            if self._pressed_at is not None:
                self._send()
            if leaving and self._pressed_at is None:
                return
            keys = _read_keys(terminal, _CHECK_PERIOD if self._pressed_at is None else _STOP_PERIOD)
            if _CTRL_C in keys and not leaving:
                leaving = True
                self._press()
            elif any(key in _STOP_KEYS for key in keys):
                self._press()
            elif _LEAVE in keys or _CTRL_C in keys:
                if self._pressed_at is not None:
                    raise NaoError(f"the robot was NOT stopped: {self._failure}; {OWN_SWITCH}")
                return

    def _press(self) -> None:
        self._said = ""  # another press is answered again
        self._pressed_at = time.monotonic()

    def _follow(self) -> None:
        """Notice whether the robot is online, and when it is back."""
        present = SAFETY in self._communicator.identities()
        if self._ready and not present:
            self._ready = False
            self._say("LOST: the robot is unreachable; a stop will be sent when it is back")
        elif not self._ready and (present or not self._searched):
            self._searched = True  # if nobody is known, only once: it takes seconds in which no key is read
            try:
                wait_for_servant(self._communicator, SAFETY)
            except ZenohIceError as error:
                self._say(f"not ready: {error}")
                return
            self._ready = True
            self._say(
                f"ready{' again' if self._was_ready else ''}: Enter or space stops the robot of realm "
                f"{self._communicator.realm}; Ctrl-C stops it and leaves; q leaves without a stop"
            )
            self._was_ready = True

    def _send(self) -> None:
        assert self._pressed_at is not None
        try:
            # Whether or not its token is there: under a flood of tokens it may be late.
            begin_stop(self._communicator, self._reason, self._communicator.settings.timeout).result()
        except ZenohIceError as error:
            self._failure = str(error) if self._ready else "the robot is unreachable"
            self._say(f"NOT STOPPED: {self._failure}; trying again until it is; {OWN_SWITCH}")
            return
        took = time.monotonic() - self._pressed_at
        self._pressed_at = None
        lost = loss(self._communicator, self._communicator.servants())
        what = f"but the robot is {lost}: look at it; {_LATER}" if lost else _STOPPED
        self._say(f"STOPPED after {took:.2f} s{',' if lost else ':'} {what}")

    def _say(self, text: str) -> None:
        if text != self._said:
            self._said = text
            typer.echo(text)


@contextmanager
def _single_keys(terminal: int) -> Iterator[int]:
    """Make a terminal pass on each key at once, Ctrl-C included, until the end of a `with` block."""
    before = termios.tcgetattr(terminal)
    single = termios.tcgetattr(terminal)
    single[3] &= ~(termios.ICANON | termios.ECHO | termios.ISIG)
    termios.tcsetattr(terminal, termios.TCSADRAIN, single)
    try:
        yield terminal
    finally:
        termios.tcsetattr(terminal, termios.TCSADRAIN, before)


def _read_keys(terminal: int, seconds: float) -> bytes:
    """Return the keys pressed within some seconds; raises NaoError when the terminal is closed."""
    ready, _, _ = select.select([terminal], [], [], seconds)
    if not ready:
        return b""
    try:
        keys = os.read(terminal, 64)
    except OSError:
        keys = b""
    if not keys:
        raise NaoError("the terminal was closed; this did not stop the robot")
    return keys
