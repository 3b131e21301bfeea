"""Explain why an automaton stays in its state: what keeps each transition out of it from firing."""

from __future__ import annotations

from itertools import islice
from typing import Final

from interfaces.hfsm import Explanation, TransitionExplanation

from .._automaton import Transition
from .._timeline import Timeline
from .._variables import short_repr, values_of
from ..tree import Actor, Phase, Tree
from ._expressions import values_in

_SECOND: Final = 1e9
_LONGEST_CONDITION: Final = 200
_LONGEST_VALUE: Final = 60
_MOST_VALUES: Final = 5
_MOST_EVENTS: Final = 5


def explain(tree: Tree, actor: Actor, timeline: Timeline) -> Explanation:
    """Return the reasons why the transitions out of an automaton's current state have not fired."""
    with tree.lock:
        now = timeline.now()
        asked = dict(actor.guards)
        reasons = []
        for order, transition in enumerate(actor.automaton.outgoing(actor.current), 1):
            value, at = asked.get(transition.id, (False, None))
            left = None if transition.delay is None else max(0, transition.delay - actor.active_time(now))
            reason = TransitionExplanation(
                transition=transition.id,
                order=order,
                asked=at is not None and at >= actor.cycle.last_slot,
                value=value,
                askedAt=-1.0 if at is None else at / _SECOND,
                remaining=-1.0 if left is None else left / _SECOND,
                reason="",
            )
            reason.reason = _reason(actor, transition, reason, now)
            reasons.append(reason)
        return Explanation(
            automaton=actor.automaton.id,
            state=actor.current.id,
            ghost=actor.parent is not None and not actor.active,
            enteredBy=actor.last_transition,
            transitions=reasons,
            summary=_summary(actor, reasons, paused=timeline.paused, now=now),
        )


def _reason(actor: Actor, transition: Transition, found: TransitionExplanation, now: int) -> str:
    if actor.current.final:
        return "the state is final: no transition is tried"
    if actor.forced is transition:
        return "it is forced, and fires in the next cycle"
    if actor.owed:
        return "it is not tried before the entry code of the state has run to its end"
    if found.remaining > 0:
        return f"its time comes after {found.remaining:.2f} s more in the state"
    if found.askedAt >= 0:
        ago = now / _SECOND - found.askedAt
        return _asked(transition, value=found.value, ago=ago) + _values(actor, transition.condition)
    if found.remaining == 0 and transition.guard is None:
        return "its time has come: it fires in the next cycle"
    first = _fired_before(actor, found.order)
    if first is not None:
        return f"it was not tried: {_name_of(actor, first)}, which comes first, fired"
    if transition.event:
        if any(event.name == transition.event for event in actor.events.waiting):
            return f"the event {transition.event} waits in the queue for the next cycle"
        return f"no event {transition.event} has come since the state was entered"
    if transition.finished:
        return _unfinished(actor)
    return "its guard has not been evaluated since the state was entered"


def _asked(transition: Transition, *, value: bool, ago: float) -> str:
    condition = transition.condition
    if len(condition) > _LONGEST_CONDITION:
        condition = condition[: _LONGEST_CONDITION - 3] + "..."
    guard = f"its guard `{condition}`" if condition else "its guard"
    when = f"when it was evaluated {ago:.2f} s ago"
    if transition.delay is not None:
        when = f"though its time has come, {when}"
    elif transition.event:
        when = f"when {transition.event} came {ago:.2f} s ago"
    return f"{guard} was {'true' if value else 'false'} {when}"


def _values(actor: Actor, condition: str) -> str:
    """Return the current values of the names in a condition, as far as known without executing code."""
    found = values_in(condition, values_of(actor.automaton), _MOST_VALUES)
    values = [f"{name} = {short_repr(value)[:_LONGEST_VALUE]}" for name, value in found.items()]
    return f"; now {', '.join(values)}" if values else ""


def _unfinished(actor: Actor) -> str:
    if not actor.below:
        return "the state owns no automaton that could finish: it never fires"
    waits = [
        f"{child.automaton.name} is in {child.current.name}" for child in actor.below if not child.finished
    ]
    if not waits:
        return "all automata of the state have finished: it fires in the next cycle"
    return f"not all automata of the state have finished: {', '.join(waits)}"


def _fired_before(actor: Actor, order: int) -> Transition | None:
    """Return the transition that led back into this state and is tried before another one."""
    before = actor.automaton.outgoing(actor.current)[: order - 1]
    by = (
        each for each in before if each.id == actor.last_transition and each.destination == actor.current.id
    )
    return next(by, None)


def _summary(actor: Actor, reasons: list[TransitionExplanation], *, paused: bool, now: int) -> str:
    parts = ["The component is paused."] if paused else []
    name, state = actor.automaton.name, actor.current.name
    by = next((t for t in actor.automaton.transitions if t.id == actor.last_transition), None)
    entered = f", entered by {_name_of(actor, by)}" if by is not None else ""
    spent = f"{actor.active_time(now) / _SECOND:.2f} s"
    if actor.phase is Phase.UNUSED:
        parts.append(f"{name} has not run yet: {_above(actor)}.")
    elif actor.parent is not None and not actor.active:
        parts.append(f"{name} is a ghost in {state}: {_above(actor)}. It has been active there for {spent}.")
    elif actor.finished:
        parts.append(f"{name} has finished in {state}{entered}.")
    else:
        parts.append(f"{name} has been in {state} for {spent}{entered}.")
    if not reasons and not actor.current.final:
        parts.append("No transition leaves the state.")
    for transition, each in zip(actor.automaton.outgoing(actor.current), reasons, strict=True):
        parts.append(f"{each.order}. {_name_of(actor, transition)}: {each.reason}.")
    if actor.events.waiting:
        names = ", ".join(event.name for event in islice(actor.events.waiting, _MOST_EVENTS))
        more = ", ..." if len(actor.events.waiting) > _MOST_EVENTS else ""
        parts.append(f"Waiting events: {len(actor.events.waiting)} ({names}{more}).")
    if actor.events.last_dropped is not None:
        event, reason, at = actor.events.last_dropped
        ago = f"{(now - at) / _SECOND:.2f} s ago"
        parts.append(f"Events dropped: {actor.events.dropped}, the last one ({event.name}) {ago}: {reason}.")
    return " ".join(parts)


def _above(actor: Actor) -> str:
    """Say which automaton above is in another state."""
    for child in actor.chain():
        above, owner = child.parent, child.owner
        if above is not None and owner is not None and (above.active or above.parent is None):
            if above.current.id == owner.id:
                return f"{above.automaton.name} has not completed the entry of {owner.name}"
            return f"{above.automaton.name} is in {above.current.name}, not in {owner.name}"
    return "the component has not started"


def _name_of(actor: Actor, transition: Transition) -> str:
    """Return the name of a transition, or that of the state it leads to."""
    return transition.name or f"the transition to {actor.automaton.state(transition.destination).name}"
