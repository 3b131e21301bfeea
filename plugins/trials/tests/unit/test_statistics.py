"""The statistics of trials, against published examples."""

from __future__ import annotations

import json
import subprocess

import numpy as np
import pytest

from tests.support.limits import RUN_LIMIT
from tests.support.places import ROOT
from tests.support.present import present
from tests.support.soak import repeated
from visualhfsm.plugins import percent
from visualhfsm_trials._statistics import (
    figure,
    mcnemar,
    mean_of,
    quartiles,
    rarest,
    rate_difference,
    require_scipy,
)


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
    ],
)
def test_a_mean_without_an_interval_says_why(numbers: list[float], why: str) -> None:
    found = mean_of(numbers)
    assert (found.interval, found.why) == (None, why)
    assert found.mean == pytest.approx(sum(numbers) / len(numbers))


@pytest.mark.parametrize(
    ("numbers", "why"),
    [
        ([0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 2.0], "(few different values)"),
        ([2e-5, 2e-5, 2e-5, 2e-5, 1e300, 2e300, 2e-5], "(few different values)"),
        ([1.0, 1.1, 0.9, 1.05, 0.95, 1.0, 1.02, 0.98, 1.01, 10.0], "(one number is far from the others)"),
        ([-8.0, 1.1, 0.9, 1.05, 0.95], "(one number is far from the others)"),
        ([1.0, 2.0, 3.0, 4.0, 5.0], ""),
    ],
)
def test_an_interval_says_why_it_may_not_hold_the_mean(numbers: list[float], why: str) -> None:
    found = mean_of(numbers)
    assert found.interval is not None
    assert found.why == why
    low, high = found.interval
    assert low < found.mean < high


@pytest.mark.parametrize("others", [4, 9, 30])
def test_an_interval_with_one_far_number_is_not_absurd(others: int) -> None:
    # Student's t ends at 3.9 for nine others, and below 0; the bootstrap-t alone at 80.
    numbers = [1.0 + 0.1 * (n % 3 - 1) + 0.01 * n for n in range(others)] + [10.0]
    low, high = present(mean_of(numbers).interval)
    assert 0.9 < low < 1.2
    assert high < 10.0 + 2 * 9.0
    assert high < 10.3 or others < 9
    assert present(mean_of(numbers, (0.0, 12.0)).interval)[1] < 12.0


@pytest.mark.slow
@pytest.mark.parametrize(("count", "most"), [(5, 200), (10, 20), (20, 0)])
def test_no_interval_reaches_beyond_what_a_number_can_be(count: int, most: int) -> None:
    random = np.random.default_rng(6)
    beyond = 0
    for _ in range(200):
        numbers = np.where(
            random.random(count) < 0.1, random.normal(10, 1, count), random.normal(1, 0.2, count)
        )
        bounds = float(numbers.min()) - 0.01, float(numbers.max()) + 0.01
        low, high = present(mean_of(numbers.tolist(), bounds).interval)
        assert bounds[0] < low < numbers.mean() < high < bounds[1]
        beyond += present(mean_of(numbers.tolist()).interval)[1] > numbers.max()
    assert beyond <= most, "without bounds, hardly one of ten numbers and more ends beyond the largest"


@pytest.mark.slow
@pytest.mark.parametrize(("count", "ones"), [(5, 2), (10, 1), (10, 5), (50, 3), (50, 25)])
def test_the_interval_of_two_values_is_that_of_clopper_and_pearson(count: int, ones: int) -> None:
    # C. Clopper and E. Pearson, Biometrika 26 (1934), as SciPy computes it
    exact = require_scipy().binomtest(ones, count).proportion_ci(0.95, method="exact")
    low, high = present(mean_of([0.0] * (count - ones) + [1.0] * ones).interval)
    reach = 0.012 if count < 20 else 0.03  # from 20 on, the bootstrap-t may be narrower
    assert low == pytest.approx(exact.low, abs=reach)
    assert high == pytest.approx(exact.high, abs=reach)
    assert exact.low - 0.012 <= low
    assert high <= exact.high + 0.012


@pytest.mark.slow
@pytest.mark.parametrize("count", [5, 10])
@pytest.mark.parametrize("draw", ["normal", "exponential"])
def test_intervals_of_few_numbers_hold_the_mean_nine_times_of_ten(draw: str, count: int) -> None:
    # of 2,000 draws 92 and 93 % of five, 96 and 94 % of ten: plugins/trials/benchmarks/bench_trials.py
    random = np.random.default_rng(8)
    times = repeated(400, soak=4000)
    held = 0
    for _ in range(times):
        numbers = random.normal(1.0, 1.0, count) if draw == "normal" else random.exponential(1.0, count)
        low, high = present(mean_of(numbers.tolist()).interval)
        held += low <= 1.0 <= high
    assert held >= 0.90 * times


def test_what_is_rarer_than_three_of_the_trials_may_be_missing() -> None:
    # the rule of three: J. Hanley and A. Lippman-Hand (1983)
    assert rarest(300) == pytest.approx(3 / 300, rel=0.01)
    assert 0.9**20 > 0.05 > 0.9**29
    assert rarest(20) > 0.1 > rarest(29)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("count", [4, 6, 24])
def test_a_mean_of_the_largest_numbers_is_a_number(count: int) -> None:
    found = mean_of([1.6e308, 1.7e308] * (count // 2))
    assert found.mean == pytest.approx(1.65e308)
    assert all(1.6e308 < end < 1.7e308 for end in found.interval or ())


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
    times = repeated(500, soak=2000)
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
      const {PLUGINS, knowNames} = await import(process.argv[1] + "tests/page/page.js");
      knowNames();
      const {percent, short} = await import(PLUGINS + "trials/src/visualhfsm_trials/static/figures.js");
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
