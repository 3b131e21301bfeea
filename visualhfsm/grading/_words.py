"""What grading says to pupils, in English and Spanish; other languages get the English words."""

from __future__ import annotations

from typing import Final

FALLBACK: Final = "en"

_WORDS: Final = {
    "en": {
        "at once": "is in `{state}` when {event}",
        "goes": "goes to `{state}` {time} s after {event}",
        "never": "never goes to `{state}` after {event}",
        "starts": "begins in `{state}`",
        "goes from start": "goes to `{state}` after {time} s",
        "never from start": "never goes to `{state}`",
        "asked": "; asked: within {time} s",
        "in trials": "not in {count} of {all} trials: {words}",
        "broken": "It cannot be run, so there are no points",
        "stopped": "an error ended the trial",
        "error": "An error ended a trial, which has no points",
        "other": "its states are those of the exercise `{name}`",
        "did": "its states in the trial with the fewest points: {states}",
        "was in": "`{state}` for {time} s",
        "stayed in": "`{state}` all the time",
        "and so on": "and so on, {count} changes in {time} s",
        "judge failed": "this could not be judged, ask your teacher: {reason}",
        "points": "Points",
        "points of": "of {of} points",
        "of": "{points} of {of}",
        "all": "everything as asked",
        "asks": "Asked",
        "happened": "What happened",
        "worst": "The trial with the fewest points",
        "all good": "One of the trials, all of which went well",
        "trial": "trial {number} of {count}",
        "trial of": "{plan}: trial {number} of {count}",
        "counts": "What earns points",
        "robots": "It is made for robots with the body {robots}.",
    },
    "es": {
        "at once": "está en `{state}` cuando {event}",
        "goes": "pasa a `{state}` en {time} s cuando {event}",
        "never": "no pasa nunca a `{state}` cuando {event}",
        "starts": "empieza en `{state}`",
        "goes from start": "pasa a `{state}` al cabo de {time} s",
        "never from start": "no pasa nunca a `{state}`",
        "asked": "; se pide: en {time} s como máximo",
        "in trials": "falla en {count} de {all} ensayos: {words}",
        "broken": "No se puede ejecutar, así que no hay puntos",
        "stopped": "el ensayo terminó con un error",
        "error": "Un ensayo terminó con un error, y no tiene puntos",
        "other": "sus estados son los del ejercicio `{name}`",
        "did": "sus estados en el ensayo con menos puntos: {states}",
        "was in": "`{state}` durante {time} s",
        "stayed in": "`{state}` todo el tiempo",
        "and so on": "y así sucesivamente, {count} cambios en {time} s",
        "judge failed": "esto no se pudo evaluar, díselo a tu profesora o profesor: {reason}",
        "points": "Puntos",
        "points of": "de {of} puntos",
        "of": "{points} de {of}",
        "all": "todo como se pide",
        "asks": "Se pide",
        "happened": "Qué pasó",
        "worst": "El ensayo con menos puntos",
        "all good": "Uno de los ensayos, que salieron todos bien",
        "trial": "ensayo {number} de {count}",
        "trial of": "{plan}: ensayo {number} de {count}",
        "counts": "Qué da puntos",
        "robots": "Está hecho para robots con el cuerpo {robots}.",
    },
}


def say(language: str, phrase: str, **parts: object) -> str:
    """Return a phrase in a language."""
    phrases = _WORDS.get(language, _WORDS[FALLBACK])
    return phrases[phrase].format(**parts)


def figure(language: str, number: float, digits: int = 2) -> str:
    """Return a number as people write it, without zeros at its end."""
    text = f"{number:.{digits}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    return text.replace(".", ",") if language in ("de", "es", "fr", "it", "pt") else text
