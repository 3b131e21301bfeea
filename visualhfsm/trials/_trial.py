"""One trial, in this process: a behavior in virtual time, its disturbances, and how it is judged."""

from __future__ import annotations

import logging
import math
import os
import random
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, redirect_stderr, redirect_stdout
from functools import partial
from pathlib import Path
from typing import Any, Final, Protocol, TypeVar

import numpy as np

from codegen.reasons import reason
from hfsm_runtime.observer import Observer
from hfsm_runtime.tree import Actor, ChangeKind
from hfsm_runtime.virtual.errors import BehaviorFailed, UnknownName
from naoserver.errors import RobotError
from visualhfsm.simulation import Behavior, Team, simulate, simulate_team
from visualhfsm.simulation._properties import stated_properties
from zenoh_ice.data.text import encodable

from ._disturbances import Disturbances
from ._errors import TrialsError
from ._fate import Fate
from ._functions import FunctionFailed, call_function
from ._outcomes import Outcome, StateChange
from ._plan import FAILS_AT, FAILURE, FATE, FATE_AT, SAMPLED, WALKS_ON, Plan
from ._quantities import Value, Values
from ._scene import scene_of

_PERIOD: Final = 0.1
"""s between two samples."""
_MOST_CHANGES: Final = 200
_LONGEST_ERROR: Final = 10_000

T = TypeVar("T")


@contextmanager
def quiet() -> Iterator[None]:
    """Let nothing that a trial prints or logs come between those of others, in a `with` block."""
    with Path(os.devnull).open("w") as nowhere, redirect_stdout(nowhere), redirect_stderr(nowhere):
        logging.disable()
        try:
            yield
        finally:
            logging.disable(logging.NOTSET)


def draw_values(plan: Plan, number: int) -> dict[str, Value]:
    """Return the values of a trial. Raises TrialsError."""
    if plan.accept is None:
        return plan.draw(number)
    accept = partial(call_function, plan.accept, Path(plan.document).parent, take=bool)
    try:
        return plan.draw(number, accept)
    except FunctionFailed as failure:
        raise TrialsError.because("no trial can be drawn: {reason}", reason=str(failure)) from failure


class Witness(Protocol):
    """Somebody who watches a trial."""

    def begin(self, behavior: Behavior, values: Values) -> None:
        """See it before its first cycle, with the values that were drawn."""

    def observe(self, behavior: Behavior) -> None:
        """See it ten times a second."""

    def end(self, outcome: Outcome) -> None:
        """See what it came to, while the behavior can still be asked."""


def run_trial(
    plan: Plan,
    number: int,
    recording: Path | None = None,
    *,
    folder: Path | None = None,
    simulate: Callable[..., Behavior] = simulate,
    witness: Witness | None = None,
) -> Outcome:
    """Run a trial of a plan in this process and return its outcome; perhaps it is recorded in a file.

    `folder` has the documents of the other robots and the file of the world, which stand beside the plan's
    document unless it is given. `simulate` makes each behavior, with the arguments of
    `visualhfsm.simulation.simulate`; if it raises BehaviorFailed, the trial has failed. The random numbers
    of Python and NumPy that the behaviors use begin with the trial's seed. Raises TrialsError for a plan
    that is not possible, DocumentInvalid for a document.
    """
    values = draw_values(plan, number)
    seed = plan.seed_of(number)
    random.seed(seed)
    np.random.seed(seed)
    folder = folder or Path(plan.document).parent
    scene = scene_of(plan, {name: values[name] for name in plan.scene}, folder)
    parameters = {name: values[f"parameters.{name}"] for name in plan.parameters}
    settings = {"stand_ins": plan.stand_ins, **scene.settings}
    if plan.robot == "sim":
        settings |= {"camera": plan.camera, "seed": seed}
    try:
        running = _begin(plan, folder, simulate, parameters, settings)
    except (RobotError, UnknownName) as error:
        raise TrialsError.because(
            "trial {number} is not possible: {reason}", number=number, reason=reason(error)
        ) from error
    except BehaviorFailed as failure:
        return _not_begun(number, values, failure)
    with closing(running):
        behavior = running if isinstance(running, Behavior) else running.behaviors[0]
        scene.set_up(behavior)
        if recording is None:
            return _watched(_Trial(plan, number, values, behavior, running.advance), witness)
        from ._recording import BehaviorRecording  # needs Pillow

        with closing(BehaviorRecording(behavior, recording)) as recorded:
            trial = _Trial(plan, number, values, behavior, running.advance)
            trial.watchers.append(recorded.write)
            return _watched(trial, witness)


def _begin(
    plan: Plan,
    folder: Path,
    simulate: Callable[..., Behavior],
    parameters: Values,
    settings: dict[str, Any],
) -> Behavior | Team:
    """Make the behavior, or with others beside it a team whose first one it is."""
    if not plan.others:
        robot = None if plan.robot == "none" else plan.robot
        return simulate(plan.document, robot=robot, parameters=parameters, **settings)
    if plan.robot != "sim":
        raise TrialsError.because('others: there is one world for several robots only with robot = "sim"')
    documents = [plan.document, *(str(folder / each) for each in plan.others)]
    each = [parameters, *({} for _ in plan.others)]
    with TrialsError.in_place_of(ValueError, "others: {reason}"):
        return simulate_team(documents, parameters=each, simulate=simulate, **settings)


def _watched(trial: _Trial, witness: Witness | None) -> Outcome:
    """Run a trial, perhaps before a witness."""
    if witness is None:
        return trial.run()
    witness.begin(trial.behavior, trial.values)
    trial.watchers.append(lambda: witness.observe(trial.behavior))
    outcome = trial.run()
    witness.end(outcome)
    return outcome


def _not_begun(number: int, values: Values, failure: BehaviorFailed) -> Outcome:
    error = str(failure)[:_LONGEST_ERROR]
    reason = error.partition("\n")[0]
    return Outcome(number=number, values=values, success=False, reason=reason, error=error)


class _Trial:
    """A trial that runs."""

    def __init__(
        self, plan: Plan, number: int, values: Values, behavior: Behavior, advance: Callable[[float], object]
    ) -> None:
        self._plan = plan
        self._advance = advance
        self._number = number
        self.values = values
        self.behavior = behavior
        self.watchers: list[Callable[[], object]] = []
        """Called ten times a second."""
        self._folder = Path(plan.document).parent
        goal = plan.success.state
        if goal is not None and goal not in behavior.states:
            raise TrialsError.because(
                "there is no state {goal}; there are {states}", goal=goal, states=", ".join(behavior.states)
            )
        self._observed = _Observed(behavior, goal, properties=plan.success.properties)
        self._distance = 0.0
        self._place: tuple[float, float] | None = None
        self._samples: dict[str, list[float]] = {name: [] for name in plan.samples}
        disturbances = Disturbances(behavior, plan.disturbances, values)
        self._fate: Fate | None = None
        if plan.failures:
            self._fate = Fate(behavior, lambda: self._observed.cycles)
            self.watchers.append(self._fate.watch)
            disturbances.fail(str(values[FAILURE]), plan.fails_by, float(values[FAILS_AT]), self._fate.begin)

    def run(self) -> Outcome:
        """Run to the end: of success, of its limit, or of the behavior."""
        error = ""
        numbers: dict[str, float] = {}
        groups: dict[str, str] = {}
        try:
            try:
                reason = self._run() or self._judged()
            except BehaviorFailed as failure:
                error = str(failure)[:_LONGEST_ERROR]
                reason = error.partition("\n")[0]
            except FunctionFailed as failure:
                reason = str(failure)
            numbers = self._noted()
            groups = {name: self._call(each, _group) for name, each in self._plan.groups.items()}
            if self._fate is not None:
                reached = self._observed.reached is not None
                groups[FATE] = self._fate.end(reached=reached, success=not reason)
                numbers |= {WALKS_ON: self._fate.walked, FATE_AT: self._fate.at}
        except FunctionFailed as failure:
            reason = reason or str(failure)
        except MemoryError:
            reason = f"needs more than {self._plan.memory} MB of memory"
        behavior, observed = self.behavior, self._observed
        return Outcome(
            number=self._number,
            values=self.values,
            success=not reason,
            reason=reason,
            time=round(behavior.time, 6) if observed.reached is None else observed.reached,
            states=", ".join(behavior.active_paths),
            numbers=numbers,
            groups=groups,
            changes=tuple(observed.changes),
            left_out=observed.left_out,
            error=error,
        )

    def _run(self) -> str:
        """Advance until it ends; return why it failed, if it did."""
        behavior, success, observed = self.behavior, self._plan.success, self._observed
        start, step = behavior.clock.now(), 0
        while True:
            fell = self._sample()
            passed = behavior.clock.now() - start
            if observed.broken:
                return observed.broken
            if fell and success.upright:
                return "fell"
            if observed.reached is not None:
                return ""
            if behavior.ended.is_set():
                return f"ended before {success.state}" if success.state or behavior.halted else ""
            if passed >= self._plan.limit - 1e-9:
                return f"not in {success.state} after {self._plan.limit:g} s" if success.state else ""
            step += 1
            self._advance(max(0.0, min(step * _PERIOD, self._plan.limit) - passed))

    def _sample(self) -> bool:
        """Take the samples, and return whether the robot lies on the floor."""
        behavior = self.behavior
        for watch in self.watchers:
            watch()
        for name, reference in self._plan.samples.items():
            self._samples[name] += self._call(reference, _sampled)
        if self._plan.robot == "none":
            return False
        place, _ = place_of(behavior)
        if place is not None:
            self._distance += math.dist(self._place or place, place)
            self._place = place
        return behavior.robot.state.fallen

    def _judged(self) -> str:
        """Return why the plan's function does not call the trial good; empty if it does."""
        if self._plan.success.function is None:
            return ""
        return self._call(self._plan.success.function, _judgement)

    def _noted(self) -> dict[str, float]:
        behavior = self.behavior
        noted = {"calls": float(len(behavior.calls())), "cycles": float(self._observed.cycles)}
        if self._place is not None:
            noted["distance"] = self._distance
        for name, samples in self._samples.items():
            if samples:
                kept = (sum(samples) / len(samples), max(samples))
                noted |= dict(zip((f"{name} {kind}" for kind in SAMPLED), kept, strict=True))
        noted |= {name: self._call(each, float) for name, each in self._plan.numbers.items()}
        return {name: number for name, number in noted.items() if math.isfinite(number)}

    def _call(self, reference: str, take: Callable[[Any], T]) -> T:
        return call_function(reference, self._folder, self.behavior, take)


def _sampled(value: Any) -> list[float]:  # noqa: ANN401 - what a function returns
    return [] if value is None else [float(value)]


def _group(value: Any) -> str:  # noqa: ANN401 - what a function returns
    return encodable(str(value))


def _judgement(verdict: Any) -> str:  # noqa: ANN401 - what a function returns
    if isinstance(verdict, str):
        return encodable(verdict)
    return "" if verdict is None or bool(verdict) else "judged not good"


class _Observed(Observer):
    """What the automata of a trial do: their changes, their cycles, and the properties they keep."""

    def __init__(self, behavior: Behavior, goal: str | None, *, properties: bool) -> None:
        self._behavior = behavior
        self._goal = goal
        self.reached: float | None = None
        """When the goal was reached, in s of the trial."""
        self.broken = ""
        """The property that does not hold."""
        self.cycles = 0
        self.changes: deque[StateChange] = deque(maxlen=_MOST_CHANGES)
        self.left_out = 0
        stated = stated_properties(behavior.document) if properties and behavior.document else []
        self._checks = [each.start(behavior) for each in stated]
        self._note(0.0)
        behavior.tree.observers.append(self)

    def changed(self, now: int, run: Actor, kind: ChangeKind) -> None:  # noqa: ARG002
        """Note the states."""
        self._note(now / 1e9)

    def cycle_ended(self, run: Actor, at: int) -> None:  # noqa: ARG002
        """Count the cycle, and check the properties."""
        self.cycles += 1
        for name, holds in self._checks:
            if not self.broken and not holds(self._behavior):
                self.broken = f"{name} does not hold"

    def _note(self, time: float) -> None:
        states = ", ".join(self._behavior.active_paths)
        if self._goal is not None and self.reached is None and self._behavior.is_active(self._goal):
            self.reached = time
        if self.changes and self.changes[-1].states == states:
            return
        if self.changes and self.changes[-1].time == time:
            self.changes[-1] = StateChange(time, states)
            return
        self.left_out += len(self.changes) == _MOST_CHANGES
        self.changes.append(StateChange(time, states))


def place_of(behavior: Behavior) -> tuple[tuple[float, float] | None, float]:
    """Return where the robot is on the floor in m, None if nobody knows, and which way it faces in rad."""
    device = behavior.robot.device
    if device.stage is not None:
        torso = device.stage.truth().torso
        return (torso.position[0], torso.position[1]), torso.heading
    if device.walker is not None:
        odometry = device.walker.odometry()
        return (odometry.x, odometry.y), odometry.heading
    return None, math.nan
