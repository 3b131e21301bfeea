"""What components and robots say over the network, as messages that a page says in its language.

They are programs that speak English: `zenoh_ice.data.text.sentence` makes what they say of templates, which
the catalogs of languages have. A text that one of these gives is a message of it; any other, such as what a
newer program says, stays as it is.
"""

from __future__ import annotations

import re
from functools import cache
from typing import Final

from codegen.messages import Message, joined
from codegen.reasons import known_text
from visualhfsm._base.languages import sentences
from visualhfsm._base.robot_texts import SAID

__all__ = ["recognized", "recognized_sentences"]

_BETWEEN: Final = re.compile(r"(?<=\.) (?=[^\W\d])")
"""Where one sentence follows another."""
_MEMBERS: Final = re.compile(r"(.+) (\(\w+='[^']*'\))", re.DOTALL)
"""The text of an interface's exception, with its other members."""
_REPEATED: Final = re.compile(r"(.+) \((\d+) more since the last report\)", re.DOTALL)
"""An event of a robot that it had more than once."""
_FEWEST_LETTERS: Final = 8
"""Of templates in a text that is known: with fewer, another text may just look like it."""


def recognized(text: str) -> Message:
    """Return a text of a component or a robot as a message."""
    if listed := _MEMBERS.fullmatch(text):
        return joined(" ", [recognized(listed[1]), listed[2]])
    if repeated := _REPEATED.fullmatch(text):
        event, count = recognized(repeated[1]), repeated[2]
        return Message("{event} ({count} more since the last report)", event=event, count=count)
    return known_text(text, _known(), _FEWEST_LETTERS)


def recognized_sentences(text: str) -> Message:
    """Return sentences that follow one another, each with its full stop, as a message."""
    found = [recognized(each.removesuffix(".")) for each in _BETWEEN.split(text) if each]
    return joined(" ", [joined("", [each, "."]) for each in found])


@cache
def _known() -> tuple[Message, ...]:
    return (*sentences(), *SAID)
