"""Two speeds of tests: `make test-all` holds every promise once, `make soak` repeats what only repetition finds.

`TEST_SOAK=1`, which `make soak` sets, runs the tests that are marked `soak`, too, and as many repetitions as they ask
for. The mark names the test that holds the same promise in `make test-all`, in one deterministic case.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any, Final, TypeVar

import pytest

__all__ = ["LEFT_TO_SOAK", "OTHERS", "SOAKS", "cases", "repeated"]

T = TypeVar("T")

SOAKS: Final = os.environ.get("TEST_SOAK", "") not in ("", "0")
"""Whether this is a run of `make soak`."""
LEFT_TO_SOAK: Final = pytest.StashKey[list[pytest.Item]]()
"""The collected tests that this run leaves to `make soak`."""
OTHERS: Final = pytest.StashKey[list[pytest.Item]]()
"""The other collected tests, among which options such as `-m` select."""


def repeated(test: T, soak: T) -> T:
    """Return how often, how long or with what to repeat something: without a soak, and in `make soak`."""
    return soak if SOAKS else test


def cases(test: Iterable[Any], soak: Iterable[Any]) -> list[Any]:
    """Return the parameters of a test: those that always run, and those that only `make soak` adds.

    Several values for several names are a `pytest.param`. Where some always run, the others are only there in a soak:
    pytest would make a test of each before it left it out.
    """
    always = [*test]
    return [*always, *map(_soaked, soak)] if SOAKS or not always else always


def _soaked(value: Any) -> Any:
    if isinstance(value, type(pytest.param())):
        return pytest.param(*value.values, marks=[*value.marks, pytest.mark.soak], id=value.id)
    return pytest.param(value, marks=pytest.mark.soak)
