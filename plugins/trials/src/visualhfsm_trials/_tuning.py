"""The search for the parameters with which a behavior does best, by Optuna.

Every setting of the parameters runs the same trials, and one that does worse on them than the best so far,
by Wilcoxon's signed-rank test, is given up. Trials that choose a setting flatter it: what is found is to be
run on fresh ones, beside the document with its own parameters. The same plan finds the same with any number
of workers.
"""

from __future__ import annotations

import math
import threading
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final

import msgspec

from visualhfsm.trials import Outcome, Plan, Pool, Quantity, Spread, Task, TrialsError, Value, run_tasks
from zenoh_ice.data.status import version_of

from ._record import Record, read_outcomes
from ._series import KeptSeries
from ._summary import Summary

if TYPE_CHECKING:
    from optuna.distributions import BaseDistribution
    from optuna.study import Study
    from optuna.trial import Trial

TIME: Final = "time"
_SIDE_BY_SIDE: Final = 4
"""Settings that run at a time, however many workers there are: each setting depends on those before."""
_ROUND: Final = 4
"""Trials of each of them between two looks whether one is to be given up."""
_FAILURE: Final = 10.0
"""A failed trial costs so many times the most that others cost, as PAR10 in configuring algorithms."""


_BORDER: Final = 0.02
"""Part of a range that is its end."""


class Tuning:
    """The search for the parameters with which fewest trials fail, and those that succeed cost least.

    The parameters that have a range or choices in the plan are searched. `cost` is the number that a
    successful trial costs, by default its time. Raises TrialsError for a plan without such parameters.
    """

    def __init__(self, plan: Plan, *, settings: int, cost: str = TIME) -> None:
        self._space: Final = {name: each for name, each in plan.parameters.items() if _is_searched(each)}
        if not self._space:
            raise TrialsError.because(
                "no parameter has a range: write those to be tuned under [parameters] of the plan"
            )
        self.settings: Final = settings
        self.given_up = 0
        """The number of settings that were given up."""
        self.most_trials: Final = plan.runs * (settings + (cost != TIME))
        """The number of trials of a search in which none is given up."""
        self._plan: Final = plan
        self._cost: Final = cost
        self._series: Final = KeptSeries(plan)

    @property
    def fresh(self) -> Plan:
        """The plan with the document's own parameters and fresh trials, those of the next seed."""
        return msgspec.structs.replace(self._untuned, seed=self._plan.seed + 1)

    def border(self, name: str, value: Value) -> str:
        """Return at which end of its range a value lies, in words; empty within it."""
        quantity = self._space[name]
        if not isinstance(quantity, Spread) or not isinstance(value, int | float):
            return ""
        scale = math.log if quantity.log else float
        low, found, high = (scale(each) for each in (quantity.bounds[0], value, quantity.bounds[1]))
        if found - low <= _BORDER * (high - low):
            return f"at the low end of its range, {quantity.bounds[0]:g}: below may be better"
        if high - found <= _BORDER * (high - low):
            return f"at the high end of its range, {quantity.bounds[1]:g}: above may be better"
        return ""

    @property
    def _untuned(self) -> Plan:
        own = {name: each for name, each in self._plan.parameters.items() if name not in self._space}
        return msgspec.structs.replace(self._plan, parameters=own)

    def search(
        self,
        file: Path,
        pool: Pool[Outcome],
        ended: Callable[[int], object] = lambda _: None,
        stop: threading.Event | None = None,
        *,
        again: bool = False,
    ) -> dict[str, Value] | None:
        """Return the best parameters, or None when `stop` was set.

        Outcomes are kept in a file, with which the same search goes on, or begins `again`. `ended` is called
        with numbers of trials that have ended or that nobody needs. Raises TrialsError, also if all fail.
        """
        import optuna  # needs a second

        optuna.logging.set_verbosity(optuna.logging.WARNING)
        with warnings.catch_warnings():  # the pruner counts as experimental, and in Optuna 4 both arguments
            warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
            pruner = optuna.pruners.WilcoxonPruner()
            sampler = optuna.samplers.TPESampler(  # so, Optuna 4.9.0 and 5.0.0 ask for the same settings
                seed=self._plan.seed, multivariate=False, constant_liar=True
            )
        study = optuna.create_study(sampler=sampler, pruner=pruner)
        space = {name: _distribution(each) for name, each in self._space.items()}
        header = self._series.header
        versions = {**header.versions, **{name: version_of(name) for name in ("optuna", "scipy")}}
        digest = f"{header.digest}/{self._plan.runs}"
        header = msgspec.structs.replace(header, digest=digest, versions=versions)
        with Record(file, header, again=again) as record:
            runs = _Runs(self._series, record, pool, ended, stop)
            if not self._learn_failure(runs):
                return None
            for first in range(0, self.settings, _SIDE_BY_SIDE):
                asked = [study.ask(space) for _ in range(min(_SIDE_BY_SIDE, self.settings - first))]
                if not self._run_side_by_side(study, asked, runs):
                    return None
            runs.require_success()
        return dict(study.best_params)

    def _learn_failure(self, runs: _Runs) -> bool:
        """Find out what a failed trial costs; return whether all of its trials ended."""
        if self._cost == TIME:
            self._failure = _FAILURE * self._plan.limit
            return True
        found = runs.outcomes({0: self._untuned}, self._plan.trials)
        if found is None:
            return False
        numbers = [abs(each.numbers[self._cost]) for each in found.values() if self._cost in each.numbers]
        if not numbers:
            names = sorted({name for each in found.values() for name in each.numbers})
            raise TrialsError.because(
                "no trial has a number {cost}; there are time, {names}",
                cost=self._cost,
                names=", ".join(names),
            )
        self._failure = _FAILURE * max(numbers)
        return True

    def _run_side_by_side(self, study: Study, asked: list[Trial], runs: _Runs) -> bool:
        """Run some settings, until each has run all trials or is given up; return whether all did."""
        from optuna.trial import TrialState

        costs: dict[int, list[float]] = {setting.number: [] for setting in asked}
        left = asked
        for first in range(0, self._plan.runs, _ROUND):
            numbers = self._plan.trials[first : first + _ROUND]
            found = runs.outcomes(
                {each.number + 1: self.with_parameters(each.params) for each in left}, numbers
            )
            if found is None:
                return False
            for setting in left:
                for number in numbers:
                    cost = self._cost_of(found[setting.number + 1, number])
                    costs[setting.number].append(cost)
                    setting.report(cost, number)
            hopeless = [setting for setting in left if setting.should_prune()]
            for setting in hopeless:
                study.tell(setting, state=TrialState.PRUNED)
                runs.ended(self._plan.runs - numbers[-1])
            self.given_up += len(hopeless)
            left = [setting for setting in left if setting not in hopeless]
        for setting in left:
            study.tell(setting, sum(costs[setting.number]) / self._plan.runs)
        return True

    def with_parameters(self, parameters: Mapping[str, Value], plan: Plan | None = None) -> Plan:
        """Return the plan, or another one, with some parameters."""
        plan = plan or self._plan
        return msgspec.structs.replace(plan, parameters={**plan.parameters, **parameters})

    def _cost_of(self, outcome: Outcome) -> float:
        if not outcome.success:
            return self._failure
        return outcome.time if self._cost == TIME else outcome.numbers.get(self._cost, self._failure)


class _Runs:
    """The trials of settings, those that ended earlier from the file."""

    def __init__(
        self,
        series: KeptSeries,
        record: Record,
        pool: Pool[Outcome],
        ended: Callable[[int], object],
        stop: threading.Event | None,
    ) -> None:
        self._series = series
        self._record = record
        self._pool = pool
        self._stop = stop
        self._runs = series.plan.runs
        self._known = {outcome.number: outcome for outcome in read_outcomes(record.path)}
        self.ended = ended

    def require_success(self) -> None:
        """Raise TrialsError if no trial of a setting succeeded, with what they fail of."""
        tried = [outcome for outcome in self._known.values() if outcome.number > self._runs]
        if not any(outcome.success for outcome in tried):
            way = Summary(tried, ()).ways[0]
            raise TrialsError.because(
                "no setting is best, as all trials fail, {count} of {all} so: {reason} in {states}",
                reason=way.reason,
                states=way.states,
                count=len(way.numbers),
                all=len(tried),
            )

    def outcomes(self, plans: Mapping[int, Plan], numbers: range) -> dict[tuple[int, int], Outcome] | None:
        """Return the outcomes of trials of some settings, by setting and number; None when it is to stop."""
        keys = {(setting, number): setting * self._runs + number for setting in plans for number in numbers}
        missing = {key: place for key, place in keys.items() if place not in self._known}
        tasks = (
            (place, Task(plans[setting], number, self._series.archive))
            for (setting, number), place in missing.items()
        )
        self.ended(len(keys) - len(missing))
        for place, outcome in run_tasks(tasks, self._pool, self._stop):
            kept = msgspec.structs.replace(outcome, number=place)
            self._record.add(kept)
            self._known[place] = kept
            self.ended(1)
        if any(place not in self._known for place in missing.values()):
            return None
        return {key: self._known[place] for key, place in keys.items()}


def _is_searched(quantity: Quantity) -> bool:
    """Return whether a parameter has a range or choices; one with a normal distribution is noise."""
    return isinstance(quantity, tuple) or (isinstance(quantity, Spread) and quantity.mean is None)


def _distribution(quantity: Quantity) -> BaseDistribution:
    from optuna.distributions import CategoricalDistribution, FloatDistribution, IntDistribution

    if isinstance(quantity, tuple):
        return CategoricalDistribution(quantity)
    assert isinstance(quantity, Spread)
    low, high = quantity.bounds
    if quantity.whole:
        return IntDistribution(round(low), round(high), log=quantity.log)
    return FloatDistribution(low, high, log=quantity.log)
