"""The voice, and ALSpeechRecognition: a simulated robot has no ears, and hears what somebody types for it."""

from __future__ import annotations

import logging
import re
import threading
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import count
from typing import Final

from naoserver.bodies.capabilities import Voice
from naoserver.errors import InvalidCommand, RobotError
from naoserver.protocol.expression import LONGEST_TEXT
from visualhfsm_naoqi.programs._access import Access, Service, needed
from visualhfsm_naoqi.programs._animations import TAGS
from visualhfsm_naoqi.programs._arguments import (
    chosen,
    constant,
    keepable,
    kept,
    number,
    one_of,
    refused,
    switch,
    text,
    texts,
    within,
)
from visualhfsm_naoqi.programs._behaviors import ALBehaviorManager
from visualhfsm_naoqi.programs._clients import CHECK_PERIOD, Activity, Call, begins, begins_any
from visualhfsm_naoqi.programs._memory import ALMemory
from visualhfsm_naoqi.programs._sensors import Extractor

_logger = logging.getLogger(__name__)

_TAG: Final = re.compile(r"\\\w+(=[^\\]*)?\\")
"""NAOqi's tags for pauses, speed and pitch in a text."""
_ANIMATION: Final = re.compile(r"\^\w+(\([^)^]*\))?")
"""An instruction in a text, which is not said."""
_ACTION: Final = re.compile(r"\^(?P<action>(?:start|run|wait|stop)(?:Tag)?)\((?P<name>[^)^]*)\)")
"""An instruction about an animation."""
_MODE: Final = within(0, 2)
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
            if call.wait(CHECK_PERIOD):
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


class _Gestures:
    """The animations that a text asks for on its way.

    They belong to a call besides that of the text: what stops motion ends them and keeps the rest of the text
    from beginning others, while the text is said to its end.
    """

    def __init__(self, access: Access, speech: Call) -> None:
        self._manager = access.service(ALBehaviorManager)
        self._speech = speech
        self._call = Call(access.robot.clock, speech.client, frozenset({Activity.BEHAVIOR}))
        self._counts: dict[str, int] = {}  # of the player, by the names of the animations
        self._failed = False

    @classmethod
    @contextmanager
    def of(cls, access: Access, speech: Call) -> Iterator[_Gestures]:
        """Perform what a text asks for in a `with` block; a text that is stopped stops it."""
        gestures = cls(access, speech)
        access.calls.add(gestures._call)
        try:
            yield gestures
        finally:
            if speech.stopped.is_set():
                for count in gestures._counts.values():
                    gestures._manager._halt(speech.client, count)
            access.calls.remove(gestures._call)

    def perform(self, action: str, name: str) -> None:
        """Perform an action of a text: `start`, `wait`, `run` or `stop` an animation, or that of a tag."""
        action, tagged = action.removesuffix("Tag"), action.endswith("Tag")
        name = TAGS.get(name.strip(), name) if tagged else name.strip()
        try:
            if action in ("start", "run"):
                self._counts[name] = self._manager._start(self._call, self._manager._motion(name))
            if action in ("wait", "run"):
                self._attend(self._counts.get(name, 0))
            if action == "stop":
                self._manager._halt(self._speech.client, self._counts.get(name, 0))
        except RobotError as error:
            if not self._failed:
                _logger.warning("ALAnimatedSpeech: a text goes on without its animation: %s", error)
            self._failed = True

    def _attend(self, count: int) -> None:
        """Wait for the end of an animation, or until the text or all motion is stopped."""
        while self._manager._runs(count) and not self._call.stopped.is_set():
            if self._speech.wait(CHECK_PERIOD):
                return


class ALAnimatedSpeech(Service):
    """Say texts with animations: `^start(animations/Stand/Gestures/Hey_1) Hello ^wait(...)`."""

    setBodyLanguageMode, getBodyLanguageMode = kept(
        "the mode of body language: 0 disabled, 1 random, 2 contextual", 2, bodyLanguageMode=_MODE
    )
    setBodyTalkEnabled, isBodyTalkEnabled = kept("whether it moves while it talks", True, enable=switch)
    setBodyLanguageEnabled, isBodyLanguageEnabled = kept("whether it gestures", True, enable=switch)
    addTagsToWords = constant("Do nothing: words have no tags.", tagsToWords=keepable)

    @begins(Activity.SPEECH)
    def say(self, call: Call, text_: object, _configuration: object = None) -> None:
        """Say a text, and start, run, wait for and stop animations where it says so; returns at its end."""
        voice, rest = self._access.service(ALTextToSpeech), text(text_, "text")
        with _Gestures.of(self._access, call) as gestures:
            for before, action, name in _parts(rest):
                if before:
                    voice.say(call, before)
                if call.stopped.is_set():
                    return
                if action:
                    gestures.perform(action, name)
        self._access.service(ALMemory).raiseEvent("ALAnimatedSpeech/EndOfAnimatedSpeech", True)


def _parts(words: str) -> Iterator[tuple[str, str, str]]:
    """Yield the parts of a text, and with each the action and the name of the animation that follow it."""
    place = 0
    for tag in _ACTION.finditer(words):
        yield _ANIMATION.sub(" ", words[place : tag.start()]).strip(), tag["action"], tag["name"]
        place = tag.end()
    yield _ANIMATION.sub(" ", words[place:]).strip(), "", ""


_GRAMMAR: Final = "modifiable_grammar"
"""The name of the grammar that a vocabulary makes."""
_SURE: Final = 1.0
"""Confidence in what was typed."""
_NOTHING: Final[tuple[str, float]] = ("", -3.0)
"""The word and the confidence before anything is recognized."""
_EVENTS: Final = ("SpeechDetected", "WordRecognized", "WordRecognizedAndGrammar")
_GAP: Final = "<...>"
"""Stands for other words in a recognized phrase when words are spotted."""
_MOST_PUSHED: Final = 100
"""Vocabularies that are put aside at most; the oldest go first."""
_WORD: Final = re.compile(r"\w+")
_Vocabulary = tuple[Sequence[str], bool]
"""Phrases, and whether they are spotted in longer sentences."""
_no_grammars: Final = refused("grammars are not recognized here, only vocabularies: call setVocabulary")


class ALSpeechRecognition(Extractor):
    """Recognize phrases of a vocabulary in what is typed for the robot, while there are subscribers."""

    def __init__(self, access: Access) -> None:
        super().__init__(access)
        self._memory = access.service(ALMemory)
        self._memory.extractors.update(dict.fromkeys(_EVENTS, self))
        self._vocabulary: _Vocabulary = ((), False)
        self._pushed: deque[_Vocabulary] = deque(maxlen=_MOST_PUSHED)
        self._paused = False
        access.hearing.listen(self._understand)

    setLanguage, getLanguage = kept("the language", "English", languageName=_LANGUAGE)
    setParameter, getParameter = kept("a parameter", 0.0, paramName=text, paramValue=number)
    setAudioExpression, getAudioExpression = kept("whether it beeps", True, setOrNot=switch)
    setVisualExpression, getVisualExpression = kept("whether the eyes show it", True, setOrNot=switch)
    setVisualExpressionMode, getVisualExpressionMode = kept("the mode of the eyes", 0, mode=number)
    getAvailableLanguages = constant("Return the languages that can be set.", list(_VOICES))
    compile = addContext = removeContext = loadVocabulary = getRules = _no_grammars
    activateRule = activateAllRules = deactivateRule = deactivateAllRules = _no_grammars
    addWordListToSlot = removeWordListFromSlot = setContextParam = getContextParam = _no_grammars

    def setVocabulary(self, vocabulary: object, enabledWordSpotting: object = False) -> None:
        """Recognize phrases: a sentence that is one of them or, if words are spotted, contains some."""
        phrases = texts(keepable(vocabulary, "vocabulary"), "vocabulary")
        if not all(map(_words, phrases)):
            raise InvalidCommand("vocabulary", "a phrase of the vocabulary has no words")
        with self._lock:
            self._vocabulary = phrases, bool(enabledWordSpotting)

    setWordListAsVocabulary = setVocabulary  # its former name

    def removeAllContext(self) -> None:
        """Recognize nothing until there is another vocabulary."""
        self.setVocabulary([])

    def pushContexts(self) -> None:
        """Put the vocabulary aside, and recognize nothing until there is another one."""
        with self._lock:
            self._pushed.append(self._vocabulary)
            self._vocabulary = (), False

    def popContexts(self) -> None:
        """Recognize the vocabulary again that was put aside last, if there is one."""
        with self._lock:
            if self._pushed:
                self._vocabulary = self._pushed.pop()

    def pause(self, isPaused: object) -> None:
        """Pause the recognition, or resume it."""
        self._paused = bool(isPaused)

    def subscribe(self, name: object, period: object = 100, precision: object = 0.0) -> None:
        """Start recognizing for a subscriber; WordRecognized is empty then."""
        super().subscribe(name, period, precision)
        self._memory.insertData("WordRecognized", list(_NOTHING))

    def _require(self) -> None:
        pass

    def _understand(self, sentence: str) -> str:
        """Raise the events of a sentence that was typed; return what was recognized."""
        with self._lock:
            phrases, spots = self._vocabulary
        if self._paused or not self._wanted() or not phrases:
            return ""
        found = _spotted(sentence, phrases) if spots else _said(sentence, phrases)
        self._memory.raiseEvent("SpeechDetected", True)
        if found:
            named = [f"{_GAP} {phrase} {_GAP}" if spots else phrase for phrase in found]
            words = [part for phrase in named for part in (phrase, _SURE)]
            grammars = [part for phrase in named for part in (phrase, _SURE, _GRAMMAR)]
            self._memory.raiseEvent("WordRecognized", words)
            self._memory.raiseEvent("WordRecognizedAndGrammar", grammars)
        self._memory.raiseEvent("SpeechDetected", False)
        return ", ".join(found)


def _words(sentence: str) -> list[str]:
    """Return the words of a sentence without capitals and punctuation."""
    return _WORD.findall(sentence.casefold())


def _said(sentence: str, phrases: Sequence[str]) -> list[str]:
    """Return the phrase that a sentence is, as a list."""
    words = _words(sentence)
    return [phrase for phrase in phrases if _words(phrase) == words][:1]


def _spotted(sentence: str, phrases: Sequence[str]) -> list[str]:
    """Return the phrases that a sentence contains, those of most words first."""
    words = f" {' '.join(_words(sentence))} "
    found = [phrase for phrase in phrases if f" {' '.join(_words(phrase))} " in words]
    return sorted(dict.fromkeys(found), key=lambda phrase: -len(_words(phrase)))
