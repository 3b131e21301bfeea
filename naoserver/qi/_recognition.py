"""ALSpeechRecognition: it recognizes what somebody types for the robot, since a simulated one has no ears."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Sequence
from typing import Final

from naoserver.errors import InvalidCommand
from naoserver.qi._access import Access
from naoserver.qi._arguments import constant, keepable, kept, number, one_of, refused, switch, text, texts
from naoserver.qi._memory import ALMemory
from naoserver.qi._sensors import Extractor

_LANGUAGES: Final = ("English", "French", "German", "Italian", "Spanish")
_LANGUAGE: Final = one_of("language", _LANGUAGES)
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
    getAvailableLanguages = constant("Return the languages that can be set.", list(_LANGUAGES))
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
