"""Run components that are trees of automata.

A generated component is a `Component` whose `automaton` returns the structure; `main` is its command line.
`VirtualRun` runs one in virtual time, for tests.

One cycle: if an ancestor's current state is not the one that owns the chain down to the automaton, it is a
*ghost*, and none of its code runs; else the transitions out of the current state are tried by priority, then
in document order, with the oldest event of the automaton's queue, and the first that holds fires (decision
21); then the code of the current state runs. When a parent leaves a state, the child's cycle ends before the
parent's new state runs code: two automata never drive the robot together. Variables belong to one automaton;
a state passes inputs down at its entry, and takes outputs at the beginning of each cycle, as the last
finished cycle below left them (decision 40). docs/reference/automata.md is the language.

The core, from the bottom up:

- `automaton`: the structure, as a generated component returns it;
- `phases`, `actor`, `tree`: where each automaton is, how far it has come in its state, and how that changes;
- `cycle`: one cycle, as one function; `_holds` in it tries a transition: its event or its delay, then its
  condition, which code calls a guard;
- `turns`: whose cycle comes first (decision 28);
- `supervision`: the reaction to an error; `own_threads`: what ends threads that user code starts; `stop`:
  what stops the servants; `proofs`: whether what proofs rely on is so (decision 48);
- `component`: what user code sees as `self`.

In real time, `runtime` runs each automaton in its own thread, at its own period; in virtual time
(`virtual/`) one thread runs the same cycles: code that sleeps is left where it does (`coroutine`), and others
run meanwhile (decision 45). `component_run` is what both share: the life of a component, and what clients may
do to it. `command`, a component's command line, puts the parts together.

`Observer` (`observer`) is the core's only hook: it is notified of every cycle, guard, transition and change,
and may ask for a pause where a state is entered. Threads, debugger, recordings, tests and coverage are
observers; the core knows none of the folders beside it. `debugger/` steers a running component, `recording/`
writes down what one sees, by an observer and a transport, `recording_file/` is the file, and `replay/` a
virtual run whose clock and proxies answer from it (decision 31).

A component has one clock: steady wall time, or the robot's time from its `Clock` servant (`--clock
auto|wall|sim`). Sleeps and timers of behaviors use it: a simulator at five times real time makes the whole
stack five times as fast.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from zenoh_ice.lazy import import_on_use

from .loading import add_to_path, end_loading, load_extension, prepare_program, program_file

prepare_program()  # before the slow imports

from ._automaton import Automaton, Event, Input, Output, State, Transition  # noqa: E402
from .component import Component, Parameter, Proxy  # noqa: E402
from .ending import report_abrupt_ends  # noqa: E402
from .errors import ComponentError  # noqa: E402

if program_file():
    report_abrupt_ends(program_file())  # before the document's libraries

if TYPE_CHECKING:
    from typing import Any, NoReturn

    from .virtual._run import VirtualRun as VirtualRun
    from .virtual._run import run as run

__all__ = [
    "Automaton",
    "Component",
    "ComponentError",
    "Event",
    "Input",
    "Output",
    "Parameter",
    "Proxy",
    "State",
    "Transition",
    "VirtualRun",
    "add_to_path",
    "load_extension",
    "main",
    "run",
]

_import, __dir__ = import_on_use(__name__)  # for tests


def __getattr__(name: str) -> Any:  # noqa: ANN401
    from .kinds import NAMES, imported  # few components have endpoints

    return imported(name) if name in NAMES else _import(name)


def main(component: type[Component]) -> NoReturn:
    """Run a component from the command line, and exit: see `hfsm_runtime.command`."""
    end_loading()
    from .command import main as run_command  # a component in a test needs neither Zenoh nor a command line

    run_command(component)
