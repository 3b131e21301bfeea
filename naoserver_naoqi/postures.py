"""The postures: ALRobotPosture's own way into each."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

from naoserver.capabilities import PostureProgress
from naoserver.errors import CommandRefused, HardwareFailure
from naoserver_naoqi.connection import Connection, Reporter
from naoserver_naoqi.errands import Errands, Question
from naoserver_naoqi.link import Link, LinkLost, Reply, call

_PERIOD: Final = 0.5
"""Seconds between two questions in which posture it is."""
_UNKNOWN: Final = "Unknown"


class NaoqiPostures:
    """The postures of a robot. Implements OwnPostures."""

    def __init__(
        self, connection: Connection, errands: Errands, reporter: Reporter, now: Callable[[], float]
    ) -> None:
        self._connection = connection
        self._errands = errands
        self._lock = threading.Lock()
        self._names: tuple[str, ...] = ()
        self._current = ""
        self._going: Reply | None = None
        self._stopped = False
        self._progress = PostureProgress()
        self.question: Final = Question(
            reporter, now, lambda: _PERIOD, self._take, "ALRobotPosture.getPosture"
        )
        """What is to be asked at every cycle."""

    @property
    def names(self) -> tuple[str, ...]:
        """The postures that the robot knows."""
        return self._names

    def open(self, link: Link) -> None:
        """Find out which postures the robot knows."""
        self._names = tuple(str(name) for name in call(link, "ALRobotPosture.getPostureList"))

    def go(self, name: str, fraction: float) -> None:
        """Begin to go to a posture at a fraction of full pace. Raises CommandRefused while it is lost."""
        with self._lock:
            link = self._connection.link
            if link is None:
                raise CommandRefused("the robot is not connected")
            self._going = link.begin("ALRobotPosture.goToPosture", name, fraction)
            self._stopped = False
            self._progress = PostureProgress(name, moving=True)

    def stop(self) -> None:
        """Stop on the way."""
        with self._lock:
            if self._going is None:
                return
            self._stopped = True
        try:
            self._errands.run("ALRobotPosture.stopMove")
        except LinkLost:
            self.forget()

    def current(self) -> str:
        """Return the posture that it is in; empty when it is in none."""
        return self._current

    def progress(self) -> PostureProgress:
        """Return how the newest way goes."""
        return self._progress

    def tick(self, _link: Link) -> None:
        """Look whether the way is at its end."""
        with self._lock:
            if self._going is None or not self._going.done:
                return
            going, self._going = self._going, None
            message = ""
            try:
                reached = bool(going.result(0.0))
            except HardwareFailure as error:
                reached, message = False, str(error)
            if not reached and not message:
                message = "it was stopped" if self._stopped else "the robot did not come there"
            self._progress = replace(self._progress, moving=False, reached=reached, message=message)

    def forget(self) -> None:
        """Take the way for ended: the robot is lost."""
        with self._lock:
            if self._going is not None:
                self._going = None
                self._progress = replace(self._progress, moving=False, message="the robot was lost")

    def _take(self, answer: Any, _asked: float) -> None:  # noqa: ANN401
        name = str(answer)
        self._current = name if name != _UNKNOWN and name in self._names else ""
