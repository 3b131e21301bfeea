"""Keep the process of the tests small."""

from __future__ import annotations

import ast
import ctypes
import gc
from collections.abc import Iterator
from contextlib import contextmanager
from functools import _lru_cache_wrapper
from typing import Any, Final

import psutil

from tests.support.places import ROOT

__all__ = ["Memory", "freeze", "garbage_that_parses"]

_GROWTH: Final = 32 << 20
"""A process that has grown by so many bytes looks for garbage."""
_ARENA_MAX: Final = -8
"""The parameter of glibc for the number of its heaps."""


class Memory:
    """Give back what tests have let go of, when the process has grown by much.

    Exceptions hold their frames, and frames what a test has received and sent: such cycles wait for the next
    collection of the oldest objects, which may be hundreds of tests away. Of threads that have ended, glibc keeps
    the memory for others, in eight heaps for each processor unless it is told to make fewer. Caches of ours, which
    are for the one document that somebody edits, fill with those of thousands of tests.
    """

    def __init__(self) -> None:
        self._process: Final = psutil.Process()
        library = ctypes.CDLL(None)
        self._trim: Final = getattr(library, "malloc_trim", None)  # other C libraries have none
        if self._trim is not None:
            library.mallopt(_ARENA_MAX, 2)
        self._known = self._resident()
        self._caches: tuple[_lru_cache_wrapper[Any], ...] = ()

    def keep_the_collected(self) -> None:
        """Leave what is imported and collected out of later garbage collections, and remember its caches."""
        gc.collect()  # garbage would stay with it
        self._caches = tuple(filter(_may_forget, gc.get_objects()))
        gc.freeze()

    def give_back(self) -> None:
        """Empty caches, collect garbage and give the system what is free, if the process has grown."""
        if self._resident() < self._known + _GROWTH:
            return
        for cache in self._caches:
            cache.cache_clear()
        gc.collect()
        if self._trim is not None:
            self._trim(0)
        self._known = self._resident()

    def _resident(self) -> int:
        return int(self._process.memory_info().rss)


def _may_forget(something: object) -> bool:
    """Return whether this is a cache of ours with a limit, which may let go of anything at any time."""
    if not isinstance(something, _lru_cache_wrapper) or something.cache_parameters()["maxsize"] is None:
        return False
    package = something.__module__.partition(".")[0]
    return (ROOT / package).is_dir() or any(ROOT.glob(f"plugins/*/src/{package}"))


def freeze() -> None:
    """Leave all that there is out of later collections, which would look at it for half a second each time.

    `gc.unfreeze` does not follow: it would return to them what `tests/support/suite.py` has left out, too.
    """
    gc.collect()
    gc.freeze()


class _Parses:
    def __init__(self) -> None:
        self.itself = self

    def __del__(self) -> None:
        ast.parse("a + b")


@contextmanager
def garbage_that_parses() -> Iterator[None]:
    """Leave garbage that parses when it is collected, as the warnings of some libraries do for their tracebacks.

    It is collected in the block, once a tree of some hundred nodes is made.
    """
    thresholds = gc.get_threshold()
    freeze()
    gc.disable()
    for _ in range(3):
        _Parses()
    gc.set_threshold(700, 1, 1)
    gc.enable()
    try:
        yield
    finally:
        gc.set_threshold(*thresholds)
