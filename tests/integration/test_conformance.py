"""The conformance suite that is shipped, on every body, without physics and in simulation."""

from __future__ import annotations

from tests.support.conformance import robots
from tests.support.conformance_suite import NAMED, SUITE, parametrize

globals().update(SUITE)


def pytest_generate_tests(metafunc):
    """Run each test on the robots that have what it needs."""
    parametrize(metafunc, lambda able, bodies, weight: robots(able, bodies=bodies, weight=weight))


def test_no_test_of_the_suite_hides_another():
    assert len(NAMED) == len(dict(NAMED))
