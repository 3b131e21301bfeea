"""Search for a run in which a behavior does what it must not do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final

from hypothesis import HealthCheck, Phase, given, settings

from codegen.hfsm.document import Property
from codegen.hfsm.model_checker.expressions import ExpressionError, Holds, parse
from codegen.hfsm.model_checker.model import Model, nanoseconds, read_model
from codegen.hfsm.model_checker.transition_system import ACTIVE, FINISHED
from hfsm_runtime.observer import Observer
from hfsm_runtime.tree import Run
from hfsm_runtime.virtual.errors import BehaviorFailed, says_it_all
from hfsm_runtime.virtual.execution import name_of
from visualhfsm.simulation import Behavior
from visualhfsm.simulation._loading import DocumentInvalid, forget, load_component, read

from ._abstraction import abstract_component
from .strategies import Step, stimuli

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
    stated = [_Stated(each, model) for each in model.document.properties]
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
    def run(taken: list[Step]) -> None:
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


_Check = tuple[str, Invariant]


class _Examination(Observer):
    """Check a behavior after each cycle, when its automata are consistent."""

    def __init__(self, b: Behavior, checks: Sequence[_Check]) -> None:
        self._b = b
        self._checks = checks
        self._broken: tuple[str, float, str] | None = None
        b.tree.observers.append(self)

    def run(self, steps: Sequence[Step]) -> None:
        """Take the steps; raises BehaviorFailed at the first after which a check has failed."""
        self._look()
        self._check([])
        for number, step in enumerate(steps, 1):
            try:
                step.apply(self._b)
            except BehaviorFailed as failure:
                raise BehaviorFailed(f"{failure}\nsteps:{_listed(steps[:number])}") from failure.__cause__
            self._check(steps[:number])

    def cycle_ended(self, run: Run, at: int) -> None:  # noqa: ARG002
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

    def _check(self, steps: Sequence[Step]) -> None:
        if self._broken is not None:
            name, time, where = self._broken
            what = f"{name} does not hold at {time:g} s, in {where}"
            raise BehaviorFailed(f"{what}; steps:{_listed(steps)}\n{self._b.timeline}")


def _listed(steps: Sequence[Step]) -> str:
    return "".join(f"\n    {step!r}" for step in steps) or "\n    (none)"


class _Stated:
    """A property that a document states, as the model checker understands it."""

    def __init__(self, stated: Property, model: Model) -> None:
        self._model: Final = model
        self._kind: Final = stated.kind.strip()
        self._within: Final = nanoseconds(stated.within)
        text = " ".join(stated.expression.text.split())
        self._name: Final = f"property {stated.name or text!r} ({self._kind} {text})"
        try:
            expression = parse(stated.expression.text, model)
        except ExpressionError as error:
            raise DocumentInvalid(f"{model.path}:{stated.line}: {self._name}: {error}") from error
        self._holds: Final[Holds] = expression.bind(
            {automaton.index: automaton.index for automaton in model.automata}
        )

    def start(self, b: Behavior) -> _Check:
        """Return the check for a run."""
        runs = [b.tree.run(automaton.source.id) for automaton in self._model.automata]
        seen = False

        def check(b: Behavior) -> bool:
            nonlocal seen
            now = round(b.time * 1e9)
            if seen or (self._within is not None and now > self._within and self._kind != "eventually"):
                return True
            holds = self._holds(tuple(self._local(index, run) for index, run in enumerate(runs)))
            if self._kind == "eventually":
                seen = holds
                return holds or self._within is None or now < self._within
            return holds is (self._kind == "always")

        return self._name, check

    def _local(self, index: int, run: Run | None) -> tuple[int, int, int]:
        if run is None:
            return 0, 0, 0
        states = self._model.automata[index].states
        state = next(each.index for each in states if each.source.id == run.current.id)
        return state, (ACTIVE if run.active else 0) | (FINISHED if run.finished else 0), 0
