"""The statistics of trials, against published examples."""

from __future__ import annotations

import json
import subprocess

import numpy as np
import pytest

from tests.support.limits import RUN_LIMIT
from tests.support.places import ROOT
from tests.support.soak import repeated
from visualhfsm.trials._statistics import (
    figure,
    mcnemar,
    mean_of,
    percent,
    quartiles,
    rate_difference,
    success_rate,
)


def test_the_interval_of_wilson_is_that_of_newcombe() -> None:
    # Newcombe, "Two-sided confidence intervals for the single proportion", Statistics in Medicine 17 (1998),
    # table I: 81 of 263, 15 of 148, 0 of 20, 1 of 29.
    for successes, trials, low, high in (
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ):
        rate = success_rate(successes, trials)
        assert rate.lowest == pytest.approx(low, abs=5e-5)
        assert rate.highest == pytest.approx(high, abs=5e-5)


def test_no_trials_say_nothing() -> None:
    rate = success_rate(0, 0)
    assert (rate.rate, rate.lowest, rate.highest, str(rate)) == (0.0, 0.0, 1.0, "no trials")


@pytest.mark.slow
def test_a_difference_in_trials_that_changed_is_as_likely_as_coins() -> None:
    assert mcnemar(0, 0) == 1.0
    assert mcnemar(5, 5) == 1.0
    assert mcnemar(0, 5) == pytest.approx(2 / 2**5)
    assert mcnemar(1, 9) == pytest.approx(2 * (1 + 10) / 2**10)


def test_the_interval_of_a_mean_holds_it_and_is_always_the_same() -> None:
    numbers = [0.5 + 0.1 * ((n * 31) % 5 - 2) for n in range(200)]
    found = mean_of(numbers)
    assert found.interval is not None
    low, high = found.interval
    assert low < 0.5 < high < low + 0.05
    assert found == mean_of(numbers)


@pytest.mark.parametrize(
    ("numbers", "why"),
    [
        ([1.0, 4.0, 2.0, 8.0], "(fewer than 5 trials)"),
        ([0.1 + 0.2, 0.3, 0.3, 0.3, 0.3], "in each"),
        ([0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 2.0], "(few different values)"),
        ([2e-5, 2e-5, 2e-5, 2e-5, 1e300, 2e300, 2e-5], "(few different values)"),
    ],
)
def test_a_mean_without_an_interval_says_why(numbers: list[float], why: str) -> None:
    found = mean_of(numbers)
    assert (found.interval, found.why) == (None, why)
    assert found.mean == pytest.approx(sum(numbers) / len(numbers))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("scale", [1.0, 2.0**-1060, 2.0**-300, 2.0**1000])
def test_the_interval_of_a_mean_is_as_large_as_its_numbers(scale: float) -> None:
    numbers = [
        1.0,
        1.0,
        2.0,
        3.0,
        3.0,
        2.0,
        5.0,
    ]  # of some samples all numbers are 2, and so is the mean of few
    ends = mean_of(numbers).interval
    assert ends is not None
    assert mean_of([scale * each for each in numbers]).interval == pytest.approx(
        [scale * each for each in ends], rel=1e-3
    )


@pytest.mark.filterwarnings("error")
def test_values_that_only_differ_by_rounding_are_the_same_in_an_interval() -> None:
    rounded = [0.1 + 0.2, 0.3, 0.3, 0.1 + 0.2, 0.3, 0.3, 5.0, 5.0 + 1e-15]
    assert mean_of(rounded).interval == pytest.approx(mean_of([0.3] * 6 + [5.0] * 2).interval)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("draw", "true", "least"),
    [("exponential", 1.0, 0.92), ("uniform", 0.5, 0.94), ("binomial", 0.5, 0.94)],
)
def test_intervals_of_twenty_skewed_or_even_numbers_hold_the_mean_as_often_as_they_say(
    draw: str, true: float, least: float
) -> None:
    random = np.random.default_rng(3)
    draws = {
        "exponential": lambda: random.exponential(1.0, 20),
        "uniform": lambda: random.uniform(0.0, 1.0, 20),
        "binomial": lambda: random.integers(0, 2, 20),
    }
    times = repeated(1000, soak=2000)
    found = [mean_of(draws[draw]().tolist()).interval for _ in range(times)]
    held = sum(each is not None and each[0] <= true <= each[1] for each in found)
    assert held >= least * times


def test_the_difference_of_two_rates_of_the_same_trials_has_an_interval() -> None:
    found = rate_difference(20, only_first=5, only_second=0)
    assert found.mean == -0.25
    assert found.interval == pytest.approx((-0.443, -0.0116), abs=5e-4)
    assert rate_difference(20, 0, 0).mean == 0.0


@pytest.mark.slow
def test_terminal_and_page_round_alike() -> None:
    random = np.random.default_rng(5)
    numbers = [0.0, 1234.5, -1234.5, 0.0625, 123_400.0, 1e-7, 36 / 40, 0.76948, 1e12, 2.675, -0.0]
    numbers += [999_949_999_999.0, 999_950_000_001.0, 0.99995e-6, 0.999951e-6, 1e300, -2.5e-307]
    numbers += (random.normal(size=500) * 10.0 ** random.integers(-9, 15, 500)).tolist()
    parts = [n / d for d in range(1, 41) for n in range(d + 1)] + random.random(500).tolist()
    rounding = """
      await import(process.argv[1] + "tests/page/page.js");
      const {percent, short} = await import(process.argv[1] + "visualhfsm/_editor/static/trials/figures.js");
      const [numbers, parts] = JSON.parse(process.argv[2]);
      console.log(JSON.stringify([numbers.map(short), parts.map(percent)]));
    """
    command = [
        "node",
        "--input-type=module",
        "-e",
        rounding,
        f"{ROOT.as_uri()}/",
        json.dumps([numbers, parts]),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=RUN_LIMIT, check=True)
    said = [*map(figure, numbers)], [f"{percent(part)} %" for part in parts]
    assert json.loads(done.stdout) == [*said]


def test_quartiles_are_those_of_the_numbers() -> None:
    found = quartiles([4.0, 1.0, 3.0, 2.0, 5.0])
    assert (found.least, found.lower, found.median, found.upper, found.greatest) == (1, 2, 3, 4, 5)
    assert (found.count, found.mean) == (5, 3.0)
