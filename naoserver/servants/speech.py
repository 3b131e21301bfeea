"""Servant of the voice."""

from __future__ import annotations

from collections.abc import Callable

from interfaces.jderobot import InvalidValueException
from interfaces.nao import Speech, SpeechState
from naoserver.capabilities import Voice
from naoserver.servants.conversions import refusals_told
from naoserver.servants.streaming import Changes
from naoserver.voice import LONGEST_TEXT
from zenoh_ice import Current


class SpeechI(Speech):
    """Say texts, and tell what is being said. `robot_time` is in s."""

    def __init__(self, voice: Voice, robot_time: Callable[[], float]) -> None:
        self._voice = voice
        self._robot_time = robot_time
        self._changes = Changes()

    def say(self, text: str, current: Current) -> None:  # noqa: ARG002
        """Say a text after those that were asked for before. Raises InvalidValueException."""
        if not text.strip():
            raise InvalidValueException("text is empty: there is nothing to say", "text")
        if len(text) > LONGEST_TEXT:
            message = f"text has {len(text)} characters: at most {LONGEST_TEXT} are said at a time"
            raise InvalidValueException(message, "text")
        with refusals_told():
            self._voice.say(text)

    def stop(self, current: Current) -> None:  # noqa: ARG002
        """Fall silent, and forget what was not said yet."""
        self._voice.stop()

    def getSpeech(self, current: Current) -> SpeechState:  # noqa: ARG002
        """Return what is being said."""
        return self.read()

    @property
    def device(self) -> SpeechI:
        """Itself: nobody else tells of the voice."""
        return self

    @property
    def listening(self) -> bool:
        """Whether anybody listens to the stream."""
        return self.getSpeechPublisher.listening

    def read(self) -> SpeechState:
        """Return what is being said."""
        said = self._voice.utterance()
        return SpeechState(time=self._robot_time(), speaking=said.speaking, text=said.text, count=said.count)

    def publish(self, state: SpeechState) -> None:
        """Send what is being said to whoever listens, when it is news."""
        if self._changes.are_news((state.speaking, state.text, state.count), state.time):
            self.getSpeechPublisher.publish(state, time=state.time)
