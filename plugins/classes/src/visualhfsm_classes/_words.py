"""What exercises and grading say to pupils, in the languages of the editor; others get the English words."""

from __future__ import annotations

from typing import Final

from codegen.messages import Value, template
from visualhfsm.plugins import known_language, said

_WORDS: Final = {
    "at once": template("is in `{state}` when {event}"),
    "goes": template("goes to `{state}` {time} s after {event}"),
    "never": template("never goes to `{state}` after {event}"),
    "starts": template("begins in `{state}`"),
    "goes from start": template("goes to `{state}` after {time} s"),
    "never from start": template("never goes to `{state}`"),
    "asked": template("; asked: within {time} s"),
    "in trials": template("not in {count} of {all} trials: {words}"),
    "broken": template("It cannot be run, so there are no points"),
    "stopped": template("an error ended the trial"),
    "error": template("An error ended a trial, which has no points"),
    "other": template("its states are those of the exercise `{name}`"),
    "did": template("its states in the trial with the fewest points: {states}"),
    "was in": template("`{state}` for {time} s"),
    "stayed in": template("`{state}` all the time"),
    "and so on": template("and so on, {count} changes in {time} s"),
    "judge failed": template("this could not be judged, ask your teacher: {reason}"),
    "points": template("Points"),
    "points of": template("of {of} points"),
    "of": template("{points} of {of}"),
    "all": template("everything as asked"),
    "asks": template("Asked"),
    "happened": template("What happened"),
    "worst": template("The trial with the fewest points"),
    "all good": template("One of the trials, all of which went well"),
    "trial": template("trial {number} of {count}"),
    "trial of": template("{plan}: trial {number} of {count}"),
    "document": template("Document {digest} of {time}"),
    "gone": template("no document now: the marks are those of the last one"),
    "by hand": template("changed by hand; the document {document} earns {points}"),
    "counts": template("What earns points"),
    "wrote": template("wrote {file}"),
    "next": template(
        "Next: read task.md\n"
        "  cd {folder}\n"
        "  visualhfsm edit {document}      draw, and try what is drawn\n"
        "  visualhfsm trials {document}    run it as often as the task says"
    ),
    "robots": template("It is made for robots with the body {robots}."),
}


def say(language: str, phrase: str, **parts: Value) -> str:
    """Return a phrase in a language."""
    return said(_WORDS[phrase].again(parts), known_language(language))


def figure(language: str, number: float, digits: int = 2) -> str:
    """Return a number as people write it, without zeros at its end."""
    text = f"{number:.{digits}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    return text.replace(".", ",") if language in ("de", "es", "fr", "it", "pt") else text
