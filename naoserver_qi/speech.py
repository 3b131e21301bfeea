"""ALTextToSpeech and ALAnimatedSpeech: the voice."""

from __future__ import annotations

import re
import threading
from itertools import count
from typing import Final

from naoserver.capabilities import Voice
from naoserver.errors import InvalidCommand
from naoserver.expression import LONGEST_TEXT
from naoserver_qi.access import Access, Service, needed
from naoserver_qi.arguments import chosen, constant, kept, number, one_of, text, within
from naoserver_qi.clients import Activity, Call, begins, begins_any
from naoserver_qi.memory import ALMemory
from naoserver_qi.modules import LOOK

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
_LANGUAGE: Final = one_of("language", _VOICES)


class ALTextToSpeech(Service):
    """Say texts; tags for pauses and pitch are left out."""

    setLanguage, getLanguage = kept("the language", "English", pLanguage=_LANGUAGE)
    setVolume, getVolume = kept("the volume from 0 to 1", 0.7, volume=within(0.0, 1.0))
    setParameter, getParameter = kept(
        "a parameter of the voice, such as `speed`", 0.0, pEffectName=text, pEffectValue=number
    )

    def __init__(self, access: Access) -> None:
        super().__init__(access)
        self._speaking = threading.Lock()
        self._numbers = count(1)
        self._report(0, "done")

    getAvailableLanguages = constant("Return the languages that can be set.", list(_VOICES))
    getAvailableVoices = constant("Return the names of the voices.", list(_VOICES.values()))

    @begins(Activity.SPEECH)
    def say(self, call: Call, stringToSay: object, language: object = None) -> None:
        """Say a text after the earlier ones; return when it has been said."""
        if language is not None:
            _LANGUAGE(language, "language")
        words = _TAG.sub(" ", text(stringToSay, "text")).strip()
        if len(words) > LONGEST_TEXT:
            raise InvalidCommand("text", f"the text has {len(words)} characters, more than {LONGEST_TEXT}")
        voice, number = self._voice(), next(self._numbers)
        self._report(number, "enqueued")
        while not self._speaking.acquire(timeout=0.1):  # one text at a time
            if call.stopped.is_set():
                self._report(number, "stopped")
                return
        try:
            with self._access.calls.beginning(call) as may:
                if may and words:
                    before = voice.utterance().count
                    voice.say(words)
            if may and words:
                self._attend(call, number, words, before)
            self._report(number, "stopped" if call.stopped.is_set() else "done")
        finally:
            self._speaking.release()

    def _attend(self, call: Call, number: int, words: str, before: int) -> None:
        """Raise the events of a text, the one after `before`, until it has been said or its call ends."""
        voice, memory = self._voice(), self._access.service(ALMemory)
        memory.raiseEvent("ALTextToSpeech/CurrentSentence", words)
        memory.raiseEvent("ALTextToSpeech/TextStarted", 1)
        self._report(number, "started")
        while (now := voice.utterance()).speaking or now.count == before:
            if call.wait(LOOK):
                voice.stop()
        memory.raiseEvent("ALTextToSpeech/TextStarted", 0)
        memory.raiseEvent("ALTextToSpeech/TextDone", 1)

    def _report(self, number: int, status: str) -> None:
        """Raise the event with the number of a text and its status: enqueued, started, done or stopped."""
        self._access.service(ALMemory).raiseEvent("ALTextToSpeech/Status", [number, status])

    def stopAll(self) -> None:
        """Stop speaking, and drop what has not been said yet."""
        with self._access.calls.stopping(begins_any(Activity.SPEECH)):
            self._voice().stop()

    def getVoice(self) -> str:
        """Return the voice, that of the language."""
        return _VOICES[self.getLanguage()]

    def setVoice(self, voiceID: object) -> None:
        """Remember a voice, and its language."""
        voice = chosen(voiceID, "voice", _VOICES.values())
        self.setLanguage(next(language for language, name in _VOICES.items() if name == voice))

    def resetSpeed(self) -> None:
        """Reset the parameter `speed`."""
        self.setParameter("speed", 0.0)

    def _voice(self) -> Voice:
        return needed(self._robot.voice, "has no voice")


class ALAnimatedSpeech(Service):
    """Say texts without the tags of animations."""

    @begins(Activity.SPEECH)
    def say(self, call: Call, text_: object, _configuration: object = None) -> None:
        """Say a text; returns when it has been said."""
        self._access.service(ALTextToSpeech).say(call, _ANIMATION.sub(" ", text(text_, "text")))
