"""Calls that block an automaton for longer than its period."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.documents import document, problems, state, sub


def test_a_sleep_is_reported_for_the_shortest_period_that_calls_it(path: Path) -> None:
    functions = "def rest(self):\n    self.nap()\n\ndef nap(self):\n    self.sleep(0.5)"
    fast = sub(2, 1, state(1, "b", "self.rest()", initial=True), period="200")
    text = document(
        sub(1, 0, state(1, "a", "self.rest()", initial=True, child=2), period="1000", functions=functions),
        fast,
    )
    (found,) = problems(path, text)
    assert "W523: `self.sleep` waits for 0.5 s, longer than the period" in found
    assert problems(path, text.replace(">200<", ">600<")) == []


@pytest.mark.parametrize(
    ("entry", "code"),
    [
        ("while True:\n    pass", "W545"),
        ("while 1:\n    self.sleep(0.1)", "W545"),
        ("self.sleep(1e9)", "W545"),
        ("self.sleep(3600)", "W523"),
        ("while True:\n    if self.clock.now() > 3:\n        break", ""),
        ("try:\n    while True:\n        next(it)\nexcept StopIteration:\n    pass", "W523"),
        ("while self.clock.now():\n    pass", ""),
    ],
)
def test_what_never_ends_is_more_than_slow(path: Path, entry: str, code: str) -> None:
    """A loop that an exception may end, and one on whose condition nothing is known, may end."""
    found = problems(
        path, document(sub(1, 0, state(1, "a", entry, initial=True), variables="it = iter([1])"))
    )
    assert [each.split(": ")[1] for each in found if "W521" not in each] == [code] * bool(code)
