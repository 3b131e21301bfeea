"""Hypothesis strategies that drive a behavior at random: its guards, its events, the balls, and the time.

All of them shrink towards few steps, short times and guards that are false.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final, NamedTuple

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from hfsm_runtime.virtual.errors import says_it_all
from visualhfsm.simulation import Behavior
from visualhfsm.simulation._loading import read

from ._abstraction import abstract_component

__tracebackhide__ = says_it_all

_PERIODS: Final = 20
_BALLS: Final = ("red", "green")


@dataclass(frozen=True, slots=True, repr=False)
class Move:
    """A call of a behavior, or of a ball of its robot; it prints as the code that repeats it."""

    method: str
    arguments: tuple[object, ...] = ()
    ball: str = ""

    def apply(self, b: Behavior) -> None:
        """Make the call."""
        getattr(b.robot.ball(self.ball) if self.ball else b, self.method)(*self.arguments)

    def __repr__(self) -> str:
        owner = f"b.robot.ball({self.ball!r})" if self.ball else "b"
        shown = (f"{each:g}" if isinstance(each, float) else repr(each) for each in self.arguments)
        return f"{owner}.{self.method}({', '.join(shown)})"


class _Facts(NamedTuple):
    """The parts of a document that a random test can use."""

    guards: tuple[str, ...]
    declared: tuple[str, ...]
    events: tuple[str, ...]
    period: float
    """The shortest period in s."""
    delays: tuple[float, ...]
    """The times of its timed transitions in s."""


def guards(document: str | Path) -> SearchStrategy[dict[str, bool]]:
    """Return values for all guards of a document, by name."""
    return st.fixed_dictionaries({name: st.booleans() for name in _facts(document).guards})


def guard_scripts(
    document: str | Path, *, max_size: int = 20
) -> SearchStrategy[list[tuple[dict[str, bool], float]]]:
    """Return sequences of values for all guards, each with the time in s for which they last."""
    return st.lists(st.tuples(guards(document), _seconds(document)), max_size=max_size)


def advances(document: str | Path) -> SearchStrategy[Move]:
    """Return steps that let time pass: some periods, or the delay of a timer of the document."""
    return _seconds(document).map(lambda seconds: Move("advance", (seconds,)))


def _seconds(document: str | Path) -> SearchStrategy[float]:
    facts = _facts(document)
    periods = st.integers(1, _PERIODS).map(lambda count: round(count * facts.period, 9))
    return periods | st.sampled_from(facts.delays) if facts.delays else periods


def events(document: str | Path, *, inner: bool = True) -> SearchStrategy[Move]:
    """Return the events that the document declares, or that a transition waits for.

    Without `inner` only the declared ones, if any are declared.
    """
    facts = _facts(document)
    return st.sampled_from([Move("send", (name,)) for name in (not inner and facts.declared) or facts.events])


def balls(*names: str) -> SearchStrategy[Move]:
    """Return steps that put balls in front of the robot, where the head can turn to them, or behind it."""
    places = st.tuples(_tenths(-12, 12), _tenths(6, 20), _tenths(2, 9))
    ball = st.sampled_from(names or _BALLS)
    hidden = st.builds(Move, st.just("hide"), st.just(()), ball)
    return st.builds(Move, st.just("place"), places, ball) | hidden


def stimuli(
    document: str | Path,
    *,
    guards: bool = True,
    inner_events: bool = True,
    balls: Sequence[str] = (),
    max_size: int = 30,
) -> SearchStrategy[list[Move]]:
    """Return sequences of steps: time passes and events arrive.

    With `guards` the guards of the document become true or false; without `inner_events` only declared
    events arrive, if the document declares any; `balls` names the balls to move.
    """
    facts = _facts(document)
    kinds: list[SearchStrategy[Move]] = [advances(document)]
    if guards and facts.guards:
        values = st.tuples(st.sampled_from(facts.guards), st.booleans())
        kinds.append(values.map(lambda value: Move("guard", value)))
    if facts.events:
        kinds.append(events(document, inner=inner_events))
    if balls:
        kinds.append(_balls(*balls))
    return st.lists(st.one_of(kinds), max_size=max_size)


_balls = balls  # which is also the name of a parameter


def _tenths(least: int, most: int) -> SearchStrategy[float]:
    return st.integers(least, most).map(lambda tenths: tenths / 10)


def _facts(document: str | Path) -> _Facts:
    path = Path(document).resolve()
    return _read_facts(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=64)
def _read_facts(path: Path, changed: int) -> _Facts:  # noqa: ARG001
    document = read(path)
    b = Behavior(abstract_component(document, path)())
    automata = [run.automaton for run in b.tree.actors]
    transitions = [transition for automaton in automata for transition in automaton.transitions]
    declared = [event.name for event in document.events]
    return _Facts(
        guards=b.guards,
        declared=tuple(declared),
        events=tuple(dict.fromkeys([*declared, *(each.event for each in transitions if each.event)])),
        period=min(automaton.period for automaton in automata),
        delays=tuple(sorted({each.seconds for each in transitions if each.seconds is not None})),
    )
