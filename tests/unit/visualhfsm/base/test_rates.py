"""The interval of a rate, against published examples."""

from __future__ import annotations

import pytest

from visualhfsm._base.rates import success_rate


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
