"""A dead man's switch: a separate process that stops a real robot when its server is killed, or hangs.

It is for hardware that goes on to its goals, or walks, until somebody stops it, as NAOqi does. The server
reports to the switch over a pipe that it is alive, each time it has heard from the robot; the kernel reports
its end.
"""

from __future__ import annotations

import logging
import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Final, Generic, TypeVar

import msgspec

from naoserver.errors import HardwareFailure
from naoserver.hardware.connection import L
from zenoh_ice.data import typed

_logger = logging.getLogger(__name__)

_PERIOD: Final = 0.1
"""Seconds between two beats."""
_STOP_LIMIT: Final = 10.0
"""Seconds within which the robot must be stopped."""
_CONNECTION_LIMIT: Final = 2.0  # s
_END_LIMIT: Final = 3.0  # s
_BEAT: Final = b"."
_DONE: Final = b"q"
_LARGEST_MESSAGE: Final = 4096

A = TypeVar("A")


@dataclass(frozen=True, slots=True)
class SwitchLimits:
    """How long the switch waits, in s."""

    silence: float = 0.7
    """Without a beat until the robot is stopped."""
    repetition: float = 0.3
    """Until a stop that failed is repeated."""


_USUAL: Final = SwitchLimits()


class DeadMansSwitch:
    """The server's end of the switch. It acts only after the first `beat`, and not after `release`.

    `module` is run as a program, which calls `attend`; `address` says where the robot is.
    """

    def __init__(self, module: str, address: object) -> None:
        self._process: Final = subprocess.Popen(
            [sys.executable, "-P", "-m", module],
            stdin=subprocess.PIPE,
            start_new_session=True,  # what ends the server's group is not to end it
            bufsize=0,
        )
        assert self._process.stdin is not None
        self._pipe: Final = self._process.stdin
        self._beaten = 0.0
        self._broken = self._released = False
        self._pipe.write(msgspec.json.encode(address) + b"\n")  # others could see a login on a command line
        os.set_blocking(self._pipe.fileno(), False)

    def beat(self, _link: object) -> None:
        """Say that the server is alive and has heard from the robot."""
        now = time.monotonic()
        if self._broken or now - self._beaten < _PERIOD:
            return
        self._beaten = now
        try:
            self._pipe.write(_BEAT)
        except BrokenPipeError:
            self._broken = True
            _logger.error("the dead man's switch ended: nothing stops the robot if this server is killed")

    def release(self) -> None:
        """Let the switch end without stopping the robot, which has been stopped."""
        self._released = True
        with suppress(BrokenPipeError):
            self._pipe.write(_DONE)

    def close(self) -> None:
        """End the switch; unless it was released, it stops the robot first, which takes 13 s at most."""
        self._pipe.close()
        try:
            self._process.wait(_END_LIMIT if self._released else _STOP_LIMIT + _END_LIMIT)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait(_END_LIMIT)


Stops = Callable[[L], Sequence[Callable[[], object]]]
"""Return what stops the robot behind a new link, each part by itself; may raise HardwareFailure."""


def attend(address: type[A], connect: Callable[[A, float], L], stops: Stops[L]) -> None:
    """Be the process of a switch: read the robot's address of a type, and guard it."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)  # the server decides when it is done
    logging.basicConfig(format="%(asctime)s %(levelname)-8s %(name)s: %(message)s", level=logging.WARNING)
    pipe = sys.stdin.fileno()
    where = typed.from_json(_first_line(pipe), address)
    guard(pipe, lambda timeout: connect(where, timeout), stops)


def guard(pipe: int, connect: Callable[[float], L], stops: Stops[L], limits: SwitchLimits = _USUAL) -> None:
    """Stop the robot when beats stay away or the pipe breaks, until the server says that it is done.

    `connect` makes a link within some seconds.
    """
    robot = _Robot(connect, stops, limits)
    armed = False
    while True:
        heard = bool(select.select([pipe], [], [], limits.silence if armed else None)[0])
        news = os.read(pipe, _LARGEST_MESSAGE) if heard else b""
        ended = heard and not news
        if _DONE in news or (ended and not armed):
            return
        if news:
            if not armed:
                robot.find()
            armed = True
            continue
        trouble = robot.stop()
        # Not earlier: nobody may read the log while the server hangs, and a full pipe would block us.
        why = "ended without warning" if ended else "is silent"
        _logger.error("the server %s: the robot %s", why, trouble or "was stopped")
        if ended:
            return
        armed = False  # one stop for each silence: somebody else may command the robot then


class _Robot(Generic[L]):
    """The robot, over a link that the server does not share."""

    def __init__(self, connect: Callable[[float], L], stops: Stops[L], limits: SwitchLimits) -> None:
        self._connect = connect
        self._stops_of = stops
        self._limits = limits
        self._link: L | None = None
        self._stops: Sequence[Callable[[], object]] = ()

    def find(self) -> None:
        """Make a link, so that a stop need not wait for it; without one a stop tries again."""
        with suppress(HardwareFailure):
            self._linked()

    def stop(self) -> str:
        """Stop every part; try until that has succeeded, or for 10 s. Return what failed."""
        deadline = time.monotonic() + _STOP_LIMIT
        stopped: set[int] = set()
        trouble = "could not be stopped"
        while time.monotonic() < deadline:
            try:
                self._linked()
            except HardwareFailure as error:
                trouble = f"could not be stopped: {error}"
            else:
                for number, stop in enumerate(self._stops):
                    if number not in stopped:
                        try:
                            stop()
                        except HardwareFailure as error:
                            trouble = f"could not be stopped: {error}"
                        else:
                            stopped.add(number)
                if len(stopped) == len(self._stops):
                    return ""
            time.sleep(self._limits.repetition)
        return trouble

    def _linked(self) -> None:
        if self._link is None or self._link.lost.is_set():
            link = self._connect(_CONNECTION_LIMIT)
            try:
                self._stops = self._stops_of(link)
            except HardwareFailure:
                link.close()
                raise
            self._link = link  # not earlier: without its stops, the robot would count as stopped


def _first_line(pipe: int) -> bytes:
    line = b""
    while not line.endswith(b"\n") and (character := os.read(pipe, 1)):
        line += character
    return line
