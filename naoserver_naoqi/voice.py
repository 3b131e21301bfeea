"""The voice: ALTextToSpeech."""

from __future__ import annotations

import threading
from collections import deque

from naoserver.capabilities import Utterance
from naoserver.errors import CommandRefused, HardwareFailure, InvalidCommand
from naoserver.voice import MOST_WAITING
from naoserver_naoqi.connection import Connection
from naoserver_naoqi.errands import Errands
from naoserver_naoqi.link import Link, LinkLost, Reply
from naoserver_naoqi.reporter import Reporter

__all__ = ["NaoqiVoice"]


class NaoqiVoice:
    """The voice of a robot. Implements Voice; a text begins at the cycle after the end of the one before."""

    def __init__(self, connection: Connection, errands: Errands, reporter: Reporter) -> None:
        self._connection = connection
        self._errands = errands
        self._reporter = reporter
        self._lock = threading.Lock()
        self._waiting: deque[str] = deque()
        self._saying: Reply | None = None
        self._utterance = Utterance()

    def say(self, text: str) -> None:
        """Say a text after those that were asked for before.

        Raises InvalidCommand when too many wait, CommandRefused while the robot is lost.
        """
        with self._lock:
            link = self._connection.link
            if link is None:
                raise CommandRefused("the robot is not connected: it says nothing")
            if len(self._waiting) >= MOST_WAITING:
                raise InvalidCommand("text", f"{MOST_WAITING} texts wait to be said already")
            self._waiting.append(text)
            self._go_on(link)

    def stop(self) -> None:
        """Fall silent, and forget what was not said yet."""
        with self._lock:
            self._waiting.clear()
            if self._saying is None:
                return
        try:
            self._errands.run("ALTextToSpeech.stopAll")
        except LinkLost:
            self.forget()

    def utterance(self) -> Utterance:
        """Return what is being said."""
        return self._utterance

    def tick(self, link: Link) -> None:
        """Begin the next text when one was said."""
        with self._lock:
            self._go_on(link)

    def forget(self) -> None:
        """Say nothing more: the robot is lost."""
        with self._lock:
            self._waiting.clear()
            self._saying = None
            self._utterance = Utterance(self._utterance.text, speaking=False, count=self._utterance.count)

    def _go_on(self, link: Link) -> None:
        if self._saying is not None:
            if not self._saying.done:
                return
            try:
                self._saying.result(0.0)
                self._reporter.tell_once("voice", "")
            except HardwareFailure as error:
                self._reporter.tell_once("voice", str(error))
            self._saying = None
        if self._waiting:
            text = self._waiting.popleft()
            self._saying = link.begin("ALTextToSpeech.say", text)
            self._utterance = Utterance(text, speaking=True, count=self._utterance.count + 1)
        elif self._utterance.speaking:
            self._utterance = Utterance(self._utterance.text, speaking=False, count=self._utterance.count)
