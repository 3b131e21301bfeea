"""ALTextToSpeech and ALAnimatedSpeech: the voice."""

from __future__ import annotations

import re
import threading
from typing import Final

from naoserver.capabilities import Voice
from naoserver.errors import HardwareFailure, InvalidCommand
from naoserver.expression import LONGEST_TEXT
from naoserver_qi.arguments import chosen, number, number_within, text
from naoserver_qi.calls import Call
from naoserver_qi.memory import ALMemory

_LOOK: Final = 0.05
"""Robot seconds between two looks whether a text was said."""
_TAG: Final = re.compile(r"\\\w+(=[^\\]*)?\\")
"""NAOqi's tags for pauses, speed and pitch in a text."""
_ANIMATION: Final = re.compile(r"\^\w+(\([^)^]*\))?")
_VOICES: Final = {
    "English": "naoenu",
    "French": "naofrf",
    "German": "naoged",
    "Italian": "naoiti",
    "Spanish": "naospe",
}
"""The voice of each language."""
_MOST_PARAMETERS: Final = 50


class ALTextToSpeech:
    """Say texts; tags for pauses and pitch are left out."""

    def __init__(self, voice: Voice | None, memory: ALMemory) -> None:
        """Serve a voice; None makes every command fail."""
        self._found = voice
        self._memory = memory
        self._turn = threading.Lock()
        self._language = "English"
        self._volume = 0.7
        self._parameters: dict[str, float] = {}

    @property
    def _voice(self) -> Voice:
        if self._found is None:
            raise HardwareFailure("this robot has no voice")
        return self._found

    def say(self, call: Call, stringToSay: object, language: object = None) -> None:
        """Say a text after the earlier ones; return when it was said."""
        if language is not None:
            chosen(language, "language", _VOICES)
        words = _TAG.sub(" ", text(stringToSay, "text")).strip()
        if len(words) > LONGEST_TEXT:
            raise InvalidCommand("text", f"the text has {len(words)} characters, more than {LONGEST_TEXT}")
        voice = self._voice
        while not self._turn.acquire(timeout=0.1):
            if call.stopped.is_set():
                return
        try:
            if not words or call.stopped.is_set():
                return
            before = voice.utterance().count
            voice.say(words)
            self._memory.raiseEvent("ALTextToSpeech/CurrentSentence", words)
            self._memory.raiseEvent("ALTextToSpeech/TextStarted", 1)
            while (now := voice.utterance()).speaking or now.count == before:
                if call.wait(_LOOK):
                    voice.stop()
            self._memory.raiseEvent("ALTextToSpeech/TextStarted", 0)
            self._memory.raiseEvent("ALTextToSpeech/TextDone", 1)
        finally:
            self._turn.release()

    def stopAll(self) -> None:
        """Fall silent, and forget what was not said yet."""
        self._voice.stop()

    def setLanguage(self, pLanguage: object) -> None:
        """Remember the language, in which texts are taken as they are."""
        self._language = chosen(pLanguage, "language", _VOICES)

    def getLanguage(self) -> str:
        """Return the language."""
        return self._language

    def getAvailableLanguages(self) -> list[str]:
        """Return the languages that can be set."""
        return list(_VOICES)

    def setVolume(self, volume: object) -> None:
        """Remember the volume from 0 to 1."""
        self._volume = number_within(volume, "volume", 0.0, 1.0)

    def getVolume(self) -> float:
        """Return the volume from 0 to 1."""
        return self._volume

    def getAvailableVoices(self) -> list[str]:
        """Return the names of the voices, one of each language."""
        return list(_VOICES.values())

    def getVoice(self) -> str:
        """Return the voice, that of the language."""
        return _VOICES[self._language]

    def setVoice(self, voiceID: object) -> None:
        """Remember a voice, and its language."""
        voice = chosen(voiceID, "voice", _VOICES.values())
        self._language = next(language for language, name in _VOICES.items() if name == voice)

    def setParameter(self, pEffectName: object, pEffectValue: object) -> None:
        """Remember a parameter of the voice, such as `speed`, which has no effect."""
        name, value = text(pEffectName, "name"), number(pEffectValue, "value")
        if len(self._parameters) < _MOST_PARAMETERS or name in self._parameters:
            self._parameters[name] = value

    def getParameter(self, pParameterName: object) -> float:
        """Return a parameter of the voice; 0 for one that was not set."""
        return self._parameters.get(text(pParameterName, "name"), 0.0)

    def resetSpeed(self) -> None:
        """Forget the parameter `speed`."""
        self._parameters.pop("speed", None)


class ALAnimatedSpeech:
    """Say texts without the tags of animations."""

    def __init__(self, speech: ALTextToSpeech) -> None:
        self._speech = speech

    def say(self, call: Call, text_: object, _configuration: object = None) -> None:
        """Say a text; returns when it was said."""
        self._speech.say(call, _ANIMATION.sub(" ", text(text_, "text")))
