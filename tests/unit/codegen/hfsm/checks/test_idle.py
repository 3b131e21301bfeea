"""Statements that do nothing."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.documents import document, problems, state, sub, transition


@pytest.mark.parametrize(
    ("code", "found"),
    [
        ("self.log.info", "`self.log.info` does nothing: it is not called"),
        ("if self.ready():\n    self.ready", "`self.ready` does nothing: it is not called"),
        ("count == 5", "`count == 5` compares, and does nothing else"),
        ("count = count == 5", None),
        ("try:\n    self.log.info\nexcept AttributeError:\n    count = 1", None),
        ("'a note'\nself.ready()", None),
    ],
)
def test_a_call_without_parentheses_and_a_comparison_alone_are_reported(
    path: Path, code: str, found: str | None
) -> None:
    text = document(
        sub(
            1, 0, state(1, "a", code, initial=True), transition(1, 1, 1, "count == 5"),
            variables="count = 0", functions="def ready(self):\n    return self.clock.now() > 1",
        )
    )  # fmt: skip
    said = problems(path, text)
    assert [each for each in said if "W525" in each] == said
    assert len(said) == (found is not None)
    assert all(f"W525: {found}" in each for each in said)
