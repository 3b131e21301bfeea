"""The lights and the voice: ALLeds and ALTextToSpeech."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace

from naoserver._naoqi_names import LIGHT_GROUPS
from naoserver.capabilities import Color, Utterance
from naoserver.errors import CommandRefused, HardwareFailure, InvalidCommand
from naoserver.expression import MOST_WAITING, FadingLights
from naoserver.naoqi._background_calls import BackgroundCalls
from naoserver.naoqi._connection import Connection, Reporter
from naoserver.naoqi._link import Link, LinkLost, Reply
from naoserver.parts import Lamp


class NaoqiLights(FadingLights):
    """The lights of a robot. Implements Lights; commands raise CommandRefused while the robot is lost.

    NAOqi does not report the state of lights: their state is the last command sent here.
    """

    def __init__(self, calls: BackgroundCalls, now: Callable[[], float], lamps: Mapping[str, Lamp]) -> None:
        super().__init__(now, lamps)
        self._calls = calls

    def set(self, name: str, color: Color, seconds: float) -> None:
        if self._lamps[name].single_colored:
            self._run("ALLeds.fade", LIGHT_GROUPS[name], max(color), seconds)
        else:
            red, green, blue = (round(255 * part) for part in color)
            self._run("ALLeds.fadeRGB", LIGHT_GROUPS[name], red << 16 | green << 8 | blue, seconds)
        super().set(name, color, seconds)

    def reset(self) -> None:
        self._run("ALLeds.reset", "AllLeds")
        super().reset()

    def _run(self, operation: str, *arguments: object) -> None:
        try:
            self._calls.run(operation, *arguments)
        except HardwareFailure as error:
            raise CommandRefused(str(error)) from error


class NaoqiVoice:
    """The voice of a robot. Implements Voice; a text begins at the cycle after the end of the previous one.

    `say` raises InvalidCommand when too many texts wait, CommandRefused while the robot is lost.
    """

    def __init__(self, connection: Connection, calls: BackgroundCalls, reporter: Reporter) -> None:
        self._connection = connection
        self._calls = calls
        self._reporter = reporter
        self._lock = threading.Lock()
        self._waiting: deque[str] = deque()
        self._saying: Reply | None = None
        self._utterance = Utterance()

    def say(self, text: str) -> None:
        with self._lock:
            link = self._connection.link
            if link is None:
                raise CommandRefused("the robot is not connected: it says nothing")
            if len(self._waiting) >= MOST_WAITING:
                raise InvalidCommand("text", f"{MOST_WAITING} texts are already waiting to be said")
            self._waiting.append(text)
            self._go_on(link)

    def stop(self) -> None:
        with self._lock:
            self._waiting.clear()
            if self._saying is None:
                return
        try:
            self._calls.run("ALTextToSpeech.stopAll", urgent=True)
        except LinkLost:
            self.forget()

    def utterance(self) -> Utterance:
        return self._utterance

    def tick(self, link: Link) -> None:
        """Begin the next text at the end of the previous one."""
        with self._lock:
            self._go_on(link)

    def forget(self) -> None:
        """Say nothing more: the robot is lost."""
        with self._lock:
            self._waiting.clear()
            self._saying = None
            self._utterance = replace(self._utterance, speaking=False)

    def _go_on(self, link: Link) -> None:
        if self._saying is not None:
            if not self._saying.done:
                return
            with self._reporter.failures_of("voice"):
                self._saying.result(0.0)
            self._saying = None
        if self._waiting:
            text = self._waiting.popleft()
            self._saying = link.begin("ALTextToSpeech.say", text)
            self._utterance = Utterance(text, speaking=True, count=self._utterance.count + 1)
        elif self._utterance.speaking:
            self._utterance = replace(self._utterance, speaking=False)
