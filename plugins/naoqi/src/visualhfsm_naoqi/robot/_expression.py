"""The lights, the voice and the loudspeaker: ALLeds, ALTextToSpeech and ALAudioPlayer."""

from __future__ import annotations

import math
import threading
from abc import abstractmethod
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Generic, TypeVar

from naoserver.bodies.capabilities import Color, Playback, Sound, Tone, Utterance
from naoserver.bodies.parts import Lamp
from naoserver.errors import CommandRefused, HardwareFailure, InvalidCommand
from naoserver.hardware.connection import Reporter
from naoserver.protocol.expression import MOST_WAITING, FadingLights
from visualhfsm_naoqi._names import LIGHT_GROUPS
from visualhfsm_naoqi.robot.background import BackgroundCalls
from visualhfsm_naoqi.robot.calls import CallConnection, CallLink, Reply


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


T = TypeVar("T")


class _Queue(Generic[T]):
    """Calls of a service that run one after the other, and end by its `stopAll`.

    NAOqi may run two calls in either order, so each is begun after the answer to the one before.
    """

    def __init__(self, service: str, connection: CallConnection, reporter: Reporter) -> None:
        self._service = service
        self._connection = connection
        self._reporter = reporter
        self._lock = threading.Lock()
        self._waiting: deque[T] = deque()
        self._running: Reply | None = None
        self._stopping: Reply | None = None

    def tick(self, link: CallLink) -> None:
        """Begin the next call at the end of the one before."""
        with self._lock:
            self._go_on(link)

    def forget(self) -> None:
        """Begin nothing more: the robot is lost."""
        with self._lock:
            self._waiting.clear()
            self._running = self._stopping = None
            self._fall_silent()

    def _end(self, link: CallLink) -> None:
        """End the running call, and drop those that wait."""
        self._waiting.clear()
        if self._running is not None and not self._running.done and self._stopping is None:
            self._stopping = link.begin(f"{self._service}.stopAll")

    def _take_answer(self, reply: Reply | None) -> None:
        """Report the failure of a call that has ended."""
        if reply is not None:
            with self._reporter.failures_of(self._service):
                reply.result(0.0)

    @abstractmethod
    def _go_on(self, link: CallLink) -> None:
        """Begin what is due."""

    @abstractmethod
    def _fall_silent(self) -> None:
        """Note that nothing is heard any more."""


class NaoqiVoice(_Queue[str]):
    """The voice of a robot. Implements Voice; a text begins at the cycle after the end of the previous one.

    `say` raises InvalidCommand when too many texts wait, CommandRefused while the robot is lost.
    """

    def __init__(self, connection: CallConnection, reporter: Reporter) -> None:
        super().__init__("ALTextToSpeech", connection, reporter)
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
            if (link := self._connection.link) is not None:
                self._end(link)

    def utterance(self) -> Utterance:
        return self._utterance

    def _go_on(self, link: CallLink) -> None:
        is_saying = self._running is not None and not self._running.done
        if self._stopping is not None and self._stopping.done:
            self._take_answer(self._stopping)
            # A stop that came before the text is repeated.
            self._stopping = link.begin("ALTextToSpeech.stopAll") if is_saying else None
        if is_saying or self._stopping is not None:
            return
        self._take_answer(self._running)
        self._running = None
        if self._waiting:
            text = self._waiting.popleft()
            self._running = link.begin("ALTextToSpeech.say", text)
            self._utterance = Utterance(text, speaking=True, count=self._utterance.count + 1)
        else:
            self._fall_silent()

    def _fall_silent(self) -> None:
        self._utterance = replace(self._utterance, speaking=False)


class NaoqiLoudspeaker(_Queue[Tone]):
    """The loudspeaker of a robot. Implements Loudspeaker; `now` is in s.

    A tone is a call of `playSine`, which NAOqi answers at its end: of the signature `(iiif)`, with a
    frequency in Hz, a gain from 0 to 100, a pan of -1, 0 or 1 and a duration in s. The next tone begins at
    the cycle after that, not before its time. NAOqi documents `stopAll` for files: should a tone go on, it
    ends by itself, and what was begun meanwhile follows it.

    `play` raises CommandRefused while the robot is lost.
    """

    def __init__(self, connection: CallConnection, reporter: Reporter, now: Callable[[], float]) -> None:
        super().__init__("ALAudioPlayer", connection, reporter)
        self._now = now
        self._due = -math.inf  # when the present tone ends
        self._playback = Playback()

    def play(self, sound: Sound, loudness: float) -> None:
        with self._lock:
            link = self._connection.link
            if link is None:
                raise CommandRefused("the robot is not connected: it plays nothing")
            self._end(link)
            self._due = -math.inf
            self._waiting.extend(sound.tones)
            count = self._playback.count + 1
            self._playback = Playback(sound.name, sound.tones, loudness, playing=True, count=count)
            self._go_on(link)

    def play_samples(self, name: str, samples: bytes) -> int:
        del name, samples
        raise CommandRefused("this loudspeaker plays tones, not samples")

    def stop(self) -> None:
        with self._lock:
            if (link := self._connection.link) is not None:
                self._end(link)
                self._due = -math.inf
                self._go_on(link)

    def playback(self) -> Playback:
        return self._playback

    def _go_on(self, link: CallLink) -> None:
        for reply in (self._stopping, self._running):
            if reply is not None and not reply.done:
                return
        if self._now() < self._due:
            return
        self._take_answer(self._stopping)
        self._take_answer(self._running)
        self._stopping = self._running = None
        if self._waiting:
            tone = self._waiting.popleft()
            self._due = self._now() + tone.seconds
            if tone.frequency > 0.0:
                gain = round(100 * self._playback.loudness)
                sine = (round(tone.frequency), gain, 0, float(tone.seconds))
                self._running = link.begin("ALAudioPlayer.playSine", *sine)
        else:
            self._fall_silent()

    def _fall_silent(self) -> None:
        self._due = -math.inf
        self._playback = replace(self._playback, playing=False)
