"""The newest value of a stream that may be old, missing, or of another interface."""

from __future__ import annotations

import time

import pytest

from visualhfsm._monitor.realm.realm import Newest
from zenoh_ice import MarshalException, Sample


def sample(value: int, age: float = 0.0) -> Sample[int]:
    return Sample(value=value, sequence=1, time=0.0, wall_time=time.time() - age)


def test_what_does_not_fit_is_reported_once_until_something_fits(caplog: pytest.LogCaptureFixture) -> None:
    comes: list[Sample[int] | None] = [None, None, sample(1), None]

    def read() -> Sample[int] | None:
        found = comes.pop(0)
        if found is None:
            raise MarshalException("it is of another interface")
        return found

    newest = Newest(read)
    assert [newest(), newest()] == [None, None]
    assert newest.trouble
    assert len(caplog.records) == 1
    found = newest()
    assert found is not None
    assert found.value == 1
    assert newest.trouble == ""
    assert newest() is None
    assert len(caplog.records) == 2


def test_what_is_too_old_is_nothing() -> None:
    assert Newest(lambda: sample(1, age=5.0), oldest=2.0)() is None
    assert Newest(lambda: sample(1, age=5.0))() is not None
