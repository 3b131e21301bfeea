"""Run the command `nao` in this process, against a robot that a test serves."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from unittest.mock import patch

from typer.testing import CliRunner

from deploy.nao.command import app
from zenoh_ice import ZenohIceError

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


def nao(*words: str, stdin: bytes | None = None) -> Outcome:
    """Run `nao` with arguments; errors become one line on stderr, as with `hfsm_command.cli.run`."""
    result = CliRunner().invoke(app, words, prog_name="nao", input=stdin, env={"COLUMNS": "80"})
    error = result.exception
    if isinstance(error, ZenohIceError):
        return Outcome(1, result.stdout, f"nao: error: {' '.join(str(error).split())}\n")
    if error is not None and not isinstance(error, SystemExit):
        raise error
    return Outcome(result.exit_code, result.stdout, result.stderr)
