"""Ends of a component that no exception reports: user code that ends the process, or makes it crash.

In the component's own process, functions that end it at once first log where they are called, and a crash
writes the lines that led to it. Nothing else can: no further code of the process runs. The process that
started it learns from the `CycleFile` what was executed.
"""

from __future__ import annotations

import faulthandler
import logging
import os
import signal
import sys
from collections.abc import Callable
from pathlib import PurePath
from traceback import walk_stack
from types import FrameType
from typing import Any, Final

from zenoh_ice.application.last_cycle import CycleFile

from ._automaton import Transition
from ._cycle import run_cycle
from .observer import Observer
from .places import locate_frame
from .tree import Actor

_FATAL: Final = frozenset((signal.SIGKILL, signal.SIGQUIT))
"""Signals to itself by which a process ends without a word."""


def report_abrupt_ends(file: str) -> None:
    """Let this process, that of the component in a file, report where its code ends or crashes it."""
    if sys.stderr is not None:
        faulthandler.enable(all_threads=False)
    own = os.getpid()

    def reporting(name: str, is_end: Callable[..., bool]) -> Callable[..., Any]:
        function = getattr(os, name)

        def reports(*arguments: Any, **named: Any) -> Any:  # noqa: ANN401 - of the function
            if os.getpid() == own and is_end(*arguments):  # not in a process that user code has forked
                values = ", ".join(map(str, (*arguments, *named.values())))
                _report(f"os.{name}({values})", sys._getframe(1), file)
            return function(*arguments, **named)

        return reports

    def kills_itself(process: object = None, number: object = None) -> bool:
        return process in (own, 0) and number in _FATAL

    os._exit = reporting("_exit", lambda *_: True)
    os.abort = reporting("abort", lambda: True)
    os.kill = reporting("kill", kills_itself)


def _report(call: str, caller: FrameType, file: str) -> None:
    """Log a call that ends the process, if it is one in the code of the document."""
    ours = str(caller.f_globals.get("__name__")).startswith("zenoh_ice.application")  # at Ctrl-C
    location = "" if ours else locate_frame(caller, file)
    if location.endswith(")"):  # it has a place in the document
        logging.getLogger(PurePath(file).stem).error(
            "%s%s ends the process before it stops the robot; a final state ends it in order at %s",
            _running(caller),
            call,
            location,
        )


def _running(caller: FrameType) -> str:
    """Return the automaton and the state in whose cycle a line runs, as a prefix."""
    for frame, _ in walk_stack(caller):
        if frame.f_code is run_cycle.__code__:
            actor: Actor = frame.f_locals["actor"]
            return f"{actor.automaton.name}/{actor.current.name}: "
    return ""


class CycleNotes(Observer):
    """Keep what the automata of a component execute in a file of the process that started it."""

    def __init__(self, file: CycleFile) -> None:
        self._file: Final = file

    def cycle_began(self, actor: Actor, at: int) -> None:  # noqa: ARG002
        """Note the state."""
        self._file.write(actor.automaton.id, actor.current.id)

    def fired(self, actor: Actor, transition: Transition, at: int) -> None:  # noqa: ARG002
        """Note the transition."""
        self._file.write(actor.automaton.id, actor.current.id, transition.id)

    def entered(self, actor: Actor, transition: Transition | None) -> bool:  # noqa: ARG002
        """Note the new state."""
        self._file.write(actor.automaton.id, actor.current.id)
        return False

    def cycle_ended(self, actor: Actor, at: int) -> None:  # noqa: ARG002
        """Note that nothing is executed any more."""
        self._file.write(actor.automaton.id, actor.current.id, running=False)
