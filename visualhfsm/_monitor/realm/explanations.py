"""Why an automaton stays in its state, as messages that a page says in its language."""

from __future__ import annotations

from msgspec.structs import replace

from codegen.messages import Message, joined
from interfaces.hfsm import Explanation
from visualhfsm._base.recognition import recognized, recognized_sentences

__all__ = ["translate_explanation"]


def translate_explanation(explanation: Explanation) -> Explanation:
    """Return an explanation whose texts are messages."""
    said: list[Message] = []
    rest = explanation.summary
    for each in explanation.transitions:
        before, colon, after = rest.partition(f": {each.reason}.")
        if colon:
            above, number, name = before.rpartition(f"{each.order}. ")
            reason = joined("", [f"{number}{name}: ", recognized(each.reason), "."])
            said += [recognized_sentences(above.strip()), reason]
            rest = after
    said.append(recognized_sentences(rest.strip()))
    return replace(
        explanation,
        transitions=[replace(each, reason=recognized(each.reason)) for each in explanation.transitions],
        summary=joined(" ", list(filter(None, said))),
    )
