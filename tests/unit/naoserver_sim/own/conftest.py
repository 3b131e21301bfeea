"""Tests of models keep nothing in the user's cache."""

import pytest


@pytest.fixture(autouse=True)
def no_cache(monkeypatch):
    """Let meshes be converted anew."""
    monkeypatch.setenv("XDG_CACHE_HOME", "/dev/null")
