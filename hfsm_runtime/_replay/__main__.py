"""Replay a recording in a separate process, and print what happens as lines of JSON.

This is what `visualhfsm replay` starts: it runs the code of documents, which the command itself never does.
"""

from __future__ import annotations

import logging
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from typing import Annotated, Final, NoReturn

import msgspec
import typer

from hfsm_runtime.recording_file.outcome import Begin, Line, Outcome, Progress
from hfsm_runtime.recording_file.reader import RecordingError
from zenoh_ice.application.cli import finite
from zenoh_ice.application.cli import run as run_command

from ..component import Component
from ..debugger.reload import components_in
from ..errors import ComponentError
from ..loading import load_module
from .run import Replay
from .script import Recording, ReplayError

_SECOND: Final = 1e9
_MOST_STEPS: Final = 20_000
_HANG_LIMIT: Final = 30.0
"""Wall seconds that a piece of user code may take until it asks for something recorded, or ends."""
_CHECK_PERIOD: Final = 0.2  # s between two checks whether it did
_numbers: Final = count(1)

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command()
def replay(
    recording: Annotated[Path, typer.Argument(metavar="RECORDING", help="The recording.")],
    component: Annotated[Path, typer.Argument(metavar="PYTHON", help="The component to run.")],
    edited: Annotated[
        Path | None, typer.Option(metavar="PYTHON", help="Another version, which takes over at --from.")
    ] = None,
    *,
    since: Annotated[
        float, typer.Option("--from", metavar="SECONDS", callback=finite, help="When that is.")
    ] = 0.0,
    until: Annotated[
        float | None, typer.Option(metavar="SECONDS", callback=finite, help="Where the replay ends.")
    ] = None,
    hang_limit: Annotated[float, typer.Option(hidden=True)] = _HANG_LIMIT,
) -> None:
    """Run a generated component against a recording, and compare.

    The output is lines of JSON: `begin`, then `end`. What user code prints goes to stderr.
    """
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # there is nothing to clean up, and user code may not end
    output = os.dup(1)
    os.dup2(2, 1)
    logging.disable(logging.CRITICAL)
    recorded = Recording(recording)
    end = recorded.duration if until is None else round(until * _SECOND)
    _report(output, Begin(recorded.duration / _SECOND, recorded.truncated, recorded.failures.spans()))
    made = _load(component)
    other = None if edited is None else _load(edited)

    def progress(seconds: float) -> None:
        _report(output, Progress(seconds))

    at = round(since * _SECOND)
    with Replay(recorded, made, end, edited=other, since=at, progress=progress) as run:

        def give_up(error: str) -> None:
            run.comparison.finish()
            _report(output, _outcome(run, error))
            os._exit(0)  # the code that hangs cannot be ended

        with _watched(run, give_up, hang_limit):
            error = ""
            try:
                run.run()
            except (ReplayError, RecordingError) as problem:
                error = str(problem)
                run.comparison.finish()
        _report(output, _outcome(run, error))


@contextmanager
def _watched(run: Replay, give_up: Callable[[str], None], limit: float) -> Iterator[None]:
    """Call a function when user code hangs for `limit` s in a `with` block."""
    over = threading.Event()

    def watch() -> None:
        seen, since = -1, time.monotonic()
        while not over.wait(_CHECK_PERIOD):
            if not run.running or run.answers.turns != seen:
                seen, since = run.answers.turns, time.monotonic()
            elif time.monotonic() - since >= limit:
                text = f"the code of {run.running} neither ends nor reads anything recorded"
                give_up(f"{text} within {limit:g} s")

    thread = threading.Thread(target=watch, name="watch of the replay", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def _outcome(run: Replay, error: str) -> Outcome:
    """Return how a replay ended."""
    comparison = run.comparison
    return Outcome(
        error=error,
        seconds=run.now() / _SECOND,
        cycles=comparison.cycles,
        identical=comparison.identical,
        missing_cycles=comparison.unmatched,
        divergences=comparison.divergences,
        differences=comparison.differences,
        recorded=comparison.recorded_steps[:_MOST_STEPS],
        replayed=comparison.replayed_steps[:_MOST_STEPS],
        guesses=run.guesses,
        notes=run.notes,
    )


def main() -> NoReturn:
    """Run the command."""
    run_command(app, expected=(ComponentError, RecordingError))


def _report(output: int, what: Line) -> None:
    line = msgspec.json.encode(what) + b"\n"
    with suppress(BrokenPipeError):
        while line:
            line = line[os.write(output, line) :]


def _load(file: Path) -> type[Component]:
    """Return the class of the component that a file defines; raises ReplayError.

    Its imports run, as they do when it is started.
    """
    name = f"{file.stem}_{next(_numbers)}"  # two versions of a component must not be one module
    sys.path.insert(0, str(file.parent))  # for handwritten code beside it
    try:
        module = load_module(name, file)
    except (Exception, SystemExit) as error:
        raise ReplayError(f"{file.name} cannot be loaded: {type(error).__name__}: {error}") from error
    finally:
        sys.path.remove(str(file.parent))
    components = components_in(module)
    if len(components) != 1:
        raise ReplayError(f"{file.name} defines {len(components)} components, not one")
    return components[0]


if __name__ == "__main__":
    main()
