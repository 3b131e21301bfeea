"""Search for a run in which a behavior does what it must not do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from hypothesis import HealthCheck, Phase, given, settings

from codegen.hfsm.model_checker.model import read_model
from hfsm_runtime.observer import Observer
from hfsm_runtime.tree import Actor
from hfsm_runtime.virtual.errors import BehaviorFailed, says_it_all
from hfsm_runtime.virtual.execution import name_of
from visualhfsm.simulation import Behavior
from visualhfsm.simulation._loading import forget, load_component, read
from visualhfsm.simulation._properties import Check, Stated

from ._abstraction import abstract_component
from .strategies import Move, stimuli

__tracebackhide__ = says_it_all

Invariant = Callable[[Behavior], object]
"""Returns whether a property holds; it may also raise AssertionError if it does not."""


def check_properties(
    document: str | Path,
    *invariants: Invariant,
    abstract: bool = True,
    guards: bool | None = None,
    balls: Sequence[str] = (),
    examples: int = 100,
    steps: int = 30,
    random: bool = False,
    **options: Any,  # noqa: ANN401 - those of Behavior
) -> None:
    """Run a document at random, and check properties after every cycle.

    The properties are the `invariants` and those of the document: `always`, `never`, and `eventually` with a
    time. The passing time, events, the places of `balls` (`red`, `green`) and the `guards` are random.

    With `abstract`, the default, no code runs: there are only states, timers and random guards.
    Otherwise the code runs, with the `options` of the fixture `behavior` such as `robot`; its guards are
    random only if `guards` is set, and if the document declares events, only these are sent from outside.

    There are `examples` runs of at most `steps` steps: the same ones each time, or others with `random`.
    Raises BehaviorFailed with the shortest steps found that break a property or make the code fail.
    """
    path = Path(document).resolve()
    model = read_model(read(path), path)
    stated = [Stated(each, model) for each in model.document.properties]
    checks = [(name_of(invariant, "the invariant"), invariant) for invariant in invariants]
    component = abstract_component(model.document, path) if abstract else load_component(path)

    @settings(
        max_examples=examples,
        deadline=None,
        database=None,
        derandomize=not random,
        phases=(Phase.generate, Phase.shrink),  # explaining takes longer than all other phases
        suppress_health_check=list(HealthCheck),
    )
    @given(
        stimuli(
            path,
            guards=abstract if guards is None else guards,
            inner_events=abstract,
            balls=tuple(balls),
            max_size=steps,
        )
    )
    def run(taken: list[Move]) -> None:
        b = Behavior(component(), document=path, **options)
        try:
            _Examination(b, [*checks, *(each.start(b) for each in stated)]).run(taken)
        finally:
            b.close()

    log = component._hfsm_log
    before, log.disabled = log.disabled, True  # shrinking repeats the same failure many times
    try:
        run()
    finally:
        log.disabled = before
        forget(component)


class _Examination(Observer):
    """Check a behavior after each cycle, when its automata are consistent."""

    def __init__(self, b: Behavior, checks: Sequence[Check]) -> None:
        self._b = b
        self._checks = checks
        self._broken: tuple[str, float, str] | None = None
        b.tree.observers.append(self)

    def run(self, steps: Sequence[Move]) -> None:
        """Take the steps; raises BehaviorFailed at the first after which a check has failed."""
        self._look()
        self._check([])
        for number, step in enumerate(steps, 1):
            try:
                step.apply(self._b)
            except BehaviorFailed as failure:
                raise BehaviorFailed(f"{failure}\nsteps:{_listed(steps[:number])}") from failure.__cause__
            self._check(steps[:number])

    def cycle_ended(self, run: Actor, at: int) -> None:  # noqa: ARG002
        """Check the properties."""
        self._look()

    def _look(self) -> None:
        if self._broken is not None:
            return
        for name, check in self._checks:
            try:
                fine = check(self._b)
            except AssertionError as error:
                name, fine = f"{name}: {error}", False  # noqa: PLW2901
            if fine is False:
                self._broken = (name, self._b.time, ", ".join(self._b.active_paths))
                return

    def _check(self, steps: Sequence[Move]) -> None:
        if self._broken is not None:
            name, time, where = self._broken
            what = f"{name} does not hold at {time:g} s, in {where}"
            raise BehaviorFailed(f"{what}; steps:{_listed(steps)}\n{self._b.timeline}")


def _listed(steps: Sequence[Move]) -> str:
    return "".join(f"\n    {step!r}" for step in steps) or "\n    (none)"
