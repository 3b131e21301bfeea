"""A plan in words, as the page shows it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import islice
from typing import Final

from ._messages import Fact, PlanFacts
from ._plan import Disturbance, Plan
from ._quantities import Quantity, Same, Spread, varies

_MOST_FACTS: Final = 60
"""Quantities of a kind that are shown."""
_MOST_CHOICES: Final = 8
_LONGEST_WORDS: Final = 120


def facts_of(plan: Plan, file: str) -> PlanFacts:
    """Return a plan in words; `file` is its name, empty if there is none."""
    quantities = [*plan.scene.items(), *plan.parameters.items()]
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
        counts=[_cut(words) for words in _conditions(plan)],
        measures=[_cut(name) for name in islice((*plan.numbers, *plan.samples), _MOST_FACTS)],
    )


def in_words(quantity: Quantity) -> str:
    """Return what a quantity is, such as `between 0 and 2`."""
    if isinstance(quantity, Same):
        return f"as {quantity.same}"
    if isinstance(quantity, tuple):
        shown = [_value(each) for each in quantity[:_MOST_CHOICES]]
        if len(quantity) > len(shown):
            return f"{', '.join(shown)}, … ({len(quantity)} values)"
        return f"{', '.join(shown[:-1])} or {shown[-1]}" if len(shown) > 1 else shown[0]
    return _spread(quantity) if isinstance(quantity, Spread) else _value(quantity)


def _spread(spread: Spread) -> str:
    ends = [
        f"{word} {_value(end)}"
        for word, end in (("at least", spread.lowest), ("at most", spread.highest))
        if end is not None
    ]
    if spread.mean is not None and spread.deviation is not None:
        normal = f"normal, {_value(spread.mean)} ± {_value(spread.deviation)}"
        return ", ".join([normal, *ends])
    kind = ", by powers of ten" if spread.log else ", whole" if spread.whole else ""
    return f"{_value(spread.lowest)} to {_value(spread.highest)}{kind}"


def _event(event: Disturbance) -> str:
    at = f"at {in_words(event.at)} s"
    lasts = f" for {in_words(event.seconds)} s"
    if event.push is not None:
        return f"{at}: a push of {in_words(event.push)} N{lasts}"
    if event.move is not None:
        places = event.to if isinstance(event.to, tuple) else (event.to,)
        words = (", ".join(f"{name} {in_words(each)}" for name, each in place.items()) for place in places)
        return f"{at}: {event.move} is put elsewhere: {'; or '.join(words)}"
    if event.offline is not None:
        return f"{at}: {', '.join(event.offline) or 'all servants'} offline{lasts}"
    return f"{at}: pictures {in_words(event.late if event.late is not None else 0.0)} s late{lasts}"


def _conditions(plan: Plan) -> Iterator[str]:
    success = plan.success
    if success.upright and plan.robot != "none":
        yield "the robot does not fall"
    if success.properties:
        yield "the properties of the document hold"
    if success.function is not None:
        yield f"{success.function} calls it good"


def _facts(found: Iterable[tuple[str, str]]) -> list[Fact]:
    return [Fact(_cut(name), _cut(words)) for name, words in islice(found, _MOST_FACTS)]


def _value(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, int | float) else str(value)


def _cut(text: str) -> str:
    return text if len(text) <= _LONGEST_WORDS else f"{text[:_LONGEST_WORDS]}…"
