"""What all tests of this repository stand on is in tests/support/suite.py."""

from __future__ import annotations

import pytest

pytest.register_assert_rewrite("tests.support")  # a failed assertion shows its values there, too
SUITE = "tests.support.suite"


def pytest_plugin_registered(manager: pytest.PytestPluginManager) -> None:
    """Load it with the first of these files: before pytest-xdist asks how many workers there are."""
    if not manager.has_plugin(SUITE):
        manager.import_plugin(SUITE)
