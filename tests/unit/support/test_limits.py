"""The limits of tests/support/limits.py fit together; tools/lint/limits.py finds waits with others."""

from __future__ import annotations

import pytest

from tests.support import limits


@pytest.mark.parametrize("name", [name for name in limits.__all__ if name.endswith("_LIMIT")])
def test_what_takes_forever_takes_longer_than_every_limit(name: str) -> None:
    assert getattr(limits, name) < limits.FOREVER


def test_what_happens_at_once_does_so_before_the_longest_call_ends() -> None:
    assert limits.EVENT_LIMIT < limits.LONGEST_CALL
    assert limits.CALL_LIMIT <= limits.LONGEST_CALL
