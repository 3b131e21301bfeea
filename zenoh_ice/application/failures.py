"""What a command says when it fails."""

from __future__ import annotations

import errno
import logging
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

import typer

from ..text import printable

_LONGEST_ERROR: Final = 1 << 16

_logger = logging.getLogger(__name__)


@contextmanager
def errors_reported(expected: tuple[type[Exception], ...] = ()) -> Iterator[None]:
    """End the process with exit code 1 after an error in a `with` block that one line can report.

    These are the `expected` ones, a full disk, and a reader of the output that is gone, of whom nobody hears.
    """
    why: str | None
    try:
        try:
            yield
        except SystemExit:
            sys.stdout.flush()
            raise
        return
    except expected as error:
        _logger.debug("the command failed", exc_info=True)
        why = str(error)
    except BrokenPipeError:
        why = None  # nobody reads on, as after `| head`
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EDQUOT):
            raise
        why = f"cannot write{f' {error.filename}' if error.filename else ''}: {error.strerror}"
    _end_output()
    if why is not None:
        from ..status import program_name  # here: it takes long to load

        typer.echo(f"{program_name()}: error: {printable(' '.join(why.split()), _LONGEST_ERROR)}", err=True)
    sys.exit(1)


def _end_output() -> None:
    """Write what is left of the output, or drop it: Python would try again at its end, and complain."""
    try:
        sys.stdout.flush()
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
