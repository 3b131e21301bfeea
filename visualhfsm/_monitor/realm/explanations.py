"""Why an automaton stays in its state, as messages that a page says in its language."""

from __future__ import annotations

from typing import Final

import msgspec
from msgspec.structs import replace

from codegen.messages import Message, joined
from interfaces.hfsm import (
    AutomatonSnapshot,
    AutomatonStructure,
    ComponentStructure,
    Explanation,
    TransitionExplanation,
    TransitionKind,
    TransitionStructure,
)
from visualhfsm._base.recognition import recognized, recognized_sentences
from zenoh_ice.data import typed

__all__ = ["explain_moment", "translate_explanation"]


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


def explain_moment(structure: ComponentStructure, moment: msgspec.Raw | None, id: int) -> Explanation | None:
    """Explain an automaton at a moment of a log, as messages; None where it is not known."""
    automaton = next((each for each in structure.automata if each.id == id), None)
    found = [] if moment is None else typed.from_json(moment)["component"]["automata"]
    snapshot = next((each for each in found if each["id"] == id), None)
    if automaton is None or snapshot is None:
        return None
    return _explained(automaton, typed.convert(snapshot, AutomatonSnapshot))


def _explained(automaton: AutomatonStructure, now: AutomatonSnapshot) -> Explanation:
    remaining = {timer.transition: timer.remaining for timer in now.timers}
    values = {guard.transition: guard.value for guard in now.guards}
    final = any(state.id == now.state and state.final for state in automaton.states)
    out = sorted((each for each in automaton.transitions if each.origin == now.state), key=lambda t: t.order)
    explained, said = list[TransitionExplanation](), list[Message]()
    for each in out:
        left, value = remaining.get(each.id, -1.0), values.get(each.id)
        reason = recognized(_FINAL) if final else _reason(each, left, value)
        destination = next((state.name for state in automaton.states if state.id == each.destination), "")
        said.append(joined("", [f"{each.order}. {each.name or f'-> {destination}'}: ", reason, "."]))
        explained.append(
            TransitionExplanation(each.id, each.order, value is not None, bool(value), -1.0, left, reason)
        )
    summary = joined(" ", said)
    return Explanation(now.id, now.state, now.ghost, now.lastTransition, explained, summary)


_FINAL: Final = "the state is final: no transition is tried"


def _reason(transition: TransitionStructure, left: float, value: bool | None) -> Message:
    if left > 0:
        return recognized(f"its time comes after {left:.2f} s more in the state")
    if value is not None:
        condition = transition.condition or "…"
        if value:
            return Message("its guard `{condition}` was true when it was evaluated last", condition=condition)
        return Message("its guard `{condition}` was false when it was evaluated last", condition=condition)
    if transition.kind is TransitionKind.OnTime and not transition.condition:
        return recognized("its time has come: it fires in the next cycle")
    if transition.kind is TransitionKind.OnEvent:
        return recognized(f"no event {transition.event} has come since the state was entered")
    if transition.kind is TransitionKind.OnFinished:
        return Message("not all automata of the state have finished")
    return recognized("its guard has not been evaluated since the state was entered")
