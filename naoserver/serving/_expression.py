"""Servants of the lights, of the voice, of the loudspeaker, and of what is said to the robot."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Final

from interfaces import nao
from interfaces.jderobot import InvalidValueException
from naoserver.bodies.capabilities import Lights, Loudspeaker, Sound, Voice
from naoserver.protocol.expression import (
    HIGHEST_TONE,
    LONGEST_TEXT,
    LONGEST_TONE,
    LOWEST_TONE,
    SOUNDS,
    single_tone,
)
from naoserver.serving import _shared as shared
from zenoh_ice import Current
from zenoh_ice.data.text import sentence

_LONGEST_FADE: Final = 60.0  # s


class LedsI(nao.Leds):
    """Set the lights, and report what they show. `robot_time` is in s."""

    def __init__(self, lights: Lights, robot_time: Callable[[], float]) -> None:
        self._lights = lights
        self._robot_time = robot_time
        self.stream: Final = shared.stream_of(self._state, self.getLedsPublisher, "colors")

    def getLedNames(self, current: Current) -> list[str]:
        return list(self._lights.names)

    def setLed(self, name: str, color: nao.LedColor, seconds: float, current: Current) -> None:
        shared.require_known(sentence("light"), name, self._lights.names)
        shared.require_within(0.0, 1.0, red=color.red, green=color.green, blue=color.blue)
        shared.require_within(0.0, _LONGEST_FADE, seconds=seconds)
        with shared.refusals_raised():
            self._lights.set(name, (color.red, color.green, color.blue), seconds)

    def reset(self, current: Current) -> None:
        with shared.refusals_raised():
            self._lights.reset()

    def getLeds(self, current: Current) -> nao.LedState:
        return self._state()

    def _state(self) -> nao.LedState:
        colors = {name: nao.LedColor(*color) for name, color in self._lights.colors().items()}
        return nao.LedState(time=self._robot_time(), colors=colors)


class SpeechI(nao.Speech):
    """Say texts, and report the present utterance. `robot_time` is in s."""

    def __init__(self, voice: Voice, robot_time: Callable[[], float]) -> None:
        self._voice = voice
        self._robot_time = robot_time
        self.stream: Final = shared.stream_of(
            self._state, self.getSpeechPublisher, "speaking", "text", "count"
        )

    def say(self, text: str, current: Current) -> None:
        if not text.strip():
            raise InvalidValueException("text is empty: there is nothing to say", "text")
        if len(text) > LONGEST_TEXT:
            message = sentence(f"text has {len(text)} characters: at most {LONGEST_TEXT} are said at a time")
            raise InvalidValueException(message, "text")
        with shared.refusals_raised():
            self._voice.say(text)

    def stop(self, current: Current) -> None:
        self._voice.stop()

    def getSpeech(self, current: Current) -> nao.SpeechState:
        return self._state()

    def _state(self) -> nao.SpeechState:
        said = self._voice.utterance()
        return nao.SpeechState(
            time=self._robot_time(), speaking=said.speaking, text=said.text, count=said.count
        )


class SoundsI(nao.Sounds):
    """Play sounds and tones, and report the present one. `robot_time` is in s."""

    def __init__(self, loudspeaker: Loudspeaker, robot_time: Callable[[], float]) -> None:
        self._loudspeaker = loudspeaker
        self._robot_time = robot_time
        self.stream: Final = shared.stream_of(self._state, self.getSoundPublisher, "playing", "count")
        self.samples: Final = shared.stream_of(self._due, self.getSamplesPublisher, "count", "place")

    def getSounds(self, current: Current) -> list[nao.SoundFacts]:
        return [nao.SoundFacts(of.name, of.description, of.duration) for of in SOUNDS.values()]

    def play(self, name: str, loudness: float, current: Current) -> None:
        shared.require_known(sentence("sound"), name, SOUNDS)
        self._play(SOUNDS[name], loudness)

    def playTone(self, frequency: float, seconds: float, loudness: float, current: Current) -> None:
        shared.require_within(LOWEST_TONE, HIGHEST_TONE, frequency=frequency)
        shared.require_positive(LONGEST_TONE, seconds=seconds)
        self._play(single_tone(frequency, seconds), loudness)

    def stop(self, current: Current) -> None:
        self._loudspeaker.stop()

    def getSound(self, current: Current) -> nao.SoundState:
        return self._state()

    def getSamples(self, current: Current) -> nao.SoundSamples:
        return self._due()

    def _play(self, sound: Sound, loudness: float) -> None:
        shared.require_within(0.0, 1.0, loudness=loudness)
        with shared.refusals_raised():
            self._loudspeaker.play(sound, loudness)

    def _state(self) -> nao.SoundState:
        now = self._loudspeaker.playback()
        return nao.SoundState(
            time=self._robot_time(),
            playing=now.playing,
            name=now.name,
            loudness=now.loudness,
            tones=[nao.Tone(tone.frequency, tone.seconds) for tone in now.tones],
            count=now.count,
        )

    def _due(self) -> nao.SoundSamples:
        now = self._loudspeaker.playback()
        return nao.SoundSamples(self._robot_time(), now.count, now.place, now.samples)


class HearingI(nao.Hearing):
    """Report the sentences that `hear` gets. Thread-safe. `robot_time` is in s."""

    def __init__(self, robot_time: Callable[[], float]) -> None:
        self._robot_time = robot_time
        self._last = "", 0
        self._lock = threading.Lock()
        self.stream: Final = shared.stream_of(self._state, self.getHeardPublisher, "count")

    def hear(self, sentence: str) -> str:
        """Take a sentence. It recognizes no phrase in it, so the result is empty."""
        with self._lock:
            self._last = sentence.strip(), self._last[1] + 1
        return ""

    def getHeard(self, current: Current) -> nao.HeardState:
        return self._state()

    def _state(self) -> nao.HeardState:
        text, count = self._last
        return nao.HeardState(time=self._robot_time(), text=text, count=count)
