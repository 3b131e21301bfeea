"""What components and robots say over the network, as messages that a page says in its language.

They are programs that speak English. `zenoh_ice.data.text.sentence` marks what they say, and the catalogs of
languages have its templates. A text that one of these gives is a message of it; any other, such as what a
newer program says, stays as it is.
"""

from __future__ import annotations

import re
from typing import Final

from codegen.messages import Message, joined
from codegen.reasons import known_text
from visualhfsm._base.languages import sentences

__all__ = ["reason_of", "recognized", "recognized_sentences"]

_BETWEEN: Final = re.compile(r"(?<=\.) (?=[^\W\d])")
"""Where one sentence follows another."""
_MEMBERS: Final = re.compile(r"(.+) (\(\w+='[^']*'\))", re.DOTALL)
"""The text of an interface's exception, with its other members."""
_PLACED: Final = re.compile(r"(?P<place>[^:\n]+:\d+): (?:BehaviorFailed: )?(?P<reason>.+)", re.DOTALL)
_SENTENCE: Final = re.compile(r"(?P<what>.+?): (?P<where>at [\d.]+ s the behavior .+)\s*")
_FEWEST_LETTERS: Final = 8
"""Of templates in a text that is known: with fewer, another text may just look like it."""


def recognized(text: str) -> Message:
    """Return a text of a component or a robot as a message."""
    if listed := _MEMBERS.fullmatch(text):
        return joined(" ", [recognized(listed[1]), listed[2]])
    return known_text(text, sentences(), _FEWEST_LETTERS)


def recognized_sentences(text: str) -> Message:
    """Return sentences that follow one another, each with its full stop, as a message."""
    found = [recognized(each.removesuffix(".")) for each in _BETWEEN.split(text) if each]
    return joined(" ", [joined("", [each, "."]) for each in found])


def reason_of(text: str) -> Message:
    """Return why a test failed, which may begin with its place: `test_walk.py:6: …`, as a message.

    What `run_until` says is known, too.
    """
    if placed := _PLACED.fullmatch(text):
        return Message("{place}: {reason}", place=placed["place"], reason=_failure(placed["reason"]))
    return _failure(text)


def _failure(text: str) -> Message:
    if found := _SENTENCE.fullmatch(text):
        what, where = recognized(found["what"]), recognized(found["where"])
        return Message("{what}: {where}", what=what, where=where)
    return recognized(text)
