"""Calls that block an automaton for longer than its period."""

from __future__ import annotations

from pathlib import Path

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
