"""The bound on the rate of messages."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from visualhfsm.web.limits import TokenBucket


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def test_a_burst_passes_and_the_rest_waits_for_its_turn() -> None:
    clock = Clock()
    bucket = TokenBucket(rate=10, burst=3, now=clock)
    assert [bucket.take() for _ in range(5)] == [0, 0, 0, 0.1, 0.2]
    clock.now = 0.2
    assert bucket.take() == 0.1
    clock.now = 100.0
    assert [bucket.take() for _ in range(4)] == [0, 0, 0, 0.1]


@given(st.lists(st.floats(0, 2), min_size=1, max_size=200))
def test_who_waits_as_told_keeps_the_rate(pauses: list[float]) -> None:
    clock = Clock()
    bucket = TokenBucket(rate=10, burst=5, now=clock)
    for taken, pause in enumerate(pauses, 1):
        clock.now += bucket.take()
        assert taken <= 5 + 10 * clock.now + 1e-6
        clock.now += pause
