"""Errors of who runs a component in virtual time: a test, a trial, or another program."""

from __future__ import annotations

from typing import Protocol

from ..errors import UnknownElementError


class ExecutionError(Exception):
    """The base class of these errors, whose texts say it all."""


class UnknownName(ExecutionError, UnknownElementError, LookupError):
    """A name of an automaton, a transition or a ball that does not exist; the text lists those that do."""


class BehaviorFailed(ExecutionError, AssertionError):
    """The behavior did what is not allowed: its code raised, or an expected event never happened."""


class _Caught(Protocol):
    """An exception that pytest has caught."""

    @property
    def value(self) -> BaseException: ...


def says_it_all(caught: _Caught) -> bool:
    """Return whether an exception is one of these errors, so that pytest need not show our code.

    A module assigns it to `__tracebackhide__`.
    """
    return isinstance(caught.value, ExecutionError)
