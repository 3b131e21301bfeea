"""The statistics of trials, against published examples."""

from __future__ import annotations

import pytest

from visualhfsm.trials._statistics import mcnemar, mean_difference, quartiles, success_rate


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


def test_the_interval_of_a_mean_difference_holds_the_true_one() -> None:
    first = [float(n % 7) for n in range(200)]
    second = [value + 0.5 + 0.1 * ((n * 31) % 5 - 2) for n, value in enumerate(first)]
    mean, low, high = mean_difference(first, second)
    assert low < 0.5 < high
    assert high - low < 0.05
    assert (mean, low, high) == mean_difference(first, second)


def test_equal_numbers_differ_by_nothing() -> None:
    assert mean_difference([1.0, 2.0], [1.0, 2.0]) == (0.0, 0.0, 0.0)
    assert mean_difference([1.0], [3.0]) == (2.0, 2.0, 2.0)


def test_quartiles_are_those_of_the_numbers() -> None:
    found = quartiles([4.0, 1.0, 3.0, 2.0, 5.0])
    assert (found.least, found.lower, found.median, found.upper, found.greatest) == (1, 2, 3, 4, 5)
    assert (found.count, found.mean) == (5, 3.0)
