"""Tests of plug-ins stand on what those of the core stand on."""

from __future__ import annotations

import pytest

from tests.conftest import pytest_plugin_registered

__all__ = ["pytest_plugin_registered"]

pytest.register_assert_rewrite("plugins")
