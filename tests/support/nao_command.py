"""Run the command `nao` in this process, against a robot that a test serves."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from unittest.mock import patch

from nao_tools._command import app
from nao_tools._stopping import StopLimits
from tests.support.commands import run_here

__all__ = ["Outcome", "at", "nao"]


@dataclass(frozen=True)
class Outcome:
    """The output and the exit code of a command."""

    code: int
    out: str
    err: str

    @property
    def text(self) -> str:
        """Both streams together."""
        return self.out + self.err


@contextmanager
def at(endpoint: str, realm: str) -> Iterator[None]:
    """Connect commands to the servers of a realm at an endpoint."""
    with patch.dict(os.environ, {"VISUALHFSM_CONNECT": endpoint, "VISUALHFSM_REALM": realm}):
        yield


def nao(*words: str, stdin: bytes = b"", limits: StopLimits | None = None) -> Outcome:
    """Run `nao` with arguments, and with the limits of `nao stop` if they are given."""
    done = run_here(app, "nao", *words, stdin=stdin, columns=80, limits=limits)
    return Outcome(done.returncode, done.stdout, done.stderr)
