"""A plan in words, as the page shows it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Final

from codegen.messages import Message, any_of, joined, number
from naoserver.bodies import DEFAULT_BODY
from visualhfsm.trials import Disturbance, Plan, Quantity, Same, Spread, varies

from ._messages import Fact, PlanFacts

_MOST_FACTS: Final = 60
"""Quantities of a kind that are shown."""
_MOST_CHOICES: Final = 8
_LONGEST_WORDS: Final = 120


def facts_of(plan: Plan, file: str) -> PlanFacts:
    """Return a plan in words; `file` is its name, empty if there is none."""
    scene = plan.scene if plan.robot == "none" else {"body": DEFAULT_BODY, **plan.scene}
    if isinstance(body := scene.get("body"), str):
        scene = {**scene, "body": Path(body).name}
    quantities = [*scene.items(), *plan.parameters.items()]
    success = plan.success
    return PlanFacts(
        file=file,
        runs=plan.runs,
        seed=plan.seed,
        limit=plan.limit,
        robot=plan.robot,
        state=_cut(success.state or ""),
        varies=_facts((name, in_words(each)) for name, each in quantities if varies(each)),
        fixed=_facts((name, in_words(each)) for name, each in quantities if not varies(each)),
        happens=_facts((name, _event(each)) for name, each in plan.disturbances.items()),
        counts=[*_conditions(plan)],
        measures=[_cut(name) for name in islice((*plan.numbers, *plan.samples), _MOST_FACTS)],
    )


def in_words(quantity: Quantity) -> Message:
    """Return what a quantity is, such as `between 0 and 2`."""
    if isinstance(quantity, Same):
        return Message("as {other}", other=quantity.same)
    if isinstance(quantity, tuple):
        shown = [_value(each) for each in quantity[:_MOST_CHOICES]]
        if len(quantity) > len(shown):
            return Message("{values}, … ({count} values)", values=joined(", ", shown), count=len(quantity))
        return any_of(shown)
    return _spread(quantity) if isinstance(quantity, Spread) else _value(quantity)


def _spread(spread: Spread) -> Message:
    if spread.mean is not None and spread.deviation is not None:
        mean, deviation = _value(spread.mean), _value(spread.deviation)
        parts = [Message("normal, {mean} ± {deviation}", mean=mean, deviation=deviation)]
        if spread.lowest is not None:
            parts.append(Message("at least {value}", value=_value(spread.lowest)))
        if spread.highest is not None:
            parts.append(Message("at most {value}", value=_value(spread.highest)))
        return joined(", ", parts)
    ends = {"lowest": _value(spread.lowest), "highest": _value(spread.highest)}
    if spread.log:
        return Message("{lowest} to {highest}, by powers of ten", **ends)
    if spread.whole:
        return Message("{lowest} to {highest}, whole", **ends)
    return Message("{lowest} to {highest}", **ends)


def _event(event: Disturbance) -> Message:
    at, lasts = in_words(event.at), in_words(event.seconds)
    if event.push is not None:
        push = in_words(event.push)
        return Message("at {at} s: a push of {push} N for {lasts} s", at=at, push=push, lasts=lasts)
    if event.move is not None:
        words = [
            joined(", ", [joined(" ", [name, in_words(each)]) for name, each in place.items()])
            for place in event.places.values()
        ]
        where, thing = _one_of(words), event.move
        if event.speed is not None:
            axes = {axis for place in event.places.values() for axis in place}
            units = {"rad/s" if axis == "pan" else "m/s" for axis in axes}
            speed = joined(" ", [in_words(event.speed), Message.verbatim(", ".join(sorted(units)))])
            return Message(
                "at {at} s: {thing} is carried at {speed}: {where}",
                at=at, thing=thing, speed=speed, where=where,
            )  # fmt: skip
        return Message("at {at} s: {thing} is put elsewhere: {where}", at=at, thing=thing, where=where)
    if event.offline is not None:
        what = Message.verbatim(", ".join(event.offline)) if event.offline else Message("all servants")
        return Message("at {at} s: {what} offline for {lasts} s", at=at, what=what, lasts=lasts)
    if event.fail is not None:
        return _failure(event, event.fail, at, lasts)
    late = in_words(event.late if event.late is not None else 0.0)
    return Message("at {at} s: pictures {late} s late for {lasts} s", at=at, late=late, lasts=lasts)


def _failure(event: Disturbance, part: str | tuple[str, ...], at: Message, lasts: Message) -> Message:
    words = {"at": at, "part": in_words(part), "kind": in_words(event.kind)}
    if event.amount is not None:
        # The unit is that of the kind, which a body has: a plan alone does not know it.
        words["kind"] = joined(" ", [words["kind"], in_words(event.amount)])
    if event.seconds == 0.0:
        return Message("at {at} s: {part} fails, {kind}", **words)
    return Message("at {at} s: {part} fails, {kind}, for {lasts} s", lasts=lasts, **words)


def _one_of(places: Sequence[Message]) -> Message:
    first, *others = places
    return Message("{first}; or {others}", first=first, others=_one_of(others)) if others else first


def _conditions(plan: Plan) -> Iterator[Message]:
    success = plan.success
    if success.upright and plan.robot != "none":
        yield Message("the robot does not fall")
    if success.properties:
        yield Message("the properties of the document hold")
    if success.function is not None:
        yield Message("{function} calls it good", function=_cut(success.function))


def _facts(found: Iterable[tuple[str, Message]]) -> list[Fact]:
    return [Fact(_cut(name), _short(words)) for name, words in islice(found, _MOST_FACTS)]


def _value(value: object) -> Message:
    if isinstance(value, bool):
        return Message("yes") if value else Message("no")
    return number(f"{value:g}" if isinstance(value, int | float) else str(value))


def _short(words: Message) -> Message:
    return words if len(words) <= _LONGEST_WORDS else Message.verbatim(_cut(words))


def _cut(text: str) -> str:
    return text if len(text) <= _LONGEST_WORDS else f"{text[:_LONGEST_WORDS]}…"
