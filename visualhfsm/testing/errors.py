"""Errors in the test of a behavior."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pytest


class UnknownName(LookupError):
    """A test names an automaton, a transition or a ball that does not exist; the text lists those that do."""


class DocumentInvalid(ValueError):
    """A document has errors and cannot be run; the text is that of the compiler."""


class BehaviorFailed(AssertionError):
    """The behavior did what a test does not allow: its code raised, or an expected event never happened."""


def says_it_all(caught: pytest.ExceptionInfo[BaseException]) -> bool:
    """Return whether an exception is an error of the test, so that pytest need not show our code.

    A module assigns it to `__tracebackhide__`.
    """
    return caught.errisinstance((BehaviorFailed, DocumentInvalid, UnknownName))
