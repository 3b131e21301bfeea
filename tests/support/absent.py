"""Take plug-ins away, as if they were not installed."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from zenoh_ice import plugins


@contextmanager
def without(*packages: str) -> Iterator[None]:
    """Let some packages not be found in a `with` block, and nothing that they add to a seam."""
    own = {name for name in sys.modules if name.partition(".")[0] in packages}
    with pytest.MonkeyPatch.context() as patch:
        for name in own.union(packages):
            patch.setitem(sys.modules, name, None)
        _forget()
        try:
            yield
        finally:
            patch.undo()
            _forget()


def _forget() -> None:
    plugins.names.cache_clear()
    plugins.find.cache_clear()
