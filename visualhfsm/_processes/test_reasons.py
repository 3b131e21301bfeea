"""Why tests failed, as messages: what `run_until` says is translated, any other text stays as it is."""

from __future__ import annotations

import re
from typing import Final

from codegen.messages import Message, number, template
from codegen.reasons import known_text

_WHAT: Final = (
    template("the state {path} was not reached within {limit} s"),
    template("the state {path} was not reached"),
    template("the condition did not hold within {limit} s"),
    Message("the condition did not hold"),
    template("{condition} did not hold within {limit} s"),
    template("{condition} did not hold"),
)
_WHERE: Final = (
    template("at {time} s the behavior is in {states}"),
    template("at {time} s the behavior is paused in {states}"),
    template("at {time} s the behavior has halted in {states}"),
    template("at {time} s the behavior has finished in {states}"),
    template("at {time} s the behavior has ended in {states}"),
)
"""Both as `hfsm_runtime/virtual/execution.py` writes them."""
_PLACED: Final = re.compile(r"(?P<place>[^:\n]+:\d+): (?:BehaviorFailed: )?(?P<reason>.+)", re.DOTALL)
_SENTENCE: Final = re.compile(r"(?P<what>.+?): (?P<where>at [\d.]+ s the behavior .+)\s*")


def reason_of(text: str) -> Message:
    """Return the reason of a failed test, which may begin with its place: `test_walk.py:6: …`."""
    if placed := _PLACED.fullmatch(text):
        return Message("{place}: {reason}", place=placed["place"], reason=_known(placed["reason"]))
    return _known(text)


def _known(text: str) -> Message:
    if found := _SENTENCE.fullmatch(text):
        what, where = _with_numbers(found["what"], _WHAT), _with_numbers(found["where"], _WHERE)
        return Message("{what}: {where}", what=what, where=where)
    return known_text(text)


def _with_numbers(text: str, templates: tuple[Message, ...]) -> Message:
    found = known_text(text, templates)
    numbers = {name: number(str(each)) for name, each in found.values.items() if name in ("limit", "time")}
    return found.again({**found.values, **numbers}) if numbers else found
