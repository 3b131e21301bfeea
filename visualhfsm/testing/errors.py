"""Errors in the test of a behavior."""

from __future__ import annotations

from hfsm_runtime.virtual.errors import ExecutionError


class DocumentInvalid(ExecutionError, ValueError):
    """A document has errors and cannot be run; the text is that of the compiler."""
